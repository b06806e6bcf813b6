#include "planning3d/elastic_band.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

namespace {

constexpr double kSpacing_m = 0.2;  // closer points keep better to gaps, but take more sweeps
constexpr int kSweeps = 60;
constexpr double kOverRelaxation = 1.8;
constexpr double kStill_m = 1e-3;  // the band rests when no point moves farther in a sweep
constexpr double kOnWay_m = 1e-3;
constexpr double kAsideStep_m = 0.025;
constexpr double kMostAside_m = 0.15;

std::vector<Eigen::Vector3d> evenly_along(const std::vector<Eigen::Vector3d>& way_m, double spacing_m) {
  double length_m = 0.0;
  for (std::size_t i = 0; i + 1 < way_m.size(); ++i) length_m += (way_m[i + 1] - way_m[i]).norm();
  const int pieces = std::max(3, static_cast<int>(std::ceil(length_m / spacing_m)));
  std::vector<Eigen::Vector3d> points_m{way_m.front()};
  std::size_t leg = 0;
  double leg_start_m = 0.0;
  for (int k = 1; k < pieces; ++k) {
    const double arc_m = length_m * k / pieces;
    double leg_m = (way_m[leg + 1] - way_m[leg]).norm();
    while (leg + 2 < way_m.size() && arc_m > leg_start_m + leg_m) {
      leg_start_m += leg_m;
      ++leg;
      leg_m = (way_m[leg + 1] - way_m[leg]).norm();
    }
    points_m.push_back(way_m[leg] + (arc_m - leg_start_m) / leg_m * (way_m[leg + 1] - way_m[leg]));
  }
  points_m.push_back(way_m.back());
  return points_m;
}

/// The nearest place at which the robot fits with the room wanted, up to `kMostAside_m` away; the place itself where
/// there is none. Planned ways touch corners: from there the band could only be drawn farther in.
template <typename Fits>
Eigen::Vector3d moved_aside(const Eigen::Vector3d& at_m, const Fits& fits) {
  if (fits(at_m)) return at_m;
  for (double aside_m = kAsideStep_m; aside_m < kMostAside_m + 1e-9; aside_m += kAsideStep_m) {
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        for (int z = -1; z <= 1; ++z) {
          const Eigen::Vector3d way(x, y, z);
          if (x == 0 && y == 0 && z == 0) continue;
          const Eigen::Vector3d moved_m = at_m + aside_m * way.normalized();
          if (fits(moved_m)) return moved_m;
        }
      }
    }
  }
  return at_m;
}

}  // namespace

ElasticBand::ElasticBand(const FreeSpace& space, const std::vector<Eigen::Vector3d>& way_m, double radius_m,
                         double turn_m, bool keeps_direction)
    : keeps_direction_(keeps_direction), on_way_m_(evenly_along(way_m, kSpacing_m)), control_m_(on_way_m_) {
  for (std::size_t i = 0; i + 1 < way_m.size(); ++i) spacing_m_ += (way_m[i + 1] - way_m[i]).norm();
  spacing_m_ /= static_cast<double>(on_way_m_.size() - 1);
  if (keeps_direction_) {
    on_way_m_[1] = control_m_[1] = way_m[0] + spacing_m_ * (way_m[1] - way_m[0]).normalized();
  }
  relax(space, radius_m, turn_m);
}

void ElasticBand::relax(const FreeSpace& space, double radius_m, double turn_m) {
  const double pull = spacing_m_ * spacing_m_ / (turn_m * turn_m);  // of length against bending
  const auto fits = [&](const Eigen::Vector3d& at_m) {
    return space.flight_box().contains(at_m) && space.sphere_free(at_m, radius_m);
  };
  const std::size_t last = control_m_.size() - 1;
  for (std::size_t i = first_free(); i < last; ++i) on_way_m_[i] = control_m_[i] = moved_aside(control_m_[i], fits);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double moved_m = 0.0;
    for (std::size_t i = first_free(); i < last; ++i) {
      // Least of the sum of squared second differences and `pull` times that of first ones, all others at rest.
      const Eigen::Vector3d sides_m = control_m_[i - 1] + control_m_[i + 1];
      Eigen::Vector3d sum_m = (2.0 + pull) * sides_m;
      double weight = 4.0 + 2.0 * pull;
      if (i >= 2) {
        sum_m += 2.0 * control_m_[i - 1] - control_m_[i - 2];
        weight += 1.0;
      }
      if (i + 2 <= last) {
        sum_m += 2.0 * control_m_[i + 1] - control_m_[i + 2];
        weight += 1.0;
      }
      Eigen::Vector3d& point_m = control_m_[i];
      const Eigen::Vector3d step_m = kOverRelaxation * (sum_m / weight - point_m);
      if (step_m.norm() < 0.1 * kStill_m) continue;
      const Eigen::Vector3d before_m = point_m;
      if (fits(point_m + step_m)) {
        point_m += step_m;
      } else {  // along the surfaces, most of which are square to an axis
        for (int axis = 0; axis < 3; ++axis) {
          Eigen::Vector3d along_m = point_m;
          along_m[axis] += step_m[axis];
          if (fits(along_m)) point_m = along_m;
        }
      }
      moved_m = std::max(moved_m, (point_m - before_m).norm());
    }
    if (moved_m < kStill_m) break;
  }
}

Curve ElasticBand::curve() const { return clamped_spline(control_m_); }

bool ElasticBand::loosen_near(const Eigen::Vector3d& at_m) {
  bool any = false;
  for (std::size_t i = first_free(); i + 1 < control_m_.size(); ++i) {
    if ((control_m_[i] - at_m).norm() > 2.0 * spacing_m_) continue;
    const Eigen::Vector3d off_m = control_m_[i] - on_way_m_[i];
    if (off_m.norm() < kOnWay_m) continue;
    any = true;
    control_m_[i] = off_m.norm() < 0.05 ? on_way_m_[i] : (on_way_m_[i] + 0.5 * off_m).eval();
  }
  return any;
}

}  // namespace stairwell::planning3d
