#include "sim3d/ground_truth.hpp"

#include "sim3d/flood.hpp"
#include "sim3d/triangle_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

namespace stairwell::sim3d {

namespace {

constexpr int kVoxelsPerBin = 4;
constexpr double kBinMargin_m = 2.0;
/// A UAV that stands on the ground touches it: its way is looked for from this much higher.
constexpr double kLift_m = 0.01;

/// Squared distance in voxels between each voxel's centre and the nearest marked voxel's, where below reach^2;
/// larger values say only "further than reach".
class NearField {
 public:
  NearField(const std::vector<bool>& near_surface, const GridSpec& grid, int reach) : reach_(reach) {
    squares_.resize(near_surface.size());
    for (std::size_t i = 0; i < near_surface.size(); ++i) squares_[i] = near_surface[i] ? 0 : kFar;
    const auto nx = static_cast<std::size_t>(grid.size()[0]);
    const auto ny = static_cast<std::size_t>(grid.size()[1]);
    const auto nz = static_cast<std::size_t>(grid.size()[2]);
    for (std::size_t row = 0; row < ny * nz; ++row) spread(row * nx, nx, 1, 1);
    for (std::size_t z = 0; z < nz; ++z) spread(z * nx * ny, ny, nx, nx);
    for (std::size_t y = 0; y < ny; ++y) spread(y * nx, nz, nx * ny, nx);
  }

  std::optional<double> distance(std::size_t voxel) const {
    if (squares_[voxel] >= reach_ * reach_) return std::nullopt;
    return std::sqrt(static_cast<double>(squares_[voxel]));
  }
  int reach() const { return reach_; }

 private:
  static constexpr std::uint16_t kFar = 50000;

  /// Minimum over one axis: `count` rows of `width` values, `stride` apart.
  void spread(std::size_t begin, std::size_t count, std::size_t stride, std::size_t width) {
    before_.resize(count * width);
    for (std::size_t i = 0; i < count; ++i) {
      std::copy_n(squares_.begin() + static_cast<std::ptrdiff_t>(begin + i * stride), width,
                  before_.begin() + static_cast<std::ptrdiff_t>(i * width));
    }
    const auto last = static_cast<std::ptrdiff_t>(count) - 1;
    for (std::ptrdiff_t i = 0; i <= last; ++i) {
      std::uint16_t* to = squares_.data() + begin + static_cast<std::size_t>(i) * stride;
      for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(-reach_, -i); k <= std::min<std::ptrdiff_t>(reach_, last - i);
           ++k) {
        const auto add = static_cast<std::uint16_t>(k * k);
        const std::uint16_t* from = before_.data() + static_cast<std::size_t>(i + k) * width;
        for (std::size_t x = 0; x < width; ++x) {
          to[x] = std::min(to[x], static_cast<std::uint16_t>(from[x] + add));
        }
      }
    }
  }

  int reach_;
  std::vector<std::uint16_t> squares_;
  std::vector<std::uint16_t> before_;
};

constexpr int kMaxReach = 100;  // kFar + reach^2 must fit into 16 bits

}  // namespace

GroundTruth::GroundTruth(const World& world, const GridSpec& grid) : grid_(grid), mesh_(world.mesh) {
  for (const auto& corners : mesh_.triangles) {
    for (const auto corner : corners) {
      if (corner >= mesh_.vertices_m.size()) throw std::invalid_argument("a triangle names a missing vertex");
      if (!mesh_.vertices_m[corner].allFinite()) throw std::invalid_argument("a vertex of the world is not finite");
      mesh_bounds_.extend(mesh_.vertices_m[corner].cast<double>());
    }
  }
  classify();
  fill_bins();
}

void GroundTruth::classify() {
  near_surface_.assign(grid_.voxel_count(), false);
  surface_.assign(grid_.voxel_count(), false);
  const double half_m = 0.5 * grid_.resolution_m();
  const double tolerance_m = face_tolerance_m();
  for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
    for_each_voxel_near(triangle_of(mesh_, i), grid_, tolerance_m, [&](const VoxelIndex& v, double half_extent_m) {
      const std::size_t index = grid_.linear(v);
      near_surface_[index] = true;
      if (half_extent_m < half_m - tolerance_m) surface_[index] = true;
    });
  }
}

void GroundTruth::fill_bins() {
  bins_ = GridSpec(grid_.box().inflated(kBinMargin_m), kVoxelsPerBin * grid_.resolution_m());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> entries;  // bin, triangle
  for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
    for_each_voxel_near(triangle_of(mesh_, i), bins_, 1e-6, [&](const VoxelIndex& v, double) {
      entries.emplace_back(static_cast<std::uint32_t>(bins_.linear(v)), i);
    });
  }
  bin_begin_.assign(bins_.voxel_count() + 1, 0);
  for (const auto& entry : entries) ++bin_begin_[entry.first + 1];
  for (std::size_t bin = 0; bin < bins_.voxel_count(); ++bin) bin_begin_[bin + 1] += bin_begin_[bin];
  std::vector<std::uint32_t> next(bin_begin_.begin(), bin_begin_.end() - 1);
  bin_triangles_.resize(entries.size());
  for (const auto& [bin, triangle] : entries) bin_triangles_[next[bin]++] = triangle;
}

/// Calls visit(triangle index) for at least every triangle that reaches into the cube around the sphere, until it
/// returns true.
template <typename Visit>
bool GroundTruth::any_triangle_near(const Eigen::Vector3d& center_m, double radius_m, const Visit& visit) const {
  const Eigen::Vector3d reach_m = Eigen::Vector3d::Constant(radius_m + 1e-6);
  const Aabb cube = Aabb{center_m - reach_m, center_m + reach_m}.intersection(mesh_bounds_);
  if (cube.empty()) return false;
  const Aabb covered = bins_.box();
  if (!covered.contains(cube.min_m) || !covered.contains(cube.max_m)) {
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
      if (visit(i)) return true;
    }
    return false;
  }
  const VoxelIndex lo = bins_.index_of(cube.min_m);
  const VoxelIndex hi = bins_.index_of(cube.max_m);
  for (int z = lo.z; z <= std::min(hi.z, bins_.size()[2] - 1); ++z) {
    for (int y = lo.y; y <= std::min(hi.y, bins_.size()[1] - 1); ++y) {
      for (int x = lo.x; x <= std::min(hi.x, bins_.size()[0] - 1); ++x) {
        const std::size_t bin = bins_.linear({x, y, z});
        for (std::uint32_t i = bin_begin_[bin]; i < bin_begin_[bin + 1]; ++i) {
          if (visit(bin_triangles_[i])) return true;
        }
      }
    }
  }
  return false;
}

bool GroundTruth::sphere_free(const Eigen::Vector3d& center_m, double radius_m) const {
  return !any_triangle_near(center_m, radius_m, [&](std::uint32_t i) {
    return squared_distance_m2(triangle_of(mesh_, i), center_m) <= radius_m * radius_m;
  });
}

void GroundTruth::triangles_near(const Eigen::Vector3d& center_m, double radius_m,
                                 std::vector<std::uint32_t>& triangles) const {
  any_triangle_near(center_m, radius_m, [&](std::uint32_t i) {
    triangles.push_back(i);
    return false;
  });
}

double GroundTruth::clearance_m(const Eigen::Vector3d& point_m, double cap_m) const {
  for (double radius_m = std::min(cap_m, bins_.resolution_m());; radius_m = std::min(cap_m, 2.0 * radius_m)) {
    double nearest_m2 = radius_m * radius_m;
    any_triangle_near(point_m, radius_m, [&](std::uint32_t i) {
      nearest_m2 = std::min(nearest_m2, squared_distance_m2(triangle_of(mesh_, i), point_m));
      return false;
    });
    if (nearest_m2 < radius_m * radius_m || radius_m >= cap_m) return std::sqrt(nearest_m2);
  }
}

std::optional<VoxelIndex> GroundTruth::entry_voxel(const Eigen::Vector3d& start_m, double radius_m,
                                                   const Aabb& flight_box) const {
  const double search_m = 2.0 * radius_m + 2.0 * grid_.resolution_m();
  if (!start_m.allFinite() || !grid_.box().inflated(search_m).contains(start_m)) return std::nullopt;
  std::vector<Triangle> around;
  any_triangle_near(start_m, search_m, [&](std::uint32_t i) {
    around.push_back(triangle_of(mesh_, i));
    return false;
  });
  const Eigen::Vector3d lifted_m = start_m + Eigen::Vector3d(0.0, 0.0, kLift_m);
  const auto connected = [&](const Eigen::Vector3d& center_m) {
    return std::none_of(around.begin(), around.end(),
                        [&](const Triangle& t) { return segment_hits(t, lifted_m, center_m); });
  };
  std::optional<VoxelIndex> nearest;
  double nearest_m = search_m;
  const VoxelIndex middle = grid_.index_of(start_m);
  const int reach = static_cast<int>(std::ceil(search_m / grid_.resolution_m()));
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const VoxelIndex v = middle + VoxelIndex{x, y, z};
        if (!grid_.contains(v)) continue;
        const Eigen::Vector3d center_m = grid_.center_of(v);
        const double distance_m = (center_m - start_m).norm();
        if (distance_m >= nearest_m || !flight_box.contains(center_m)) continue;
        if (!sphere_free(center_m, radius_m) || !connected(center_m)) continue;
        nearest = v;
        nearest_m = distance_m;
      }
    }
  }
  return nearest;
}

std::vector<std::uint8_t> GroundTruth::reachable(const std::vector<Eigen::Vector3d>& starts_m, const Robot& robot,
                                                 const Aabb& flight_box) const {
  const double resolution_m = grid_.resolution_m();
  const double radius = robot.radius_m / resolution_m;
  const double half_diagonal = 0.5 * std::sqrt(3.0);
  const double grown_half_diagonal = (0.5 + face_tolerance_m() / resolution_m) * std::sqrt(3.0);
  const NearField near(near_surface_, grid_,
                       std::min(kMaxReach, static_cast<int>(std::ceil(radius + grown_half_diagonal)) + 1));
  const auto inside_by = [&](int i, std::size_t axis) { return std::min(i, grid_.size()[axis] - 1 - i); };
  const auto free = [&](const VoxelIndex& v, std::size_t index) {
    const Eigen::Vector3d center_m = grid_.center_of(v);
    if (!flight_box.contains(center_m)) return false;
    const auto distance = near.distance(index);
    if (distance && *distance + grown_half_diagonal < radius) return false;
    const int border = std::min({inside_by(v.x, 0), inside_by(v.y, 1), inside_by(v.z, 2)});
    const bool all_seen = border >= near.reach();  // surfaces outside the grid are not in the field
    if (all_seen && distance.value_or(near.reach()) - half_diagonal > radius) return true;
    return sphere_free(center_m, robot.radius_m);
  };

  constexpr std::uint8_t kNew = 0;
  constexpr std::uint8_t kReached = 1;
  constexpr std::uint8_t kBlocked = 2;
  std::vector<std::uint8_t> state(grid_.voxel_count(), kNew);
  const auto enter = [&](const VoxelIndex& v, std::size_t index) {
    if (state[index] != kNew) return false;
    state[index] = free(v, index) ? kReached : kBlocked;
    return state[index] == kReached;
  };
  std::vector<VoxelIndex> entries;
  for (const Eigen::Vector3d& start_m : starts_m) {
    const auto entry = entry_voxel(start_m, robot.radius_m, flight_box);
    if (entry && enter(*entry, grid_.linear(*entry))) entries.push_back(*entry);
  }
  flood(grid_, std::move(entries), enter);
  std::replace(state.begin(), state.end(), kBlocked, kNew);
  return state;
}

}  // namespace stairwell::sim3d
