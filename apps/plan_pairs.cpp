#include "apps/plan_pairs.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"
#include "perception/storeys.hpp"
#include "planning3d/connectivity.hpp"

#include <algorithm>
#include <string>

namespace stairwell::apps {

namespace {

using planning3d::Connectivity;

constexpr std::size_t kDrawsPerPair = 2000;

struct Place {
  VoxelIndex v;
  int storey;
};

/// Of the last floor below; -1 beneath all floors.
int storey_of(const std::vector<perception::Storey>& storeys, double z_m) {
  int storey = -1;
  for (const perception::Storey& s : storeys) storey += s.floor_z_m <= z_m ? 1 : 0;
  return storey;
}

std::vector<Place> places_of(const KnownMap& map, const planning3d::FreeSpace& space, bool on_storeys) {
  const GridSpec& grid = map.map().grid();
  std::vector<perception::Storey> storeys;
  if (on_storeys) {
    storeys = perception::detect_storeys([&map](const VoxelIndex& v) { return map.map().at(v); }, grid);
    if (storeys.size() < 2) throw InputError("cross_storey: the map shows fewer than two storeys");
  }
  std::vector<Place> places;
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    if (!space.traversable(v)) continue;
    const int storey = storey_of(storeys, grid.center_of(v).z());
    if (!on_storeys || storey >= 0) places.push_back({v, storey});
  }
  return places;
}

}  // namespace

std::vector<PlanTask> random_pairs(const KnownMap& map, const Robot& robot, const PairRules& rules) {
  const planning3d::FreeSpace space = map.space(robot);
  const std::vector<Place> places = places_of(map, space, rules.cross_storey);
  if (places.size() < 2) throw InputError("pairs: the robot fits nowhere on the map");
  const auto parts = Connectivity::find(space, Connectivity::Neighbours::kFaces);
  Rng rng = make_rng(rules.seed, "plan.pairs");
  const auto draw = [&] {
    return places[static_cast<std::size_t>(rng.uniform_int(0, static_cast<int>(places.size()) - 1))];
  };
  std::vector<PlanTask> tasks;
  for (std::size_t draws = 0; tasks.size() < rules.count; ++draws) {
    if (draws > kDrawsPerPair * rules.count) throw InputError("pairs: too few places are connected as asked");
    const Place from = draw();
    const Place to = draw();
    if (from.v == to.v || (rules.cross_storey && from.storey == to.storey)) continue;
    if (!parts->connected(from.v, to.v)) continue;
    PlanTask task;
    task.name = "pair " + std::to_string(tasks.size() + 1);
    task.from_m = space.grid().center_of(from.v);
    task.to_m = space.grid().center_of(to.v);
    tasks.push_back(std::move(task));
  }
  return tasks;
}

}  // namespace stairwell::apps
