#include "apps/known_map.hpp"

#include "apps/map_files.hpp"
#include "core/errors.hpp"
#include "mapping/octomap_io.hpp"
#include "sim3d/ground_truth.hpp"

#include <octomap/OcTree.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

namespace stairwell::apps {

namespace {

constexpr double kDefaultResolution_m = 0.1;
constexpr double kMostVoxels = 2e8;
constexpr float kSolid = 3.5F;  // log-odds
constexpr float kFree = -2.0F;

std::string extension_of(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension;
}

/// Formats whose solids are voxels: their surface is closed and lies on the voxels' faces.
bool is_voxel_kind(const std::string& extension) {
  constexpr std::array kKinds{".bt", ".ot", ".pcd", ".yaml", ".yml", ".3dmap"};
  return std::ranges::find(kKinds, extension) != kKinds.end();
}

GridSpec grid_over(const Aabb& box, double resolution_m, const std::filesystem::path& file) {
  if (!(resolution_m > 0.0)) throw InputError(file.string() + ": the resolution must be positive");
  if ((box.size_m() / resolution_m).prod() > kMostVoxels) {
    throw InputError(file.string() + ": too many voxels at a resolution of " + std::to_string(resolution_m) +
                     " m; give a coarser --resolution");
  }
  return {box, resolution_m};
}

/// The whole box that a .3dmap's first line declares. @pre it has been read without complaint
Aabb box_of_3dmap(const std::filesystem::path& file, double voxel_size_m) {
  std::ifstream stream(file);
  std::string word;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  stream >> word >> size.x() >> size.y() >> size.z();
  return {Eigen::Vector3d::Zero(), voxel_size_m * size};
}

mapping::OccupancyMap from_octomap(const std::filesystem::path& file, const KnownMapOptions& options) {
  const auto tree = mapping::load_octree(file);
  mapping::OccupancyMap map =
      options.box.empty() ? mapping::map_from_octree(*tree)
                          : mapping::map_from_octree(*tree, grid_over(options.box, tree->getResolution(), file));
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
    const VoxelIndex v = map.grid().voxel(i);
    if (map.at(v) == Occupancy::kUnknown) map.set_log_odds(v, kFree);
  }
  return map;
}

mapping::OccupancyMap from_world(const std::filesystem::path& file, const KnownMapOptions& options) {
  const sim3d::World world = sim3d::load_world(file, options.world);
  const std::string extension = extension_of(file);
  const bool cells = extension == ".3dmap";
  const double own_m = cells ? options.world.voxel_size_m : kDefaultResolution_m;
  const Aabb own_box = cells ? box_of_3dmap(file, own_m) : world.bounds;
  const Aabb box = options.box.empty() ? own_box : options.box;
  const GridSpec grid = grid_over(box, std::isnan(options.resolution_m) ? own_m : options.resolution_m, file);
  std::vector<std::uint8_t> solid = inside_of(world.mesh, grid);
  if (!is_voxel_kind(extension)) {
    const sim3d::GroundTruth truth(world, grid);
    for (std::size_t i = 0; i < solid.size(); ++i) {
      if (truth.at(i) != sim3d::TruthClass::kFree) solid[i] = 1;
    }
  }
  mapping::OccupancyMap map(grid);
  for (std::size_t i = 0; i < solid.size(); ++i) map.set_log_odds(grid.voxel(i), solid[i] != 0 ? kSolid : kFree);
  return map;
}

/// Adds up, along one axis, how often each voxel's centre is enclosed.
class WindingAlong {
 public:
  WindingAlong(const GridSpec& grid, int axis)
      : grid_(grid), w_(axis), u_((axis + 1) % 3), v_((axis + 2) % 3), winding_(grid.voxel_count(), 0) {}

  void add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const double area = cross(a, b, c[u_], c[v_]);
    if (area == 0.0) return;
    const int u_lo = first_centre(std::min({a[u_], b[u_], c[u_]}), u_, kOffsetU);
    const int v_lo = first_centre(std::min({a[v_], b[v_], c[v_]}), v_, kOffsetV);
    const int u_hi = first_centre(std::max({a[u_], b[u_], c[u_]}), u_, kOffsetU);
    const int v_hi = first_centre(std::max({a[v_], b[v_], c[v_]}), v_, kOffsetV);
    for (int v = v_lo; v < v_hi; ++v) {
      for (int u = u_lo; u < u_hi; ++u) {
        const double at_u = centre(u, u_) + kOffsetU * grid_.resolution_m();
        const double at_v = centre(v, v_) + kOffsetV * grid_.resolution_m();
        const double to_c = cross(a, b, at_u, at_v) / area;
        const double to_a = cross(b, c, at_u, at_v) / area;
        const double to_b = 1.0 - to_a - to_c;
        if (to_a < 0.0 || to_b < 0.0 || to_c < 0.0) continue;
        const int w = first_centre(to_a * a[w_] + to_b * b[w_] + to_c * c[w_], w_, 0.0);
        if (w < size(w_))
          winding_[place(u, v, w)] = static_cast<std::int16_t>(winding_[place(u, v, w)] + (area > 0.0 ? 1 : -1));
      }
    }
  }

  /// One more vote for every voxel that is enclosed.
  void vote(std::vector<std::uint8_t>& votes) {
    for (int v = 0; v < size(v_); ++v) {
      for (int u = 0; u < size(u_); ++u) {
        int sum = 0;
        for (int w = 0; w < size(w_); ++w) {
          sum += winding_[place(u, v, w)];
          if (sum != 0) ++votes[place(u, v, w)];
        }
      }
    }
  }

 private:
  // Voxel centres would meet the diagonals of rectangles; these parts of a voxel beside them nothing meets.
  static constexpr double kOffsetU = 0.00137;
  static constexpr double kOffsetV = 0.00071;

  double cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double u, double v) const {
    return (b[u_] - a[u_]) * (v - a[v_]) - (b[v_] - a[v_]) * (u - a[u_]);
  }
  int size(int axis) const { return grid_.size()[static_cast<std::size_t>(axis)]; }
  double centre(int cell, int axis) const {
    return (grid_.first_cell()[static_cast<std::size_t>(axis)] + cell + 0.5) * grid_.resolution_m();
  }
  /// The first cell whose centre (plus the offset) is not below the coordinate, within [0, size].
  int first_centre(double at_m, int axis, double offset) const {
    const double cell = at_m / grid_.resolution_m() - grid_.first_cell()[static_cast<std::size_t>(axis)] - 0.5 - offset;
    return static_cast<int>(std::clamp(std::ceil(cell), 0.0, static_cast<double>(size(axis))));
  }
  std::size_t place(int u, int v, int w) const {
    int cell[3];
    cell[u_] = u;
    cell[v_] = v;
    cell[w_] = w;
    return grid_.linear({cell[0], cell[1], cell[2]});
  }

  const GridSpec& grid_;
  int w_, u_, v_;
  std::vector<std::int16_t> winding_;  ///< change at each voxel
};

double truncation_m(const GridSpec& grid, double wished_m) {
  return std::clamp(wished_m, 3.0 * grid.resolution_m(), 120.0 * grid.resolution_m());
}

}  // namespace

std::vector<std::uint8_t> inside_of(const sim3d::TriangleMesh& mesh, const GridSpec& grid) {
  std::vector<std::uint8_t> votes(grid.voxel_count(), 0);
  for (int axis = 0; axis < 3; ++axis) {
    WindingAlong winding(grid, axis);
    for (const auto& [a, b, c] : mesh.triangles) {
      winding.add(mesh.vertices_m[a].cast<double>(), mesh.vertices_m[b].cast<double>(),
                  mesh.vertices_m[c].cast<double>());
    }
    winding.vote(votes);
  }
  for (auto& vote : votes) vote = vote == 3 ? 1 : 0;
  return votes;
}

KnownMap::KnownMap(mapping::OccupancyMap solid_and_free)
    : map_(std::move(solid_and_free)),
      blocked_(map_.grid(), truncation_m(map_.grid(), 1.5), mapping::Obstacles::kBlocked),
      solid_(map_.grid(), truncation_m(map_.grid(), 2.0), mapping::Obstacles::kOccupied),
      words_(map_.grid(), mapping::Obstacles::kBlocked) {
  blocked_.update(map_);
  solid_.update(map_);
  words_.update(map_);
}

double KnownMap::clearance_m(const Eigen::Vector3d& at_m) const {
  const GridSpec& grid = map_.grid();
  const VoxelIndex at = grid.index_of(at_m);
  const double centres_m = solid_.distance_m(at);
  double least_m = clearance_cap_m();
  if (centres_m >= least_m) return least_m;
  const int reach = static_cast<int>(std::ceil(centres_m / grid.resolution_m())) + 1;
  const double half_m = 0.5 * grid.resolution_m();
  for (int z = at.z - reach; z <= at.z + reach; ++z) {
    for (int y = at.y - reach; y <= at.y + reach; ++y) {
      for (int x = at.x - reach; x <= at.x + reach; ++x) {
        if (map_.at(VoxelIndex{x, y, z}) != Occupancy::kOccupied) continue;
        const Eigen::Vector3d apart_m = (at_m - grid.center_of({x, y, z})).cwiseAbs();
        least_m = std::min(least_m, (apart_m.array() - half_m).max(0.0).matrix().norm());
      }
    }
  }
  return least_m;
}

KnownMap load_known_map(const std::filesystem::path& file, const KnownMapOptions& options) {
  if (is_octomap_file(file) && std::isnan(options.resolution_m)) return KnownMap(from_octomap(file, options));
  return KnownMap(from_world(file, options));
}

}  // namespace stairwell::apps
