#include "mapping/potential_model.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::mapping {

namespace {

const PotentialModelConfig& usable(const PotentialModelConfig& config) {
  const std::vector<std::string> problems = config.problems();
  if (!problems.empty()) throw InputError("unusable potential model: " + problems.front());
  return config;
}

GridSpec coarse_grid(const GridSpec& map_grid, const PotentialModelConfig& config) {
  return {map_grid.box(), usable(config).coarse_factor * map_grid.resolution_m()};
}

std::array<int, 3> window_cells(const GridSpec& grid, const PotentialModelConfig& config) {
  std::array<int, 3> cells{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double wanted =
        std::ceil(usable(config).window_m[static_cast<Eigen::Index>(axis)] / grid.resolution_m() - 1e-6);
    cells[axis] = static_cast<int>(std::min(wanted, static_cast<double>(grid.size()[axis]))) | 1;
  }
  return cells;
}

}  // namespace

std::vector<std::string> PotentialModelConfig::problems() const {
  std::vector<std::string> found = potential.problems();
  if (coarse_factor < 1) {
    found.push_back("coarse_factor must be at least 1, got " + std::to_string(coarse_factor));
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (!(window_m[axis] > 0.0) || !std::isfinite(window_m[axis])) {
      found.push_back("window_m must be positive along every axis, got " + std::to_string(window_m[axis]));
    }
  }
  return found;
}

PotentialModel::PotentialModel(const GridSpec& map_grid, const PotentialModelConfig& config)
    : fine_(map_grid, window_cells(map_grid, config), config.form, config.potential),
      coarse_(coarse_grid(map_grid, config), coarse_grid(map_grid, config).size(), config.form, config.potential) {}

void PotentialModel::update(const OccupancyMap& map, const PotentialObstacles& obstacles, const PotentialStep& step,
                            const DistanceField* distances) {
  if (!(map.grid() == fine_.lattice())) {
    throw InputError("potential: the map has another box or resolution than the model");
  }
  fine_.update({obstacles.fine(), map, obstacles.changed_blocks(), obstacles.too_many_blocks(), distances}, step);
  coarse_.update(
      {obstacles.coarse(), map, obstacles.changed_blocks(), obstacles.too_many_blocks(), obstacles.coarse_distances()},
      step);
}

void PotentialModel::add_experience(const PotentialBump& bump) {
  fine_.add_experience(bump);
  coarse_.add_experience(bump);
}

void PotentialModel::clear_experience() {
  fine_.clear_experience();
  coarse_.clear_experience();
}

PotentialObstacles make_potential_obstacles(const GridSpec& map_grid, const PotentialModelConfig& config) {
  const double coarse_m = usable(config).coarse_factor * map_grid.resolution_m();
  const bool nearest = config.form == RepulsionForm::kNearest;
  return {map_grid, config.coarse_factor, nearest ? config.potential.reach_m + coarse_m : 0.0};
}

}  // namespace stairwell::mapping
