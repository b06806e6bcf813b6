#pragma once

#include "coverage3d/pick_strategy.hpp"
#include "coverage3d/travel_book.hpp"

#include <cstdint>
#include <set>

namespace stairwell::coverage3d {

/// The open stops in clusters by k-means with the elbow method (SPEC A9), by the ways between them, so that no cluster
/// spans a slab; every UAV flies to the nearest centre that no other flies to, and where there are fewer centres than
/// UAVs, to the nearest stop.
class KMeansStrategy final : public PickStrategy {
 public:
  using PickStrategy::PickStrategy;
  std::string_view name() const override { return "kmeans"; }

 protected:
  double rank(const Choice& choice, const Stop& stop) const override;
  bool loyal() const override { return true; }
  void share_out(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                 const std::vector<Stop>& stops, Assignment& assignment) override;

 private:
  TravelBook ways_;
  std::set<std::uint32_t> centers_;  ///< ids of the frontier clusters that are centres at present
};

}  // namespace stairwell::coverage3d
