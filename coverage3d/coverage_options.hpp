/// What the learned coverage agent is told of the places where a UAV could go next (SPEC A8, B7).
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <functional>
#include <string_view>
#include <vector>

namespace stairwell::coverage3d {

/// A pose from which something unknown is seen, as one of some to choose from.
struct CoverageOption {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  double time_s = 0.0;         ///< this UAV's, to get there
  double way_m = 0.0;          ///< geodesic
  double fellow_s = 1e9;       ///< the soonest of the other UAVs could be there
  double tour_s = 0.0;         ///< a tour of all options that begins with this one, see nearest_neighbour_tours_s
  double gain_m3 = 0.0;        ///< unknown volume in view
  double area_m2 = 0.0;        ///< of the frontier
  double seen_fraction = 0.0;  ///< of the frontier
  double pocket_m3 = 0.0;      ///< unknown volume behind the frontier, counted to a limit
  bool pressing = false;       ///< `frontiers` would not put it off
};

/// Who chooses, and among whom.
struct OptionScene {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  double speed_mps = 1.0;                  ///< the largest
  std::vector<Eigen::Vector3d> fellows_m;  ///< the other UAVs
  std::vector<Eigen::Vector3d> fellow_goals_m;
  double known_share = 0.0;  ///< of the task box
};

inline constexpr int kOptionFeatures = 36;
/// Says which numbers these are; a model is only for the ones that it was trained with.
inline constexpr std::string_view kOptionInput = "coverage options 1";

/// One row of numbers for each option, all about -1 to 3: times in 10 s, ways in 10 m, volumes in 10 m3, areas in 3 m2.
/// @returns [options, kOptionFeatures]
std::vector<float> option_rows(const OptionScene& scene, const std::vector<CoverageOption>& options);

/// Which of the options deserve a thought: the three that promise most for each second, the soonest and the one with
/// the shortest tour, without doubles. In the options' order; all of them where there are no more than three.
std::vector<std::size_t> short_list(const std::vector<CoverageOption>& options);

/// How long it takes to go to each option first and then always on to the nearest one that is left.
/// @param start_s  [options] @param between_s  [options][options]
std::vector<double> nearest_neighbour_tours_s(const std::vector<double>& start_s,
                                              const std::vector<std::vector<double>>& between_s);

/// A choice that a UAV has to make.
struct OptionChoice {
  std::size_t uav = 0;
  double time_s = 0.0;
  std::vector<float> rows;  ///< as option_rows() makes them; at least one
  std::size_t count() const { return rows.size() / static_cast<std::size_t>(kOptionFeatures); }
};
/// @returns which option
using OptionChooser = std::function<std::size_t(const OptionChoice&)>;

}  // namespace stairwell::coverage3d
