#include "mapping/collision.hpp"

#include "core/errors.hpp"
#include "mapping/convex_bodies.hpp"
#include "mapping/shape_bodies.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace stairwell::mapping {

namespace {

constexpr double kSmallest_m = 1e-6;                  // of a shape's lengths and of a tolerance
constexpr double kFarthest_m = 1e7;                   // coordinates beyond it are too coarse to speak of touching
constexpr double kInside = 0.99;                      // where probes lie
constexpr double kHalfDiagonal = 0.8660254037844386;  // of a unit voxel

using convex::BallBody;
using convex::ToCells;
using convex::Triple;
using Cells = std::array<int, 3>;

// Bits of a word whose voxel coordinate along one axis lies in [lo, hi].
struct AxisMasks {
  std::uint64_t along[3][4][4];

  constexpr AxisMasks() : along{} {
    for (unsigned bit = 0; bit < 64; ++bit) {
      const unsigned at[3] = {bit & 3, bit >> 2 & 3, bit >> 4};
      for (unsigned axis = 0; axis < 3; ++axis) {
        for (unsigned lo = 0; lo <= at[axis]; ++lo) {
          for (unsigned hi = at[axis]; hi < 4; ++hi) along[axis][lo][hi] |= std::uint64_t{1} << bit;
        }
      }
    }
  }
  std::uint64_t box(const Cells& lo, const Cells& hi) const {
    return along[0][lo[0]][hi[0]] & along[1][lo[1]][hi[1]] & along[2][lo[2]][hi[2]];
  }
};
constexpr AxisMasks kMasks;

/// Bounds of the bits set. @pre bits != 0
void tight_bounds(std::uint64_t bits, Cells& lo, Cells& hi) {
  lo[2] = std::countr_zero(bits) >> 4;
  hi[2] = (63 - std::countl_zero(bits)) >> 4;
  std::uint64_t plane = bits | bits >> 32;
  plane = (plane | plane >> 16) & 0xFFFFU;
  lo[1] = std::countr_zero(plane) >> 2;
  hi[1] = (63 - std::countl_zero(plane)) >> 2;
  std::uint64_t row = plane | plane >> 8;
  row = (row | row >> 4) & 0xFU;
  lo[0] = std::countr_zero(row);
  hi[0] = 63 - std::countl_zero(row);
}

/// Whether the body overlaps a voxel that is set. `corner`: of the word, relative to the body.
template <typename Body>
bool overlaps_any(const Body& body, const Triple& corner, std::uint64_t bits) {
  Cells lo, hi;
  tight_bounds(bits, lo, hi);
  convex::CellBox box;
  std::size_t longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    box.lo[i] = corner[i] + lo[i];
    box.hi[i] = corner[i] + hi[i] + 1;
    if (hi[i] - lo[i] > hi[longest] - lo[longest]) longest = i;
  }
  if (!body.overlaps(box)) return false;
  if (bits == kMasks.box(lo, hi)) return true;
  const std::uint64_t below = bits & kMasks.along[longest][lo[longest]][lo[longest] + (hi[longest] - lo[longest]) / 2];
  return overlaps_any(body, corner, below) || overlaps_any(body, corner, bits ^ below);
}

void require_usable(const Pose& T_world_body) {
  // Written so that NaN fails.
  if (!(T_world_body.translation().cwiseAbs().maxCoeff() <= kFarthest_m) || !T_world_body.linear().allFinite() ||
      !T_world_body.translation().allFinite()) {
    throw InputError("collision query: the pose is not finite or too far away");
  }
}

void require_usable(const Pose& T_world_from, const Pose& T_world_to, double tolerance_m) {
  require_usable(T_world_from);
  require_usable(T_world_to);
  if (!(tolerance_m >= kSmallest_m)) throw InputError("collision query: the tolerance must be at least 1e-6 m");
}

int word_of(int cell) { return cell / OccupancyWords::kEdge; }

}  // namespace

std::vector<std::string> problems(const CollisionShape& shape) {
  std::vector<std::string> found;
  const auto require = [&found](const char* name, double length_m) {
    if (!(length_m >= kSmallest_m) || !std::isfinite(length_m)) {
      found.push_back(std::string(name) + " must be finite and at least 1e-6 m, got " + std::to_string(length_m));
    }
  };
  if (const auto* sphere = std::get_if<SphereShape>(&shape)) require("sphere radius", sphere->radius_m);
  if (const auto* box = std::get_if<BoxShape>(&shape)) {
    for (const double half_m : box->half_m) require("half edge of the box", half_m);
  }
  if (const auto* ellipsoid = std::get_if<EllipsoidShape>(&shape)) {
    for (const double semi_axis_m : ellipsoid->semi_axes_m) require("semi-axis of the ellipsoid", semi_axis_m);
  }
  if (const auto* cylinder = std::get_if<CylinderShape>(&shape)) {
    require("cylinder radius", cylinder->radius_m);
    require("half height of the cylinder", cylinder->half_height_m);
  }
  return found;
}

/// The steps of a query. Positions are in cells from the corner of word 0.
struct CollisionQuery {
  const CollisionChecker& checker;

  Eigen::Vector3d cells(const Eigen::Vector3d& position_m) const {
    return position_m * checker.per_m_ - checker.first_cell_;
  }
  ToCells to_cells() const { return {checker.per_m_}; }

  enum class Word { kFree, kHit, kUnclear };

  /// The distance field's word on a body between its inner and outer radius.
  Word by_distance(const Eigen::Vector3d& at, double inner, double outer) const {
    const Cells& shift = checker.words_->shift();
    const Cells& size = checker.words_->grid().size();
    Cells v;
    double squared_off = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double x = at[static_cast<Eigen::Index>(i)] - shift[i];
      if (!(x >= 0.0 && x < size[i])) return Word::kUnclear;
      v[i] = static_cast<int>(x);
      const double off = x - v[i] - 0.5;
      squared_off += off * off;
    }
    const int cap = checker.distance_->truncation_cells();
    const int squared = checker.distance_->squared_cells({v[0], v[1], v[2]});
    if (squared == 0) return Word::kHit;
    const double between_centers = std::sqrt(static_cast<double>(squared));
    const double off_center = std::sqrt(squared_off);
    if (between_centers - off_center - kHalfDiagonal >= outer) return Word::kFree;
    if (squared < cap * cap && between_centers + off_center - 0.5 < inner) return Word::kHit;
    return Word::kUnclear;
  }

  template <typename Body>
  bool by_words(const Body& body, const Eigen::Vector3d& at) const {
    const OccupancyWords& words = *checker.words_;
    const bool outside_hits = words.obstacles() == Obstacles::kBlocked;
    Cells lo, hi;
    for (std::size_t i = 0; i < 3; ++i) {
      const double center = at[static_cast<Eigen::Index>(i)];
      const double from = center - body.extent[i], to = center + body.extent[i];
      const int first = words.shift()[i], end = first + words.grid().size()[i];
      if (from < first || to > end) {
        if (outside_hits) return true;
        if (to <= first || from >= end) return false;
      }
      lo[i] = from > first ? static_cast<int>(from) : first;
      hi[i] = to < end ? static_cast<int>(std::ceil(to)) - 1 : end - 1;
    }
    const auto in_word = [&](std::size_t axis, int w) {
      return kMasks.along[axis][std::max(lo[axis] - 4 * w, 0)][std::min(hi[axis] - 4 * w, 3)];
    };
    for (int z = word_of(lo[2]); z <= word_of(hi[2]); ++z) {
      const std::uint64_t mask_z = in_word(2, z);
      for (int y = word_of(lo[1]); y <= word_of(hi[1]); ++y) {
        const std::uint64_t mask_yz = mask_z & in_word(1, y);
        const std::uint64_t* row = words.row(y, z);
        for (int x = word_of(lo[0]); x <= word_of(hi[0]); ++x) {
          const std::uint64_t bits = row[x] & mask_yz & in_word(0, x);
          if (bits == 0) continue;
          if (overlaps_any(body, {4.0 * x - at[0], 4.0 * y - at[1], 4.0 * z - at[2]}, bits)) return true;
        }
      }
    }
    return false;
  }

  template <typename Shape>
  bool at_pose(const Shape& shape, const Eigen::Vector3d& at, const Eigen::Matrix3d& R_world_body) const {
    const Word word = by_distance(at, shape.inner(), shape.outer());
    if (word != Word::kUnclear) return word == Word::kHit;
    return by_probes(shape, at, R_world_body) || by_words(shape.place(R_world_body), at);
  }

  /// Whether a probe lies in an obstacle within the grid.
  template <typename Shape>
  bool by_probes(const Shape& shape, const Eigen::Vector3d& at, const Eigen::Matrix3d& R_world_body) const {
    const OccupancyWords& words = *checker.words_;
    const Triple half = shape.half_sizes();
    for (const Triple& probe : Shape::probes) {
      const Eigen::Vector3d offset(probe[0] * half[0], probe[1] * half[1], probe[2] * half[2]);
      const Eigen::Vector3d p = at + R_world_body * (kInside * offset);
      Cells v;
      bool inside = true;
      for (std::size_t i = 0; i < 3; ++i) {
        const double x = p[static_cast<Eigen::Index>(i)] - words.shift()[i];
        inside = inside && x >= 0.0 && x < words.grid().size()[i];
        v[i] = inside ? static_cast<int>(x) : 0;
      }
      if (inside && words.at({v[0], v[1], v[2]})) return true;
    }
    return false;
  }

  bool swept(const BallBody& ball, const Pose& T_world_from, const Pose& T_world_to, double) const {
    const Eigen::Vector3d from = cells(T_world_from.translation());
    const Eigen::Vector3d way = cells(T_world_to.translation()) - from;
    const double length = way.norm();
    const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
    if (at_pose(ball, from, identity)) return true;
    return length > 0.0 &&
           (at_pose(ball, from + way, identity) || first_piece_that_hits(ball, from, way / length, length) < length);
  }

  double free_fraction(const BallBody& ball, const Pose& T_world_from, const Pose& T_world_to,
                       double tolerance_m) const {
    const Eigen::Vector3d from = cells(T_world_from.translation());
    const Eigen::Vector3d way = cells(T_world_to.translation()) - from;
    const double length = way.norm();
    if (at_pose(ball, from, Eigen::Matrix3d::Identity())) return 0.0;
    if (length == 0.0) return 1.0;
    const Eigen::Vector3d direction = way / length;
    double free = first_piece_that_hits(ball, from, direction, length);
    if (free >= length) return 1.0;
    double hit = std::min(free + kPiece, length);
    while (hit - free > tolerance_m * checker.per_m_) {
      const double middle = 0.5 * (free + hit);
      (capsule_hits(ball, from, direction, free, middle) ? hit : free) = middle;
    }
    return free / length;
  }

  bool capsule_hits(const BallBody& ball, const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double begin,
                    double end) const {
    return by_words(convex::Capsule(ball.radius, 0.5 * (end - begin), direction),
                    from + 0.5 * (begin + end) * direction);
  }

  /// Where along the way the first piece that hits begins; infinity if none does.
  double first_piece_that_hits(const BallBody& ball, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                               double length) const {
    double gone = 0.0, end = length;
    clip_to_grid(from, direction, ball.radius, gone, end);
    while (gone < end) {
      const double ahead = clear_ahead(from + gone * direction, ball.radius);
      if (ahead >= kLeap) {
        gone += ahead;
        continue;
      }
      const double piece = std::min(kPiece, end - gone);
      if (capsule_hits(ball, from, direction, gone, gone + piece)) return gone;
      gone += piece;
    }
    return std::numeric_limits<double>::infinity();
  }

  /// Leaves [begin, end] of a line where a ball on it may reach into the grid.
  void clip_to_grid(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double radius, double& begin,
                    double& end) const {
    for (std::size_t i = 0; i < 3; ++i) {
      const double along = direction[static_cast<Eigen::Index>(i)];
      const double lo = checker.words_->shift()[i] - radius - 1.0 - from[static_cast<Eigen::Index>(i)];
      const double hi = lo + checker.words_->grid().size()[i] + 2.0 * radius + 2.0;
      if (along == 0.0) {
        if (lo > 0.0 || hi < 0.0) end = begin;
        continue;
      }
      begin = std::max(begin, std::min(lo / along, hi / along));
      end = std::min(end, std::max(lo / along, hi / along));
    }
  }

  /// How far a ball may move from here, whichever way, without coming near anything.
  double clear_ahead(const Eigen::Vector3d& at, double radius) const {
    const Cells& shift = checker.words_->shift();
    const VoxelIndex v{static_cast<int>(std::floor(at[0])) - shift[0], static_cast<int>(std::floor(at[1])) - shift[1],
                       static_cast<int>(std::floor(at[2])) - shift[2]};
    if (!checker.words_->grid().contains(v)) return 0.0;
    const double between_centers = std::sqrt(static_cast<double>(checker.distance_->squared_cells(v)));
    const Eigen::Vector3d center(v.x + shift[0] + 0.5, v.y + shift[1] + 0.5, v.z + shift[2] + 0.5);
    return between_centers - (at - center).norm() - kHalfDiagonal - radius;
  }

  template <typename Shape>
  struct Motion {
    Shape shape;
    Eigen::Vector3d from;
    Eigen::Vector3d way;
    Eigen::Quaterniond q_world_from;
    Eigen::Quaterniond q_world_to;
    Eigen::Matrix3d R_world_from;
    double farthest;  ///< no point of the body moves farther than this
    double tolerance;
    bool turns;

    Eigen::Matrix3d rotation(double u) const {
      return turns ? q_world_from.slerp(u, q_world_to).toRotationMatrix() : R_world_from;
    }
  };

  template <typename Shape>
  Motion<Shape> motion_of(const Shape& shape, const Pose& T_world_from, const Pose& T_world_to,
                          double tolerance_m) const {
    Motion<Shape> motion{shape,
                         cells(T_world_from.translation()),
                         cells(T_world_to.translation()) - cells(T_world_from.translation()),
                         Eigen::Quaterniond(T_world_from.linear()),
                         Eigen::Quaterniond(T_world_to.linear()),
                         T_world_from.linear(),
                         0.0,
                         tolerance_m * checker.per_m_,
                         T_world_from.linear() != T_world_to.linear()};
    const double angle_rad = motion.turns ? motion.q_world_from.angularDistance(motion.q_world_to) : 0.0;
    motion.farthest = motion.way.norm() + angle_rad * shape.outer();
    return motion;
  }

  template <typename Shape>
  bool swept(const Shape& shape, const Pose& T_world_from, const Pose& T_world_to, double tolerance_m) const {
    const Motion<Shape> motion = motion_of(shape, T_world_from, T_world_to, tolerance_m);
    return at_pose(shape, motion.from, T_world_from.linear()) ||
           at_pose(shape, motion.from + motion.way, T_world_to.linear()) || part_hits(motion, 0.0, 1.0);
  }

  template <typename Shape>
  double free_fraction(const Shape& shape, const Pose& T_world_from, const Pose& T_world_to, double tolerance_m) const {
    const Motion<Shape> motion = motion_of(shape, T_world_from, T_world_to, tolerance_m);
    return at_pose(shape, motion.from, T_world_from.linear()) ? 0.0 : free_until(motion, 0.0, 1.0);
  }

  /// All that the body covers in a part of the motion lies within the body at the part's middle, grown by half of how
  /// far its points move.
  template <typename Shape>
  bool surely_free(const Motion<Shape>& motion, double begin, double end) const {
    const double middle = 0.5 * (begin + end);
    return !at_pose(motion.shape.grown(0.5 * (end - begin) * motion.farthest), motion.from + middle * motion.way,
                    motion.rotation(middle));
  }
  template <typename Shape>
  static bool within_tolerance(const Motion<Shape>& motion, double begin, double end) {
    return 0.5 * (end - begin) * motion.farthest < motion.tolerance;
  }

  template <typename Shape>
  bool part_hits(const Motion<Shape>& motion, double begin, double end) const {
    if (surely_free(motion, begin, end)) return false;
    const double middle = 0.5 * (begin + end);
    return within_tolerance(motion, begin, end) ||
           at_pose(motion.shape, motion.from + middle * motion.way, motion.rotation(middle)) ||
           part_hits(motion, begin, middle) || part_hits(motion, middle, end);
  }

  /// The end of the part if all of it is free, else where in it that can no longer be said.
  template <typename Shape>
  double free_until(const Motion<Shape>& motion, double begin, double end) const {
    if (surely_free(motion, begin, end)) return end;
    if (within_tolerance(motion, begin, end)) return begin;
    const double middle = 0.5 * (begin + end);
    const double first = free_until(motion, begin, middle);
    return first < middle ? first : free_until(motion, middle, end);
  }

  static constexpr double kLeap = 1.0;   // cells; shorter leaps cost more than they save
  static constexpr double kPiece = 6.0;  // cells; longer capsules have bounds that hold more of the map
};

CollisionChecker::CollisionChecker(const OccupancyWords& words, const DistanceField& distance,
                                   const CollisionShape& shape)
    : words_(&words), distance_(&distance), shape_(shape), per_m_(1.0 / words.grid().resolution_m()) {
  const std::vector<std::string> found = problems(shape);
  if (!found.empty()) throw InputError("unusable robot shape: " + found.front());
  const bool outside_blocked = distance.squared_cells({-1, -1, -1}) == 0;
  if (words.grid() != distance.grid() || outside_blocked != (words.obstacles() == Obstacles::kBlocked)) {
    throw InputError("collision checker: words and distance field are of different grids or kinds of obstacle");
  }
  for (std::size_t i = 0; i < 3; ++i) {
    first_cell_[static_cast<Eigen::Index>(i)] = words.grid().first_cell()[i] - words.shift()[i];
  }
}

bool CollisionChecker::collides(const Pose& T_world_body) const {
  require_usable(T_world_body);
  const CollisionQuery query{*this};
  const Eigen::Vector3d at = query.cells(T_world_body.translation());
  return std::visit(
      [&](const auto& shape) { return query.at_pose(query.to_cells()(shape), at, T_world_body.linear()); }, shape_);
}

bool CollisionChecker::collides_between(const Pose& T_world_from, const Pose& T_world_to, double tolerance_m) const {
  require_usable(T_world_from, T_world_to, tolerance_m);
  const CollisionQuery query{*this};
  const auto ask = [&](const auto& shape) {
    return query.swept(query.to_cells()(shape), T_world_from, T_world_to, tolerance_m);
  };
  return std::visit(ask, shape_);
}

double CollisionChecker::free_fraction(const Pose& T_world_from, const Pose& T_world_to, double tolerance_m) const {
  require_usable(T_world_from, T_world_to, tolerance_m);
  const CollisionQuery query{*this};
  const auto ask = [&](const auto& shape) {
    return query.free_fraction(query.to_cells()(shape), T_world_from, T_world_to, tolerance_m);
  };
  return std::visit(ask, shape_);
}

}  // namespace stairwell::mapping
