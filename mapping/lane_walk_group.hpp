// Included by lane_walk_scalar.cpp and lane_walk_avx2.cpp after lane_walk_kernels.hpp: the walk for `kLanes` rays in
// the compiler's own vectors. Needs `int going_lanes(const Integers&)`, the number of lanes that are -1, and lower_of
// and higher_of of two vectors of positive numbers. No include guard on purpose; everything is static.

/// Sets one lane of a vector, without a way through memory.
static inline Integers with_lane(Integers values, Integers lane, std::int32_t value) {
  return lane ? Integers{} + value : values;
}

struct Lanes {
  Integers t[3];
  Integers delta[3];
  Integers stride[3];
  Integers cell;
  Integers end;
  Integers ray;
};

/// The next ray of the batch; when there is none, a lane that marks the spare cell for ever.
static inline void load_lane(Lanes& lanes, int lane, const RayBatch& batch, std::size_t count, std::size_t& next,
                             const WindowView& window) {
  const Integers here = kNumbers == (Integers{} + lane);
  const bool idle = next >= count;
  const std::size_t ray = idle ? 0 : next;
  for (int axis = 0; axis < 3; ++axis) {
    lanes.t[axis] = with_lane(lanes.t[axis], here, idle ? (axis == 0 ? 0 : lanes::kFar) : batch.t[axis][ray]);
    lanes.delta[axis] = with_lane(lanes.delta[axis], here, idle ? 0 : batch.delta[axis][ray]);
    lanes.stride[axis] = with_lane(lanes.stride[axis], here, idle ? 0 : batch.stride[axis][ray]);
  }
  lanes.cell = with_lane(lanes.cell, here, idle ? window.spare_cell : window.origin_cell);
  lanes.end = with_lane(lanes.end, here, idle ? -1 : batch.end[ray]);
  lanes.ray = with_lane(lanes.ray, here, static_cast<std::int32_t>(ray));
  next += idle ? 0 : 1;
}

static void walk(const RayBatch& batch, std::size_t count, const WindowView& window, std::int32_t tolerance,
                 std::vector<std::uint32_t>& uncertain) {
  std::uint8_t* const cells = window.cells;
  const Integers spare = Integers{} + window.spare_cell;
  Lanes lanes{};
  std::size_t next = 0;
  std::size_t left = count;  // rays not finished
  for (int lane = 0; lane < kLanes; ++lane) load_lane(lanes, lane, batch, count, next, window);
  while (left > 0) {
    const int enough = next < count ? kEnough : 1;  // lanes that wait before they are served
    Integers going;
    for (;;) {
      const Integers xy = lower_of(lanes.t[0], lanes.t[1]);
      const Integers nearest = lower_of(xy, lanes.t[2]);
      const Integers second = higher_of(xy, lower_of(higher_of(lanes.t[0], lanes.t[1]), lanes.t[2]));
      const Integers as_near = nearest + tolerance;
      going = (second > as_near) & (as_near <= lanes::kLength) & (lanes.cell != lanes.end);
      if (going_lanes(going) <= kLanes - enough) break;
      Integers marked = going ? lanes.cell : spare;
      __asm__ volatile("" : "+m"(marked));  // through memory: taking the lanes apart in registers is slower
      for (int lane = 0; lane < kLanes; ++lane) cells[static_cast<std::uint32_t>(marked[lane])] = ScanWindow::kMiss;
      const Integers along_x = (lanes.t[0] <= as_near) & going;
      const Integers along_y = (lanes.t[1] <= as_near) & going;
      const Integers along_z = (lanes.t[2] <= as_near) & going;
      lanes.t[0] += lanes.delta[0] & along_x;
      lanes.t[1] += lanes.delta[1] & along_y;
      lanes.t[2] += lanes.delta[2] & along_z;
      lanes.cell += (lanes.stride[0] & along_x) | (lanes.stride[1] & along_y) | (lanes.stride[2] & along_z);
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      if (going[lane] != 0) continue;
      --left;
      if (lanes.cell[lane] != lanes.end[lane]) uncertain.push_back(static_cast<std::uint32_t>(lanes.ray[lane]));
      load_lane(lanes, lane, batch, count, next, window);
    }
  }
}
