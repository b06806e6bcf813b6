/// Exact overlap of a convex body with axis-aligned boxes. Internal to the collision checker.
///
/// Everything is in cells, relative to the body's reference point, along the world's axes. A body that only touches a
/// box does not overlap it. Each body has `extent`, the half size of its axis-aligned bounds, and `overlaps(box)`,
/// which may take for granted that the box overlaps these bounds.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>

namespace stairwell::mapping::convex {

struct CellBox {
  std::array<double, 3> lo;
  std::array<double, 3> hi;
};

/// From the reference point to the nearest point of the box.
inline double squared_gap(const CellBox& box) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double gap = std::max(std::max(box.lo[i], -box.hi[i]), 0.0);
    sum += gap * gap;
  }
  return sum;
}

struct Ball {
  std::array<double, 3> extent;
  double squared_radius;

  explicit Ball(double radius) : extent{radius, radius, radius}, squared_radius(radius * radius) {}
  bool overlaps(const CellBox& box) const { return squared_gap(box) < squared_radius; }
};

/// Oriented box, by the separating-axis test: Gottschalk, Lin, Manocha 1996 (the three axes of the cells are spared).
class OrientedBox {
 public:
  OrientedBox(const std::array<double, 3>& half, const Eigen::Matrix3d& R_world_body) : half_(half) {
    const double inner = *std::min_element(half.begin(), half.end());
    squared_inner_ = inner * inner;
    for (std::size_t i = 0; i < 3; ++i) {
      extent[i] = 0.0;
      for (std::size_t j = 0; j < 3; ++j) {
        axis_[j][i] = R_world_body(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
        extent[i] += std::abs(axis_[j][i]) * half[j];
        along_[j][i] = std::abs(axis_[j][i]) + kParallel;
      }
    }
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      for (std::size_t i = 0; i < 3; ++i) {
        edge_reach_[j][i] = half[j1] * along_[j2][i] + half[j2] * along_[j1][i];
      }
    }
  }

  bool overlaps(const CellBox& box) const {
    if (squared_gap(box) < squared_inner_) return true;
    std::array<double, 3> mid, reach;
    for (std::size_t i = 0; i < 3; ++i) {
      mid[i] = 0.5 * (box.lo[i] + box.hi[i]);
      reach[i] = 0.5 * (box.hi[i] - box.lo[i]);
    }
    for (std::size_t j = 0; j < 3; ++j) {
      const auto& u = axis_[j];
      const auto& a = along_[j];
      if (std::abs(u[0] * mid[0] + u[1] * mid[1] + u[2] * mid[2]) >=
          half_[j] + a[0] * reach[0] + a[1] * reach[1] + a[2] * reach[2]) {
        return false;
      }
    }
    for (std::size_t j = 0; j < 3; ++j) {
      const auto& u = axis_[j];
      const auto& a = along_[j];
      const auto& own = edge_reach_[j];
      if (std::abs(mid[2] * u[1] - mid[1] * u[2]) >= own[0] + reach[1] * a[2] + reach[2] * a[1]) return false;
      if (std::abs(mid[0] * u[2] - mid[2] * u[0]) >= own[1] + reach[2] * a[0] + reach[0] * a[2]) return false;
      if (std::abs(mid[1] * u[0] - mid[0] * u[1]) >= own[2] + reach[0] * a[1] + reach[1] * a[0]) return false;
    }
    return true;
  }

  std::array<double, 3> extent{};

 private:
  static constexpr double kParallel = 1e-12;  // edges (nearly) parallel to a cell's separate nothing

  std::array<double, 3> half_;
  double squared_inner_;
  std::array<std::array<double, 3>, 3> axis_{};        ///< [axis of the body][world]
  std::array<std::array<double, 3>, 3> along_{};       ///< absolute values
  std::array<std::array<double, 3>, 3> edge_reach_{};  ///< of the body along (world axis i) x (own axis j): [j][i]
};

/// {x : x'Ax < 1}. The least value over a box is found on its faces towards the reference point, in closed form.
class Ellipsoid {
 public:
  Ellipsoid(const std::array<double, 3>& semi_axes, const Eigen::Matrix3d& R_world_body) {
    const double inner = *std::min_element(semi_axes.begin(), semi_axes.end());
    squared_inner_ = inner * inner;
    for (std::size_t i = 0; i < 3; ++i) {
      double squared = 0.0;
      for (std::size_t j = 0; j < 3; ++j) {
        double sum = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
          sum += R_world_body(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) *
                 R_world_body(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k)) /
                 (semi_axes[k] * semi_axes[k]);
        }
        a_[i][j] = sum;
        const double arm = R_world_body(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) * semi_axes[j];
        squared += arm * arm;
      }
      extent[i] = std::sqrt(squared);
    }
  }

  bool overlaps(const CellBox& box) const {
    if (squared_gap(box) < squared_inner_) return true;
    for (std::size_t i = 0; i < 3; ++i) {
      if (box.lo[i] > 0.0) {
        if (reaches_face(box, i, box.lo[i])) return true;
      } else if (box.hi[i] < 0.0) {
        if (reaches_face(box, i, box.hi[i])) return true;
      }
    }
    return false;
  }

  std::array<double, 3> extent{};

 private:
  /// The least value on the face x_i = at is below 1.
  bool reaches_face(const CellBox& box, std::size_t i, double at) const {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const double per_determinant = 1.0 / (a_[j][j] * a_[k][k] - a_[j][k] * a_[j][k]);
    const double free_j = at * (a_[j][k] * a_[i][k] - a_[k][k] * a_[i][j]) * per_determinant;
    const double free_k = at * (a_[j][k] * a_[i][j] - a_[j][j] * a_[i][k]) * per_determinant;
    const double in_j = std::clamp(free_j, box.lo[j], box.hi[j]);
    const double in_k = std::clamp(free_k, box.lo[k], box.hi[k]);
    if (in_j == free_j && in_k == free_k) return value(i, at, j, in_j, k, in_k) < 1.0;
    if (in_j != free_j) {
      const double along = -(at * a_[i][k] + in_j * a_[j][k]) / a_[k][k];
      if (value(i, at, j, in_j, k, std::clamp(along, box.lo[k], box.hi[k])) < 1.0) return true;
    }
    if (in_k != free_k) {
      const double along = -(at * a_[i][j] + in_k * a_[j][k]) / a_[j][j];
      if (value(i, at, j, std::clamp(along, box.lo[j], box.hi[j]), k, in_k) < 1.0) return true;
    }
    return false;
  }
  double value(std::size_t i, double x, std::size_t j, double y, std::size_t k, double z) const {
    return a_[i][i] * x * x + a_[j][j] * y * y + a_[k][k] * z * z +
           2.0 * (a_[i][j] * x * y + a_[i][k] * x * z + a_[j][k] * y * z);
  }

  double squared_inner_;
  std::array<std::array<double, 3>, 3> a_{};
};

/// A straight line through the reference point, against boxes. With p(t) the point of the box nearest to t * direction,
/// everything needed follows from advance(t) = direction . p(t): it never falls, never rises faster than t, and is
/// linear between at most six breaks.
class Line {
 public:
  /// @param direction of length 1
  explicit Line(const Eigen::Vector3d& direction) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double along = direction[static_cast<Eigen::Index>(i)];
      moves_[i] = std::abs(along) > kStill;
      direction_[i] = moves_[i] ? along : 0.0;
      per_[i] = moves_[i] ? 1.0 / along : 0.0;
    }
  }

  const std::array<double, 3>& direction() const { return direction_; }

  double advance(const CellBox& box, double t) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      sum += direction_[i] * std::clamp(t * direction_[i], box.lo[i], box.hi[i]);
    }
    return sum;
  }
  /// From the line's point at t to the box.
  double squared_distance(const CellBox& box, double t) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double x = t * direction_[i];
      const double off = x - std::clamp(x, box.lo[i], box.hi[i]);
      sum += off * off;
    }
    return sum;
  }

  /// Where in [from, to] the line is nearest to the box: the root of t - advance(t), or the end towards it.
  double nearest(const CellBox& box, double from, double to) const {
    const auto slope = [&](double t) { return t - advance(box, t); };
    const double at_from = slope(from), at_to = slope(to);
    if (at_from >= 0.0) return from;
    if (at_to <= 0.0) return to;
    return root(box, slope, from, at_from, to, at_to);
  }

  /// Squared distance, across the line, from the line to where the plane at `height` along it cuts the box.
  /// @pre the plane meets the box
  double squared_across(const CellBox& box, double height) const {
    double first = height, last = height;
    for (std::size_t i = 0; i < 3; ++i) {
      if (!moves_[i]) continue;
      const double a = box.lo[i] * per_[i], b = box.hi[i] * per_[i];
      first = std::min({first, a, b});
      last = std::max({last, a, b});
    }
    const auto ahead = [&](double t) { return advance(box, t) - height; };
    const double t = root(box, ahead, first, ahead(first), last, ahead(last));
    double squared = 0.0, along = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double p = std::clamp(t * direction_[i], box.lo[i], box.hi[i]);
      squared += (p - height * direction_[i]) * (p - height * direction_[i]);
      along += p * direction_[i];
    }
    return squared - (along - height) * (along - height);
  }

 private:
  static constexpr double kStill = 1e-13;

  /// Root of a function that never falls and is linear between the breaks of `advance`.
  template <typename Function>
  double root(const CellBox& box, const Function& function, double from, double at_from, double to,
              double at_to) const {
    for (std::size_t i = 0; i < 3; ++i) {
      if (!moves_[i]) continue;
      for (const double at : {box.lo[i] * per_[i], box.hi[i] * per_[i]}) {
        if (at <= from || at >= to) continue;
        const double value = function(at);
        if (value <= 0.0) {
          from = at;
          at_from = value;
        } else {
          to = at;
          at_to = value;
        }
      }
    }
    return at_to > at_from ? std::clamp(from - at_from * (to - from) / (at_to - at_from), from, to) : from;
  }

  std::array<bool, 3> moves_{};
  std::array<double, 3> direction_{};
  std::array<double, 3> per_{};
};

/// Along an axis, both ways by half its height.
class Cylinder {
 public:
  Cylinder(double radius, double half_height, const Eigen::Vector3d& axis)
      : line_(axis), squared_radius_(radius * radius), half_height_(half_height) {
    const double inner = std::min(radius, half_height);
    squared_inner_ = inner * inner;
    for (std::size_t i = 0; i < 3; ++i) {
      const double a = line_.direction()[i];
      extent[i] = half_height * std::abs(a) + radius * std::sqrt(std::max(0.0, 1.0 - a * a));
    }
  }

  /// The distance from the axis to the box's cut at height t is convex in t and least where axis and box are nearest:
  /// if that is beyond a cap, the cut at this cap decides.
  bool overlaps(const CellBox& box) const {
    if (squared_gap(box) < squared_inner_) return true;
    double height = 0.0, reach = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double a = line_.direction()[i];
      height += 0.5 * (box.lo[i] + box.hi[i]) * a;
      reach += 0.5 * (box.hi[i] - box.lo[i]) * std::abs(a);
    }
    if (std::abs(height) >= half_height_ + reach) return false;
    const double t = line_.nearest(box, -half_height_, half_height_);
    if (line_.squared_distance(box, t) >= squared_radius_) return false;
    return std::abs(t) < half_height_ || line_.squared_across(box, t) < squared_radius_;
  }

  std::array<double, 3> extent{};

 private:
  Line line_;
  double squared_radius_;
  double half_height_;
  double squared_inner_;
};

/// A ball swept along a straight way, both ways from the reference point by half its length.
class Capsule {
 public:
  Capsule(double radius, double half_length, const Eigen::Vector3d& direction)
      : line_(direction), squared_radius_(radius * radius), half_length_(half_length) {
    for (std::size_t i = 0; i < 3; ++i) extent[i] = radius + half_length * std::abs(line_.direction()[i]);
  }

  bool overlaps(const CellBox& box) const {
    if (squared_gap(box) < squared_radius_) return true;
    return line_.squared_distance(box, line_.nearest(box, -half_length_, half_length_)) < squared_radius_;
  }

  std::array<double, 3> extent{};

 private:
  Line line_;
  double squared_radius_;
  double half_length_;
};

}  // namespace stairwell::mapping::convex
