// Included once by each lane_walk_*.cpp, inside its own namespace and with its own instructions: plain loops that the
// compiler turns into vectors. No include guard on purpose; everything is static.

/// octomap::OcTreeBaseImpl::coordToKeyChecked on one axis; outside of [0, 65535] where that fails. The comparison with
/// the truncated value makes it a floor.
static inline std::int32_t lattice_key(double scaled) {
  constexpr double kBelow = -kKeyOrigin - 1.0;
  constexpr double kAbove = kKeyOrigin;
  const double above = scaled > kBelow ? scaled : kBelow;  // NaN: below
  const double within = above < kAbove ? above : kAbove;
  const auto truncated = static_cast<std::int32_t>(within);
  return truncated - (within < static_cast<double>(truncated) ? 1 : 0) + kKeyOrigin;
}

static std::size_t transform(const ScanFrame& frame, const Eigen::Vector3f* points_m, std::size_t first,
                             std::size_t count, RayColumns& rays) {
  const std::array<float, 9> R = frame.rotation;
  const std::array<float, 3> t = frame.origin_m;
  if (count == 0) return 0;
  const float* in = points_m->data() + 3 * first;
  float* const x = rays.point_m[0].data() + first;
  float* const y = rays.point_m[1].data() + first;
  float* const z = rays.point_m[2].data() + first;
  std::int32_t bad = 0;
  STAIRWELL_INDEPENDENT_ROUNDS
  for (std::size_t i = 0; i < count; ++i) {
    const float px = in[3 * i], py = in[3 * i + 1], pz = in[3 * i + 2];
    // In this order of roundings, whatever the instructions.
    const float wx = ((R[0] * px + R[1] * py) + R[2] * pz) + t[0];
    const float wy = ((R[3] * px + R[4] * py) + R[5] * pz) + t[1];
    const float wz = ((R[6] * px + R[7] * py) + R[8] * pz) + t[2];
    const float nothing = (wx - wx) + (wy - wy) + (wz - wz);  // NaN unless all are finite
    bad += nothing == 0.0F ? 0 : 1;
    x[i] = wx + nothing;
    y[i] = wy + nothing;
    z[i] = wz + nothing;
  }
  return static_cast<std::size_t>(bad);
}

static void find_ends(const ScanFrame& frame, std::size_t first, std::size_t count, RayColumns& rays,
                      LatticeBox& reach) {
  const float* const px = rays.point_m[0].data() + first;
  const float* const py = rays.point_m[1].data() + first;
  const float* const pz = rays.point_m[2].data() + first;
  float* const ex = rays.end_m[0].data() + first;
  float* const ey = rays.end_m[1].data() + first;
  float* const ez = rays.end_m[2].data() + first;
  std::int32_t* const kx = rays.key[0].data() + first;
  std::int32_t* const ky = rays.key[1].data() + first;
  std::int32_t* const kz = rays.key[2].data() + first;
  std::int32_t* const flags = rays.flags.data() + first;
  const auto [ox, oy, oz] = frame.origin_m;
  const float squared_range = frame.squared_range_m2;
  const float range = frame.range_m;
  STAIRWELL_INDEPENDENT_ROUNDS
  for (std::size_t i = 0; i < count; ++i) {
    const float vx = px[i] - ox, vy = py[i] - oy, vz = pz[i] - oz;
    const float squared = vx * vx + vy * vy + vz * vz;
    const float length = std::sqrt(squared);  // the root of a float taken in double rounds to the same float
    const float divisor = length > 0.0F ? length : 1.0F;
    const bool hit = squared <= squared_range;
    ex[i] = hit ? px[i] : ox + (vx / divisor) * range;
    ey[i] = hit ? py[i] : oy + (vy / divisor) * range;
    ez[i] = hit ? pz[i] : oz + (vz / divisor) * range;
    flags[i] = hit ? RayColumns::kHit : 0;
  }
  const double per_m = frame.per_m;
  const auto [okx, oky, okz] = frame.origin_key;
  std::int32_t lo_x = reach.lo.x, lo_y = reach.lo.y, lo_z = reach.lo.z;
  std::int32_t hi_x = reach.hi.x, hi_y = reach.hi.y, hi_z = reach.hi.z;
  STAIRWELL_INDEPENDENT_ROUNDS
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t at_x = lattice_key(per_m * static_cast<double>(ex[i]));
    const std::int32_t at_y = lattice_key(per_m * static_cast<double>(ey[i]));
    const std::int32_t at_z = lattice_key(per_m * static_cast<double>(ez[i]));
    const bool inside = ((at_x | at_y | at_z) & ~0xFFFF) == 0;
    const std::int32_t x = inside ? at_x : okx;
    const std::int32_t y = inside ? at_y : oky;
    const std::int32_t z = inside ? at_z : okz;
    kx[i] = x;
    ky[i] = y;
    kz[i] = z;
    flags[i] = inside ? flags[i] : RayColumns::kOutside;
    lo_x = x < lo_x ? x : lo_x;
    lo_y = y < lo_y ? y : lo_y;
    lo_z = z < lo_z ? z : lo_z;
    hi_x = x > hi_x ? x : hi_x;
    hi_y = y > hi_y ? y : hi_y;
    hi_z = z > hi_z ? z : hi_z;
  }
  reach = {{lo_x, lo_y, lo_z}, {hi_x, hi_y, hi_z}};
}

static LatticeBox find_keys(double per_m, RayColumns& rays) {
  const std::size_t count = rays.size();
  std::int32_t lowest[3], highest[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* const point_m = rays.point_m[axis].data();
    std::int32_t* const keys = rays.key[axis].data();
    // Keys out of range are -1 or 65536: as unsigned numbers never the least, counted from either end.
    std::uint32_t from_below = 0xFFFFFFFFU, from_above = 0xFFFFFFFFU;
    for (std::size_t i = 0; i < count; ++i) {
      const std::int32_t key = lattice_key(per_m * static_cast<double>(point_m[i]));
      const auto up = static_cast<std::uint32_t>(key);
      const auto down = static_cast<std::uint32_t>(0xFFFF - key);
      keys[i] = key;
      from_below = up < from_below ? up : from_below;
      from_above = down < from_above ? down : from_above;
    }
    const bool any = from_below <= 0xFFFFU;
    lowest[axis] = any ? static_cast<std::int32_t>(from_below) : 0;
    highest[axis] = any ? 0xFFFF - static_cast<std::int32_t>(from_above) : -1;
  }
  return {{lowest[0], lowest[1], lowest[2]}, {highest[0], highest[1], highest[2]}};
}

/// One axis of `prepare`: distances of the borders in units of 2^-29 of the ray.
static inline void prepare_axis(float along, float up_m, float down_m, float resolution_m, float scale,
                                std::int32_t cell_stride, std::int32_t& t, std::int32_t& delta, std::int32_t& stride) {
  constexpr auto kFarF = static_cast<float>(lanes::kFar);
  const float inverse = 1.0F / along;
  const float first = (along > 0.0F ? up_m : down_m) * inverse * scale;
  const float every = std::fabs(resolution_m * inverse) * scale;
  const bool never = (first >= kFarF) | (along == 0.0F);  // NaN, a border at the origin: at once
  t = static_cast<std::int32_t>(never ? kFarF : (first > 0.0F ? first : 0.0F));
  delta = static_cast<std::int32_t>(every < kFarF ? every : kFarF);
  stride = along > 0.0F ? cell_stride : -cell_stride;
}

static std::size_t prepare(const ScanFrame& frame, const RayColumns& rays, std::size_t first, std::size_t count,
                           const WindowView& window, RayBatch& batch) {
  constexpr float kShortest_m = 1e-15F;  // as in RayWalker
  const float* const ex = rays.end_m[0].data() + first;
  const float* const ey = rays.end_m[1].data() + first;
  const float* const ez = rays.end_m[2].data() + first;
  const std::int32_t* const kx = rays.key[0].data() + first;
  const std::int32_t* const ky = rays.key[1].data() + first;
  const std::int32_t* const kz = rays.key[2].data() + first;
  const auto [ox, oy, oz] = frame.origin_m;
  const auto [okx, oky, okz] = frame.origin_key;
  const WindowView w = window;
  std::int32_t steps = 0;
  STAIRWELL_INDEPENDENT_ROUNDS
  for (std::size_t i = 0; i < count; ++i) {
    const float vx = ex[i] - ox, vy = ey[i] - oy, vz = ez[i] - oz;
    const float length = std::sqrt(vx * vx + vy * vy + vz * vz);
    const float scale = static_cast<float>(lanes::kLength) / length;
    prepare_axis(vx / length, frame.border_up_m[0], frame.border_down_m[0], frame.resolution_m, scale, w.stride[0],
                 batch.t[0][i], batch.delta[0][i], batch.stride[0][i]);
    prepare_axis(vy / length, frame.border_up_m[1], frame.border_down_m[1], frame.resolution_m, scale, w.stride[1],
                 batch.t[1][i], batch.delta[1][i], batch.stride[1][i]);
    prepare_axis(vz / length, frame.border_up_m[2], frame.border_down_m[2], frame.resolution_m, scale, w.stride[2],
                 batch.t[2][i], batch.delta[2][i], batch.stride[2][i]);

    const std::int32_t nx = std::abs(kx[i] - okx), ny = std::abs(ky[i] - oky), nz = std::abs(kz[i] - okz);
    const std::int32_t most = nx > ny ? (nx > nz ? nx : nz) : (ny > nz ? ny : nz);
    const bool covered = (static_cast<std::uint32_t>(kx[i] - w.lo[0]) < w.extent[0]) &
                         (static_cast<std::uint32_t>(ky[i] - w.lo[1]) < w.extent[1]) &
                         (static_cast<std::uint32_t>(kz[i] - w.lo[2]) < w.extent[2]);
    const bool still = most == 0;  // ends where it begins, or outside the key space: nothing to walk
    const bool walkable = (length > kShortest_m) & (length < std::numeric_limits<float>::infinity()) & covered &
                          (most < lanes::kMaxSteps) & (w.origin_cell >= 0);
    const std::int32_t end =
        (kx[i] - w.first[0]) * w.stride[0] + (ky[i] - w.first[1]) * w.stride[1] + (kz[i] - w.first[2]) * w.stride[2];
    batch.end[i] = walkable & !still ? end : w.origin_cell;
    batch.special[i] = !walkable & !still ? 1 : 0;
    steps += walkable ? nx + ny + nz : 0;
  }
  return static_cast<std::size_t>(steps);
}
