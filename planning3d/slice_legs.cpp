#include "planning3d/slice_legs.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

namespace {

constexpr double kSame_m = 1e-6;

class LegBuilder {
 public:
  LegBuilder(const FreeSpace& space, const SegmentCheck& check, const MotionRule& rule, const Eigen::Vector3d& start_m,
             const Eigen::Vector3d& goal_m)
      : space_(space), check_(check), rule_(rule), goal_m_(goal_m), legs_m_{start_m} {}

  /// Horizontally to a column and there straight to the height of `to_m` (a cell's centre or the goal).
  bool change_layer(const Eigen::Vector3d& column_m, const Eigen::Vector3d& to_m, double cell_m) {
    if (!level_out(column_m)) return false;
    const Eigen::Vector3d at_m = legs_m_.back();
    const double height_m = layer_near(to_m.z(), cell_m);
    for (const Eigen::Vector2d& xy : places_in(column_m, cell_m)) {
      const Eigen::Vector3d low_m(xy.x(), xy.y(), at_m.z()), high_m(xy.x(), xy.y(), height_m);
      if (!check_.segment_free(low_m, high_m)) continue;
      if ((low_m - at_m).norm() > kSame_m) legs_m_.push_back(low_m);
      legs_m_.push_back(high_m);
      return true;
    }
    return false;
  }

  bool finish() {
    if (!level_out(goal_m_)) return false;
    const Eigen::Vector3d above_m(goal_m_.x(), goal_m_.y(), legs_m_.back().z());
    if ((above_m - legs_m_.back()).norm() > kSame_m) legs_m_.push_back(above_m);
    if ((goal_m_ - above_m).norm() > kSame_m) {
      if (!check_.segment_free(above_m, goal_m_)) return false;
      legs_m_.push_back(goal_m_);
    }
    return true;
  }

  std::vector<Eigen::Vector3d> take() { return std::move(legs_m_); }

 private:
  int layer_of(double height_m) const { return space_.grid().index_of({0.0, 0.0, height_m}).z; }

  /// The goal's height or a layer's, if one is within a cell; else the height itself.
  double layer_near(double height_m, double cell_m) const {
    if (std::abs(goal_m_.z() - height_m) <= cell_m) return goal_m_.z();
    double best_m = height_m;
    double least_m = cell_m;
    for (const double layer_m : rule_.layers_m) {
      if (std::abs(layer_m - height_m) > least_m) continue;
      least_m = std::abs(layer_m - height_m);
      best_m = layer_m;
    }
    return best_m;
  }

  /// Before a horizontal leg: to the nearest layer, where it is not in one (after a landing, say).
  bool level_out(const Eigen::Vector3d& towards_m) {
    const Eigen::Vector3d at_m = legs_m_.back();
    if ((towards_m - at_m).head<2>().norm() < kSame_m) return true;
    double height_m = at_m.z();
    double least_m = 1.0;
    for (const double layer_m : rule_.layers_m) {
      if (layer_of(layer_m) == layer_of(at_m.z())) return true;
      if (std::abs(layer_m - at_m.z()) >= least_m) continue;
      least_m = std::abs(layer_m - at_m.z());
      height_m = layer_m;
    }
    const Eigen::Vector3d to_m(at_m.x(), at_m.y(), height_m);
    if (to_m == at_m || !check_.segment_free(at_m, to_m)) return false;
    legs_m_.push_back(to_m);
    return true;
  }

  /// Where in a column a UAV might rise or sink: where it is, where it wants to be, the middle, every voxel.
  std::vector<Eigen::Vector2d> places_in(const Eigen::Vector3d& column_m, double cell_m) const {
    std::vector<Eigen::Vector2d> places;
    const auto inside = [&](const Eigen::Vector3d& p) {
      return (p - column_m).head<2>().cwiseAbs().maxCoeff() <= 0.5 * cell_m + kSame_m;
    };
    if (inside(legs_m_.back())) places.emplace_back(legs_m_.back().head<2>());
    if (inside(goal_m_)) places.emplace_back(goal_m_.head<2>());
    places.emplace_back(column_m.head<2>());
    const double voxel_m = space_.grid().resolution_m();
    const int n = static_cast<int>(std::lround(cell_m / voxel_m));
    for (int i = 0; i < n * n; ++i) {
      places.emplace_back(column_m.x() + (i % n - 0.5 * (n - 1)) * voxel_m,
                          column_m.y() + (i / n - 0.5 * (n - 1)) * voxel_m);
    }
    return places;
  }

  const FreeSpace& space_;
  const SegmentCheck& check_;
  const MotionRule& rule_;
  Eigen::Vector3d goal_m_;
  std::vector<Eigen::Vector3d> legs_m_;
};

}  // namespace

std::vector<Eigen::Vector3d> slice_legs(const FreeSpace& space, const SegmentCheck& check, const MotionRule& rule,
                                        const Eigen::Vector3d& start_m, const Eigen::Vector3d& goal_m,
                                        TravelCosts& costs) {
  costs.compute(space, goal_m, rule);
  std::vector<Eigen::Vector3d> cells = costs.path_to(start_m);
  if (cells.empty()) return {};
  std::reverse(cells.begin(), cells.end());
  const double cell_m = costs.cell_m();
  LegBuilder legs(space, check, rule, start_m, goal_m);
  // The ends are as given and not their cells' centres: what rises between them and the next is told by height alone.
  const auto rises = [&](std::size_t i) { return std::abs(cells[i + 1].z() - cells[i].z()) > 0.75 * cell_m; };
  for (std::size_t i = 0; i + 1 < cells.size(); ++i) {
    if (!rises(i)) continue;
    const Eigen::Vector3d column_m = i == 0 && cells.size() > 2 ? cells[1] : cells[i];
    while (i + 2 < cells.size() && rises(i + 1)) ++i;
    if (!legs.change_layer(column_m, cells[i + 1], cell_m)) return {};
  }
  if (!legs.finish()) return {};
  return legs.take();
}

}  // namespace stairwell::planning3d
