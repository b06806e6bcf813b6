/// What tours of a fleet over poses on a known map cost and see, estimated fast: the judge of `TourSearch`.
#pragma once

#include "apps/known_roads.hpp"
#include "apps/true_views.hpp"
#include "core/trajectory.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::apps {

using Tour = std::vector<TrueViews::Pose>;  ///< of one UAV, from its start
using Tours = std::vector<Tour>;

class TourModel {
 public:
  /// @param roads over the views' places and behind them the starts, one per yaw
  TourModel(const TrueViews& views, const KnownRoads& roads, const MotionLimits& limits,
            const std::vector<double>& start_yaws_rad);

  const TrueViews& views() const { return views_; }
  const KnownRoads& roads() const { return roads_; }
  std::size_t uavs() const { return start_yaws_.size(); }
  TrueViews::Pose start(std::size_t uav) const {
    return {static_cast<std::uint32_t>(views_.places() + uav), start_yaws_[uav]};
  }

  /// Seconds: full speed and corners, or the turns of the yaw where they take longer. Infinite where there is no way.
  double tour_s(std::size_t uav, const Tour& tour);
  /// Sets the bits of all targets in sight on the way. @param seen views().words() words, bits are only added
  void see(std::size_t uav, const Tour& tour, std::uint64_t* seen);
  /// What these tours see by the model and missed when flown counts from now on only where a tour's poses see it, not
  /// the way between: places stand for points around them, which may see less. @param missed bits, as in see()
  void distrust(const Tours& tours, const std::vector<std::uint64_t>& missed);
  /// Corners of the way to a stop from the one before.
  std::vector<Eigen::Vector3d> way_m(std::size_t uav, const Tour& tour, std::size_t stop) const;

 private:
  struct Leg {
    std::uint64_t key = ~std::uint64_t{0};
    bool looked = false;
    float duration_s = 0.0F;
    Eigen::Vector3f first_m = Eigen::Vector3f::Zero();  ///< part of the way; zero for a turn on the spot
    Eigen::Vector3f last_m = Eigen::Vector3f::Zero();
  };
  std::size_t leg(const TrueViews::Pose& from, const TrueViews::Pose& to);
  void measure(const TrueViews::Pose& from, const TrueViews::Pose& to, Leg& leg);
  void look(const TrueViews::Pose& from, const TrueViews::Pose& to, std::uint64_t* seen);
  double turn_s(int from_yaw, int to_yaw) const;
  double corner_s(const Eigen::Vector3f& before_m, const Eigen::Vector3f& after_m) const;

  const TrueViews& views_;
  const KnownRoads& roads_;
  MotionLimits limits_;
  std::vector<int> start_yaws_;
  std::vector<double> turn_s_;  ///< by steps of yaw
  std::vector<float> turned_;   ///< [steps of yaw][part of the time]: radians
  std::vector<Leg> legs_;       ///< each where its key says; the last one asked for stays
  std::vector<std::uint64_t> leg_sights_;
  std::vector<std::uint64_t> trusted_;  ///< bit by target
  std::vector<std::uint32_t> way_;
};

}  // namespace stairwell::apps
