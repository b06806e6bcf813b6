/// A world of ours as a map in which everything is known, for benchmarks of planning.
#pragma once

#include "core/rng.hpp"
#include "core/robot.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/occupancy_words.hpp"
#include "planning3d/free_space.hpp"
#include "sim3d/ground_truth.hpp"
#include "sim3d/world.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <ctime>
#include <filesystem>
#include <vector>

namespace stairwell::benchmarks {

/// Of this thread alone: on a shared computer the wall's clock holds other people's work.
inline double thread_time_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

class KnownBuilding {
 public:
  /// @param file of the worlds' folder @param start_m from where its places are to be reached
  KnownBuilding(const char* file, const Eigen::Vector3d& start_m, const Robot& robot = {})
      : world_(sim3d::load_world(std::filesystem::path(STAIRWELL_WORLDS) / file)),
        robot_(robot),
        map_(GridSpec(world_.bounds, kResolution_m)),
        field_(map_.grid(), 1.0, mapping::Obstacles::kBlocked),
        words_(map_.grid(), mapping::Obstacles::kBlocked) {
    const sim3d::GroundTruth truth(world_, map_.grid());
    const auto inside = truth.reachable({start_m}, robot_, world_.bounds);
    for (std::size_t i = 0; i < map_.grid().voxel_count(); ++i) {
      map_.set_log_odds(map_.grid().voxel(i), truth.at(i) == sim3d::TruthClass::kFree ? -1.0F : 2.0F);
      if (inside[i] != 0) places_.push_back(map_.grid().voxel(i));
    }
    field_.update(map_);
    words_.update(map_);
  }

  planning3d::FreeSpace space() const { return {map_, field_, robot_, world_.bounds, &words_}; }
  /// A place that the robot can reach.
  Eigen::Vector3d any_place_m(Rng& rng) const {
    const int last = static_cast<int>(places_.size()) - 1;
    return map_.grid().center_of(places_[static_cast<std::size_t>(rng.uniform_int(0, last))]);
  }

 private:
  static constexpr double kResolution_m = 0.1;

  sim3d::World world_;
  Robot robot_;
  mapping::OccupancyMap map_;
  mapping::DistanceField field_;
  mapping::OccupancyWords words_;
  std::vector<VoxelIndex> places_;
};

}  // namespace stairwell::benchmarks
