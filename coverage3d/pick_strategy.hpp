#pragma once

#include "coverage3d/frontier_strategy.hpp"

#include <vector>

namespace stairwell::coverage3d {

/// Baselines: one UAV after the other takes the open stop that ranks first with it and that no other flies to. No look
/// ahead, no sharing out of the work.
class PickStrategy : public FrontierStrategy {
 public:
  using FrontierStrategy::FrontierStrategy;

  std::unique_ptr<CoverageStrategy> clone() const override { return nullptr; }

 protected:
  /// Who chooses, and when.
  struct Choice {
    const Crew& crew;
    std::size_t vehicle;
    double time_s;  ///< of the request
  };
  /// The smallest is taken; infinite = not for this UAV.
  virtual double rank(const Choice& choice, const Stop& stop) const = 0;
  /// Whether a UAV under way keeps its target while that is open. No for ranks that get better on the way.
  virtual bool loyal() const { return false; }

  /// Whether the UAVs decide in the order of their ranks, each knowing what those before it are going to see.
  virtual bool takes_turns() const { return false; }

  void share_out(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                 const std::vector<Stop>& stops, Assignment& assignment) override;

 private:
  struct Pick {
    double rank;
    std::size_t vehicle, stop;
  };
  Pick best_for(const AssignmentRequest& request, const Crew& crew, std::size_t vehicle, const std::vector<Stop>& stops,
                const std::vector<bool>& taken) const;
};

/// The nearest frontier by the way there (Yamauchi 1997).
class NearestStrategy final : public PickStrategy {
 public:
  using PickStrategy::PickStrategy;
  std::string_view name() const override { return "nearest"; }

 protected:
  double rank(const Choice& choice, const Stop& stop) const override;
};

/// The largest gain for each second of flight (SPEC C8).
class GreedyStrategy final : public PickStrategy {
 public:
  using PickStrategy::PickStrategy;
  std::string_view name() const override { return "greedy"; }

 protected:
  bool takes_turns() const override { return config().turn_taking; }
  double rank(const Choice& choice, const Stop& stop) const override;
};

/// Any, evenly and repeatably by the seed, flown to before the next is drawn.
class RandomStrategy final : public PickStrategy {
 public:
  using PickStrategy::PickStrategy;
  std::string_view name() const override { return "random"; }

 protected:
  double rank(const Choice& choice, const Stop& stop) const override;
  bool loyal() const override { return true; }
};

/// To and fro in lanes as wide as the sensor sees, one band of heights after the other (SPEC C8): the next open stop
/// along that line from where the UAV is. Each UAV mows its own share of the line first.
class LawnmowerStrategy final : public PickStrategy {
 public:
  using PickStrategy::PickStrategy;
  std::string_view name() const override { return "lawnmower"; }

 protected:
  double rank(const Choice& choice, const Stop& stop) const override;
  bool loyal() const override { return true; }
};

/// Where a place lies on the mower's line through the box, 0 to 1.
double mown_part(const Aabb& box, double lane_m, double band_m, const Eigen::Vector3d& at_m);

}  // namespace stairwell::coverage3d
