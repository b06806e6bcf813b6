#include "sim3d/loaders/voxel_faces.hpp"
#include "core/rng.hpp"
#include "sim3d/loaders/polygon.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <set>

namespace stairwell::sim3d {

namespace {

using Cell = std::array<int, 3>;
/// Axis, sign of the outward normal, and the cell the unit face belongs to.
using Face = std::array<int, 5>;

std::set<Face> faces_by_definition(const std::set<Cell>& cells) {
  std::set<Face> faces;
  for (const Cell& cell : cells) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        Cell neighbour = cell;
        neighbour[static_cast<std::size_t>(axis)] += sign;
        if (!cells.contains(neighbour)) {
          faces.insert({axis, sign, cell[0], cell[1], cell[2]});
        }
      }
    }
  }
  return faces;
}

/// Cuts every rectangle (two triangles after each other) back into unit faces; counts faces that come twice.
std::set<Face> faces_of_mesh(const TriangleMesh& mesh, int& repeated) {
  std::set<Face> faces;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 2) {
    Eigen::AlignedBox3f box;
    Eigen::Vector3f normals = Eigen::Vector3f::Zero();
    for (const std::size_t k : {t, t + 1}) {
      const auto& [a, b, c] = mesh.triangles[k];
      for (const std::uint32_t index : {a, b, c}) {
        box.extend(mesh.vertices_m[index]);
      }
      normals += (mesh.vertices_m[b] - mesh.vertices_m[a]).cross(mesh.vertices_m[c] - mesh.vertices_m[a]);
    }
    Eigen::Index axis = 0;
    normals.cwiseAbs().maxCoeff(&axis);
    const int sign = normals[axis] > 0.0F ? 1 : -1;
    Cell lo;
    Cell hi;
    for (Eigen::Index i = 0; i < 3; ++i) {
      lo[static_cast<std::size_t>(i)] = static_cast<int>(std::lround(box.min()[i]));
      hi[static_cast<std::size_t>(i)] = static_cast<int>(std::lround(box.max()[i]));
    }
    const auto n = static_cast<std::size_t>(axis);
    lo[n] -= sign > 0 ? 1 : 0;
    hi[n] = lo[n] + 1;
    for (int x = lo[0]; x < hi[0]; ++x) {
      for (int y = lo[1]; y < hi[1]; ++y) {
        for (int z = lo[2]; z < hi[2]; ++z) {
          repeated += faces.insert({static_cast<int>(axis), sign, x, y, z}).second ? 0 : 1;
        }
      }
    }
  }
  return faces;
}

double area_of(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d p = mesh.vertices_m[a].cast<double>();
    area += 0.5 * (mesh.vertices_m[b].cast<double>() - p).cross(mesh.vertices_m[c].cast<double>() - p).norm();
  }
  return area;
}

}  // namespace

TEST_CASE("merged voxel faces cover exactly the exposed unit faces, once each") {
  Rng rng = make_rng(7, "voxel faces");
  for (int round = 0; round < 300; ++round) {
    const int edge = rng.uniform_int(1, 9);
    const double density = rng.uniform(0.02, 0.98);
    std::set<Cell> cells;
    SolidVoxels solid;
    for (int x = -edge; x < edge; ++x) {
      for (int y = -2; y < edge; ++y) {
        for (int z = -edge; z < 3; ++z) {
          if (rng.uniform() < density) {
            cells.insert({x, y, z});
            solid.add(x, y, z);
            if (rng.uniform() < 0.1) {
              solid.add(x, y, z);
            }
          }
        }
      }
    }
    const TriangleMesh mesh = solid.exposed_faces(Eigen::Vector3d::Ones());
    int repeated = 0;
    REQUIRE(faces_of_mesh(mesh, repeated) == faces_by_definition(cells));
    REQUIRE(repeated == 0);
  }
}

TEST_CASE("a solid block is twelve triangles, and edges scale per axis") {
  SolidVoxels solid;
  for (int x = 0; x < 20; ++x) {
    for (int y = 0; y < 10; ++y) {
      solid.add(x, y, 0);
    }
  }
  const TriangleMesh mesh = solid.exposed_faces({0.1, 0.1, 2.5});
  CHECK(mesh.triangles.size() == 12);
  CHECK(mesh.bounds().size_m().isApprox(Eigen::Vector3d(2.0, 1.0, 2.5), 1e-6));
  CHECK(area_of(mesh) == Approx(2 * (2.0 * 1.0 + 2.0 * 2.5 + 1.0 * 2.5)));
}

TEST_CASE("cells at the ends of the lattice do not wrap around") {
  SolidVoxels solid;
  solid.add(SolidVoxels::kMinCell, SolidVoxels::kMinCell, SolidVoxels::kMinCell);
  solid.add(SolidVoxels::kMaxCell, SolidVoxels::kMaxCell, SolidVoxels::kMaxCell);
  CHECK(solid.exposed_faces(Eigen::Vector3d::Ones()).triangles.size() == 24);
}

TEST_CASE("polygons that are not convex keep their area and winding") {
  Rng rng = make_rng(3, "polygons");
  for (int round = 0; round < 300; ++round) {
    const int n = rng.uniform_int(3, 24);
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond(rng.normal(), rng.normal(), rng.normal(), rng.normal()).normalized();
    std::vector<Eigen::Vector3f> vertices;
    std::vector<std::uint32_t> corners;
    Eigen::Vector3d twice_area = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector3d> flat;
    for (int i = 0; i < n; ++i) {  // star-shaped around the origin
      const double angle_rad = 2.0 * M_PI * i / n;
      const double radius = rng.uniform(0.2, 1.0);
      flat.emplace_back(turn * Eigen::Vector3d(radius * std::cos(angle_rad), radius * std::sin(angle_rad), 0.0));
      vertices.push_back(flat.back().cast<float>());
      corners.push_back(static_cast<std::uint32_t>(i));
    }
    for (std::size_t i = 0; i < flat.size(); ++i) {
      twice_area += flat[i].cross(flat[(i + 1) % flat.size()]);
    }
    TriangleMesh mesh;
    mesh.vertices_m = vertices;
    triangulate(corners, vertices, mesh.triangles);
    REQUIRE(mesh.triangles.size() == static_cast<std::size_t>(n - 2));
    // Equal unsigned area means: no overlap, no triangle outside, none turned over.
    REQUIRE(area_of(mesh) == Approx(0.5 * twice_area.norm()).epsilon(1e-4));
    for (const auto& [a, b, c] : mesh.triangles) {
      const Eigen::Vector3d p = vertices[a].cast<double>();
      const Eigen::Vector3d cross = (vertices[b].cast<double>() - p).cross(vertices[c].cast<double>() - p);
      REQUIRE(cross.dot(twice_area) >= -1e-6);
    }
  }
}

}  // namespace stairwell::sim3d
