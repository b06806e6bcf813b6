#pragma once

#include "coverage3d/frontier_finder.hpp"

#include <nlohmann/json_fwd.hpp>

#include <Eigen/Core>

#include <vector>

namespace stairwell::coverage3d {

/// Places and targets that failed and are left alone for a while (SPEC B4). Every further failure of the same target
/// doubles its time.
class Blacklist {
 public:
  /// A place where goals failed, how often, and until when it is avoided.
  struct Entry {
    Eigen::Vector3d position_m;
    Eigen::Vector3d target_m;
    double until_s = 0.0;
    double last_s = 0.0;
    int failures = 0;
  };
  /// @param patience  so many more failures than else before a target is left alone
  Blacklist(double radius_m, double time_s, int patience = 0)
      : radius_m_(radius_m), time_s_(time_s), patience_(patience) {}

  /// @pre times do not run backwards, here and below
  void report(const Eigen::Vector3d& position_m, const Eigen::Vector3d& target_m, double time_s);
  /// Whether a goal at this place is to be avoided.
  bool blocks_place(const Eigen::Vector3d& position_m, double time_s) const;
  /// Whether the cluster is to be left alone: a small one after one failure, a large one after a second.
  bool blocks_target(const FrontierCluster& cluster, double time_s) const;

  const std::vector<Entry>& entries() const { return entries_; }
  nlohmann::json to_json() const;
  /// @throws nlohmann::json::exception when the text is damaged
  void from_json(const nlohmann::json& json);

 private:
  double radius_m_;
  double time_s_;
  int patience_;
  std::vector<Entry> entries_;
  std::vector<Entry> live_;  ///< those that were to be avoided when the last one came: most of a long flight's are not
};

}  // namespace stairwell::coverage3d
