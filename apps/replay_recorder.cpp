#include "apps/replay_recorder.hpp"

#include "apps/byte_codec.hpp"
#include "apps/due.hpp"
#include "apps/voxel_scene.hpp"
#include "mapping/summary_bits.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

namespace stairwell::apps {

using mapping::ExpectedOccupancy;

namespace {

constexpr std::size_t kChunk_bytes = 48 * 1024;
constexpr double kPlanStep_s = 0.15;
constexpr double kMostPlanPoints = 80.0;

std::uint64_t milliseconds(double time_s) { return static_cast<std::uint64_t>(std::llround(time_s * 1e3)); }

coverage3d::FrontierConfig frontier_config(const explore::FleetConfig& fleet) {
  coverage3d::FrontierConfig config;
  config.box = fleet.task_box;
  return config;
}

CellOrder coarse(const GridSpec& grid, int factor) {
  CellOrder order;
  for (std::size_t a = 0; a < 3; ++a) order.size[a] = (grid.size()[a] + factor - 1) / factor;
  return order;
}

}  // namespace

ReplayRecorder::ReplayRecorder(const std::filesystem::path& folder, const explore::FleetConfig& fleet,
                               const GridSpec& grid, std::size_t uavs, std::uint64_t keep_bytes)
    : grid_(grid),
      cells_{grid.size()},
      frontier_cells_(coarse(grid, kFrontierCell)),
      file_(folder / "replay.bin", keep_bytes),
      occupied_(grid.voxel_count()),
      newly_known_(uavs),
      frontier_(grid, frontier_config(fleet)) {
  if (keep_bytes > 0) return;
  file_.append(kReplayMagic);
  put(ReplayRecord::kHeader, header(fleet, uavs));
}

std::string ReplayRecorder::header(const explore::FleetConfig& fleet, std::size_t uavs) const {
  const SensorModel& sensor = fleet.sensor;
  const nlohmann::ordered_json j = {{"resolution_m", grid_.resolution_m()},
                                    {"first_cell", grid_.first_cell()},
                                    {"size", grid_.size()},
                                    {"uavs", uavs},
                                    {"robot_radius_m", fleet.robot.radius_m},
                                    {"frontier_cell", kFrontierCell},
                                    {"sensor",
                                     {{"azimuth_fov_rad", sensor.azimuth_fov_rad},
                                      {"elevation_lo_rad", sensor.elevation_lo_rad},
                                      {"elevation_hi_rad", sensor.elevation_hi_rad},
                                      {"min_range_m", sensor.min_range_m},
                                      {"max_range_m", sensor.max_range_m}}}};
  return j.dump();
}

void ReplayRecorder::put(ReplayRecord kind, std::string_view payload) {
  put_record(records_, kind, payload);
  if (records_.size() < kChunk_bytes) return;
  file_.append(replay_chunk(records_));
  records_.clear();
}

void ReplayRecorder::resume(const mapping::OccupancyMap& map) {
  for (std::size_t i = 0; i < grid_.voxel_count(); ++i) {
    const VoxelIndex v = grid_.voxel(i);
    if (map.at(v) == Occupancy::kOccupied) occupied_.flip(i);
  }
  followed_[&map] = {0, map.known_voxels()};
}

void ReplayRecorder::on_scan(std::size_t uav, const mapping::OccupancyMap& map) {
  Followed& followed = followed_[&map];
  if (followed.revision > map.revision()) followed = {};  // another map in the place of one that is gone
  map.for_each_block_changed_since(followed.revision, [&](const mapping::VoxelBox& box) {
    constexpr int kStep = 8;
    for (int z = box.lo.z; z <= box.hi.z; ++z) {
      for (int y = box.lo.y; y <= box.hi.y; ++y) {
        for (int x = box.lo.x; x <= box.hi.x; x += kStep) {
          const std::size_t first = grid_.linear({x, y, z});
          const mapping::EightSummaries there(map.summaries() + first, std::min(kStep, box.hi.x + 1 - x));
          // Unknown ones stay as they are: others may know more.
          std::uint32_t changed = (there.occupied() ^ occupied_.eight_from(first)) & there.known();
          for (; changed != 0; changed &= changed - 1) {
            const int at = std::countr_zero(changed);
            occupied_.flip(first + static_cast<std::size_t>(at));
            toggles_.push_back({cells_.cell({x + at, y, z}), uav});
          }
        }
      }
    }
  });
  followed.revision = map.revision();
  newly_known_.at(uav) += map.known_voxels() - std::min(followed.known, map.known_voxels());
  followed.known = map.known_voxels();
}

void ReplayRecorder::on_trajectory(double time_s, std::size_t uav, const Trajectory& trajectory) {
  const double duration_s = trajectory.end_time_s() - trajectory.start_time_s();
  const double steps = std::clamp(std::ceil(duration_s / kPlanStep_s), 1.0, kMostPlanPoints);
  std::string payload;
  put_varint(payload, milliseconds(time_s));
  put_varint(payload, uav);
  put_varint(payload, milliseconds(trajectory.start_time_s()));
  put_varint(payload, milliseconds(duration_s));
  put_varint(payload, static_cast<std::uint64_t>(steps) + 1);
  std::array<std::int64_t, 3> last{0, 0, 0};
  for (double k = 0.0; k <= steps; k += 1.0) {
    const Eigen::Vector3d at_m = trajectory.sample(trajectory.start_time_s() + k / steps * duration_s).position_m;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t cm = std::llround(at_m[static_cast<Eigen::Index>(a)] * 100.0);
      put_signed(payload, cm - last[a]);
      last[a] = cm;
    }
  }
  put(ReplayRecord::kPlan, payload);
}

void ReplayRecorder::record(double time_s, double tick_s, const mapping::OccupancyMap& map,
                            mapping::WorkerPool* workers) {
  time_s_ = time_s;
  if (due(time_s, tick_s, kVoxelPeriod_s)) write_voxels();
  if (due(time_s, tick_s, kFrontierPeriod_s) || !frontier_written_) write_frontiers(map, workers);
}

/// A voxel that changed and changed back within the period did not change.
void ReplayRecorder::write_voxels() {
  std::ranges::stable_sort(toggles_, {}, &Toggle::cell);
  struct Changes {
    std::vector<std::uint64_t> on, off;
  };
  std::vector<Changes> by_uav(newly_known_.size());
  for (std::size_t i = 0, end = 0; i < toggles_.size(); i = end) {
    while (end < toggles_.size() && toggles_[end].cell == toggles_[i].cell) ++end;
    if ((end - i) % 2 == 0) continue;
    Changes& changes = by_uav[toggles_[end - 1].uav];
    (occupied(toggles_[i].cell) ? changes.on : changes.off).push_back(toggles_[i].cell);
  }
  toggles_.clear();
  for (std::size_t uav = 0; uav < by_uav.size(); ++uav) {
    if (by_uav[uav].on.empty() && by_uav[uav].off.empty()) continue;
    std::string payload;
    put_varint(payload, milliseconds(time_s_));
    put_varint(payload, uav);
    put_cells(payload, by_uav[uav].on);
    put_cells(payload, by_uav[uav].off);
    put(ReplayRecord::kVoxels, payload);
  }
  if (std::ranges::all_of(newly_known_, [](std::uint64_t n) { return n == 0; })) return;
  std::string payload;
  put_varint(payload, milliseconds(time_s_));
  for (std::uint64_t& count : newly_known_) put_varint(payload, std::exchange(count, 0));
  put(ReplayRecord::kKnown, payload);
}

void ReplayRecorder::write_frontiers(const mapping::OccupancyMap& map, mapping::WorkerPool* workers) {
  const coverage3d::FrontierCells::Changes changes = frontier_.update(map, workers);
  const auto sorted = [this](const std::vector<VoxelIndex>& cells) {
    std::vector<std::uint64_t> numbers;
    numbers.reserve(cells.size());
    for (const VoxelIndex& cell : cells) numbers.push_back(frontier_cells_.cell(cell));
    std::ranges::sort(numbers);
    return numbers;
  };
  std::string payload;
  put_varint(payload, milliseconds(time_s_));
  put_varint(payload, frontier_written_ ? 0 : 1);  // 1: what was before this record is void
  put_cells(payload, sorted(changes.added));
  put_cells(payload, sorted(changes.removed));
  put(ReplayRecord::kFrontier, payload);
  frontier_written_ = true;
}

std::uint64_t ReplayRecorder::flush() {
  write_voxels();
  if (!records_.empty()) file_.append(replay_chunk(records_));
  records_.clear();
  return file_.flush();
}

void ReplayRecorder::write_difference(const mapping::OccupancyMap& map,
                                      const std::function<ExpectedOccupancy(const VoxelIndex&)>& expected) {
  std::vector<std::uint64_t> false_occupied, false_free;
  for (std::uint64_t cell = 0; cell < grid_.voxel_count(); ++cell) {
    const VoxelIndex v = cells_.voxel(cell);
    const Occupancy seen = map.at(v);
    if (seen == Occupancy::kUnknown) continue;
    const ExpectedOccupancy truth = expected(v);
    if (seen == Occupancy::kOccupied && truth == ExpectedOccupancy::kFree) false_occupied.push_back(cell);
    if (seen == Occupancy::kFree && truth == ExpectedOccupancy::kOccupied) false_free.push_back(cell);
  }
  std::string payload;
  put_cells(payload, false_occupied);
  put_cells(payload, false_free);
  put(ReplayRecord::kDifference, payload);
}

/// Bits 0 to 5: the neighbour at -x, +x, -y, +y, -z, +z is known to be free.
void ReplayRecorder::write_open_sides(const mapping::OccupancyMap& map) {
  constexpr std::array<VoxelIndex, 6> kSides{{{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
  std::string sides;
  for (std::uint64_t cell = 0; cell < grid_.voxel_count(); ++cell) {
    if (!occupied(cell)) continue;
    unsigned open = 0;
    for (std::size_t i = 0; i < kSides.size(); ++i) {
      if (map.at(cells_.voxel(cell) + kSides[i]) == Occupancy::kFree) open |= 1U << i;
    }
    sides += static_cast<char>(open);
  }
  std::string payload;
  put_varint(payload, sides.size());
  put(ReplayRecord::kOpenSides, payload + sides);
}

void ReplayRecorder::write_storeys(const mapping::OccupancyMap& map) {
  nlohmann::json storeys = nlohmann::json::array();
  for (const Storey& storey : find_storeys(make_scene(map), 1.0)) {
    storeys.push_back({storey.floor_m, storey.ceiling_m});
  }
  put(ReplayRecord::kStoreys, storeys.dump());
}

void ReplayRecorder::publish(const mapping::OccupancyMap& map,
                             const std::function<ExpectedOccupancy(const VoxelIndex&)>& expected) {
  write_voxels();
  write_frontiers(map, nullptr);
  write_difference(map, expected);
  write_open_sides(map);
  write_storeys(map);
  flush();
  file_.publish();
}

}  // namespace stairwell::apps
