#include "core/rng.hpp"
#include "loader_checks.hpp"
#include "sim3d/loaders/voxel_faces.hpp"
#include "sim3d/world.hpp"
#include "sim3d/world_io.hpp"

#include <assimp/scene.h>
#include <octomap/octomap.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>
#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <set>

namespace stairwell::sim3d::test {

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

TriangleMesh faces_of_octree(const octomap::OcTree& tree) {
  SolidVoxels solid;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    if (!tree.isNodeOccupied(*leaf)) {
      continue;
    }
    const octomap::OcTreeKey key = leaf.getIndexKey();
    const int edge = 1 << (tree.getTreeDepth() - leaf.getDepth());
    for (int i = 0; i < edge * edge * edge; ++i) {
      solid.add(key[0] - 32768 + i % edge, key[1] - 32768 + i / edge % edge, key[2] - 32768 + i / edge / edge);
    }
  }
  return solid.exposed_faces(Eigen::Vector3d::Constant(tree.getResolution()));
}

TriangleMesh faces_of_points(const std::vector<Eigen::Vector3f>& points_m, double size_m) {
  SolidVoxels solid;
  for (const Eigen::Vector3f& point_m : points_m) {
    if (point_m.allFinite()) {
      const Eigen::Vector3d cell = (point_m.cast<double>() * (1.0 / size_m)).array().floor();
      solid.add(static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z()));
    }
  }
  return solid.exposed_faces(Eigen::Vector3d::Constant(size_m));
}

std::vector<Eigen::Vector3f> random_points(Rng& rng, int count) {
  std::vector<Eigen::Vector3f> points_m;
  for (int i = 0; i < count; ++i) {
    points_m.emplace_back(static_cast<float>(rng.uniform(-2.0, 2.0)), static_cast<float>(rng.uniform(-2.0, 2.0)),
                          static_cast<float>(rng.uniform(-0.5, 1.0)));
    if (i % 17 == 5) {
      points_m.back()[i % 3] = kNaN;
    }
  }
  return points_m;
}

/// Two boxes as two parts, written by hand.
std::string two_boxes_obj() {
  std::string text;
  for (const double offset : {0.0, 5.0}) {
    text += offset == 0.0 ? "o first\n" : "o second\n";
    for (int corner = 0; corner < 8; ++corner) {
      text += "v " + std::to_string(offset + ((corner & 1) != 0 ? 1.0 : 0.0)) + " " +
              std::to_string((corner & 2) != 0 ? 2.0 : 0.0) + " " + std::to_string((corner & 4) != 0 ? 3.0 : 0.0) +
              "\n";
    }
    text += "f -8/1/1 -4 -2 -6\nf -7 -5 -1 -3\nf -8 -7 -3 -4\nf -6 -2 -1 -5\nf -8 -6 -5 -7\nf -4 -3 -1 -2\n";
  }
  return text;
}

}  // namespace

TEST_CASE("OctoMap files give the faces of their occupied leaves") {
  Rng rng = make_rng(11, "octomap files");
  for (int round = 0; round < 12; ++round) {
    octomap::OcTree tree(0.1 + 0.05 * round);
    for (int i = 0; i < 400; ++i) {
      const bool occupied = rng.uniform() < 0.6;
      const octomap::point3d point(static_cast<float>(rng.uniform(-3.0, 3.0)),
                                   static_cast<float>(rng.uniform(-3.0, 3.0)),
                                   static_cast<float>(rng.uniform(-1.0, 2.0)));
      tree.updateNode(point, occupied);
    }
    for (int i = 0; i < 512; ++i) {  // a block that prunes to a large leaf
      tree.updateNode(octomap::OcTreeKey(static_cast<octomap::key_type>(32768 + i % 8),
                                         static_cast<octomap::key_type>(32768 + i / 8 % 8),
                                         static_cast<octomap::key_type>(32768 + i / 64)),
                      true);
    }
    tree.updateInnerOccupancy();
    tree.prune();
    const auto expected = triangle_list(faces_of_octree(tree));
    REQUIRE(!expected.empty());
    const auto full = temporary("tree.ot");
    const auto binary = temporary("tree.bt");
    REQUIRE(tree.write(full.string()));
    REQUIRE(tree.writeBinaryConst(binary.string()));
    CHECK(triangle_list(load_world(full).mesh) == expected);
    CHECK(triangle_list(load_world(binary).mesh) == expected);
  }
}

TEST_CASE("PCD files of all three encodings give the voxels of their points") {
  Rng rng = make_rng(5, "pcd files");
  for (const int count : {1, 7, 3000}) {
    const std::vector<Eigen::Vector3f> points_m = random_points(rng, count);
    pcl::PointCloud<pcl::PointXYZI> cloud;
    for (const Eigen::Vector3f& point_m : points_m) {
      pcl::PointXYZI& point = cloud.emplace_back();
      point.getVector3fMap() = point_m;
      point.intensity = point_m.x() > 0 ? 1.0F : 2.0F;
    }
    const auto expected = triangle_list(faces_of_points(points_m, 0.2));
    const auto file = temporary("cloud.pcd");
    const WorldOptions options{.point_size_m = 0.2, .close_gaps = false};
    pcl::PCDWriter writer;
    REQUIRE(writer.writeBinary(file.string(), cloud) == 0);
    CHECK(triangle_list(load_world(file, options).mesh) == expected);
    REQUIRE(writer.writeBinaryCompressed(file.string(), cloud) == 0);
    CHECK(triangle_list(load_world(file, options).mesh) == expected);
    REQUIRE(writer.writeASCII(file.string(), cloud, 9) == 0);
    CHECK(triangle_list(load_world(file, options).mesh) == expected);
  }
}

TEST_CASE("a long run compresses to back references that overlap themselves") {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  for (int i = 0; i < 5000; ++i) {
    cloud.emplace_back(static_cast<float>(i / 1000), 0.5F, 0.5F);
  }
  const auto file = temporary("runs.pcd");
  REQUIRE(pcl::PCDWriter().writeBinaryCompressed(file.string(), cloud) == 0);
  const World world = load_world(file, {.point_size_m = 1.0});
  CHECK(world.mesh.triangles.size() == 12);
  CHECK(world.bounds.size_m() == Eigen::Vector3d(5, 1, 1));
}

TEST_CASE("voxels between two of a cloud's are filled along each axis, and no others") {
  Rng rng = make_rng(7, "gaps");
  std::set<std::array<int, 3>> cells;
  for (int i = 0; i < 4000; ++i) cells.insert({rng.uniform_int(-9, 9), rng.uniform_int(-9, 9), rng.uniform_int(0, 18)});
  std::set<std::array<int, 3>> closed = cells;
  for (int x = -10; x <= 10; ++x)
    for (int y = -10; y <= 10; ++y)
      for (int z = -1; z <= 19; ++z)
        for (std::size_t axis = 0; axis < 3; ++axis) {
          std::array<int, 3> before{x, y, z};
          std::array<int, 3> after = before;
          --before[axis];
          ++after[axis];
          if (cells.contains(before) && cells.contains(after)) closed.insert({x, y, z});
        }
  REQUIRE(closed.size() > cells.size());
  const auto centers = [](const std::set<std::array<int, 3>>& all) {
    std::vector<Eigen::Vector3f> points_m;
    for (const auto& [x, y, z] : all)
      points_m.emplace_back((Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)) +
                             Eigen::Vector3f::Constant(0.5F)) *
                            0.5F);
    return points_m;
  };
  pcl::PointCloud<pcl::PointXYZ> cloud;
  for (const Eigen::Vector3f& point_m : centers(cells)) cloud.emplace_back(point_m.x(), point_m.y(), point_m.z());
  const auto file = temporary("gaps.pcd");
  REQUIRE(pcl::PCDWriter().writeBinary(file.string(), cloud) == 0);
  CHECK(triangle_list(load_world(file, {.point_size_m = 0.5}).mesh) ==
        triangle_list(faces_of_points(centers(closed), 0.5)));
}

TEST_CASE("a PLY file of points is a cloud") {
  Rng rng = make_rng(6, "ply points");
  const std::vector<Eigen::Vector3f> points_m = random_points(rng, 200);
  std::ostringstream text;
  text.precision(9);
  text << "ply\r\nformat ascii 1.0\r\ncomment c\r\nelement vertex 200\r\nproperty uchar red\r\nproperty float x\r\n"
       << "property float y\r\nproperty double z\r\nend_header\r\n";
  for (const Eigen::Vector3f& p : points_m) {
    text << "7 " << p.x() << ' ' << p.y() << ' ' << p.z() << "\r\n";
  }
  const auto file = write_text("points.ply", text.str());
  CHECK(triangle_list(load_world(file, {.point_size_m = 0.25, .close_gaps = false}).mesh) ==
        triangle_list(faces_of_points(points_m, 0.25)));
}

TEST_CASE("meshes saved and loaded again are the same") {
  const World world = load_world(write_text("boxes.obj", two_boxes_obj()));
  CHECK(world.mesh.triangles.size() == 24);
  CHECK(world.mesh.vertices_m.size() == 16);
  CHECK(world.name == "boxes");
  const WorldInfo info = world_info(world);
  CHECK(info.area_m2 == Approx(2 * 2 * (1 * 2 + 1 * 3 + 2 * 3)));
  CHECK(info.bounds.max_m == Eigen::Vector3d(6, 2, 3));
  for (const char* extension : {".stl", ".obj", ".ply"}) {
    const auto file = temporary(std::string("saved") + extension);
    save_mesh(world, file);
    CHECK(triangle_list(load_world(file).mesh) == triangle_list(world.mesh));
    CHECK(!std::filesystem::exists(file.string() + ".part"));
  }
  CHECK_THROWS_AS(save_mesh(world, temporary("saved.xyz")), InputError);
  CHECK_THROWS_AS(save_mesh(world, temporary("no_such_folder") / "saved.stl"), RunError);
  std::filesystem::create_directories(temporary("folder.stl"));
  CHECK_THROWS_AS(save_mesh(world, temporary("folder.stl")), RunError);
  CHECK(!std::filesystem::exists(temporary("folder.stl.part")));
}

TEST_CASE("other programs' mesh files give the same surface, z up") {
  const auto obj = write_text("boxes.obj", two_boxes_obj());
  const auto expected = triangle_list(load_world(obj).mesh);
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(obj.string(), 0);
  REQUIRE(scene != nullptr);
  Assimp::Exporter exporter;
  for (const auto& [format, name] :
       {std::pair{"stl", "x.stl"}, {"stlb", "y.stl"}, {"ply", "x.ply"}, {"plyb", "y.ply"}}) {
    const auto file = temporary(name);
    REQUIRE(exporter.Export(scene, format, file.string()) == aiReturn_SUCCESS);
    CHECK(triangle_list(load_world(file).mesh).size() == expected.size());
    CHECK(world_info(load_world(file)).area_m2 == Approx(44.0));
    CHECK(load_world(file).bounds.max_m == Eigen::Vector3d(6, 2, 3));
  }
  // y up by definition: what the scene calls y must come out as z.
  for (const auto& [format, name] : {std::pair{"collada", "x.dae"}, {"gltf2", "x.gltf"}, {"glb2", "x.glb"}}) {
    const auto file = temporary(name);
    REQUIRE(exporter.Export(scene, format, file.string()) == aiReturn_SUCCESS);
    const World world = load_world(file);
    CHECK(world_info(world).area_m2 == Approx(44.0));
    CHECK(world.bounds.min_m.isApprox(Eigen::Vector3d(0, -3, 0)));
    CHECK(world.bounds.max_m.isApprox(Eigen::Vector3d(6, 0, 2)));
  }
  const std::string dae = read_text(temporary("x.dae"));
  std::string z_up = dae;
  const auto at = z_up.find("Y_UP");
  REQUIRE(at != std::string::npos);
  z_up.replace(at, 4, "Z_UP");
  CHECK(triangle_list(load_world(write_text("z.dae", z_up)).mesh).size() == expected.size());
  CHECK(load_world(temporary("z.dae")).bounds.max_m.isApprox(Eigen::Vector3d(6, 2, 3)));
}

TEST_CASE("triangles that are not usable are left out") {
  const auto file =
      write_text("nan.stl",
                 "solid s\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
                 "endfacet\nfacet normal 0 0 0\nouter loop\nvertex nan 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                 "endloop\nendfacet\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                 "vertex 2 0 0\nendloop\nendfacet\nendsolid s\n");
  const World world = load_world(file);
  CHECK(world.mesh.triangles.size() == 1);
  CHECK(world.mesh.vertices_m.size() == 3);
  CHECK(world.dropped_triangles == 2);
  CHECK(world.bounds.max_m == Eigen::Vector3d(1, 1, 0));
}

TEST_CASE(".3dmap cells fill from their coordinate to the next") {
  const auto file = write_text("m.3dmap", "voxel 9 9 9\n1 2 3\n2 2 3\n\n2 2 3\n");
  const World world = load_world(file, {.voxel_size_m = 0.5});
  CHECK(world.mesh.triangles.size() == 12);
  CHECK(world.bounds.min_m == Eigen::Vector3d(0.5, 1.0, 1.5));
  CHECK(world.bounds.max_m == Eigen::Vector3d(1.5, 1.5, 2.0));
}

}  // namespace stairwell::sim3d::test
