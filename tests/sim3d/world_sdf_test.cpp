#include "loader_checks.hpp"
#include "sim3d/world.hpp"
#include "sim3d/world_io.hpp"

#include <png.h>
#include <catch2/catch.hpp>

#include <cmath>

namespace stairwell::sim3d::test {

namespace {

std::string sdf_world(const std::string& content) {
  return "<?xml version='1.0'?><sdf version='1.9'><world name='w'>" + content + "</world></sdf>";
}

std::string box_link(const std::string& name, const std::string& pose, const std::string& kind = "collision") {
  return "<link name='" + name + "'>" + pose + "<" + kind +
         " name='c'><geometry><box><size>1 2 3</size></box></geometry></" + kind + "></link>";
}

Aabb bounds_of(const std::string& content) { return load_world(write_text("t.sdf", sdf_world(content))).bounds; }

void check_box(const Aabb& box, const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m) {
  CHECK(box.min_m.isApprox(min_m, 1e-5));
  CHECK(box.max_m.isApprox(max_m, 1e-5));
}

}  // namespace

TEST_CASE("SDFormat: poses of models, links, frames and nested models add up") {
  check_box(bounds_of("<model name='m'><static>1</static><pose>10 0 1.5 0 0 1.5707963267948966</pose>" +
                      box_link("l", "<pose>0 5 0 0 0 0</pose>") + "</model>"),
            {4, -0.5, 0}, {6, 0.5, 3});
  check_box(bounds_of("<model name='m'><static>1</static><pose>10 0 0 0 0 0</pose><frame name='f'>"
                      "<pose>0 0 100 0 0 0</pose></frame>" +
                      box_link("l", "<pose relative_to='f'>0 5 0 0 0 0</pose>") + "</model>"),
            {9.5, 4, 98.5}, {10.5, 6, 101.5});
  check_box(
      bounds_of("<model name='m'><static>1</static><pose>10 0 0 0 0 0</pose>" +
                box_link("l", "<pose>0 7 0 0 0 0</pose>") +
                "<model name='n'><pose relative_to='l'>0 0 50 0 0 0</pose>" + box_link("k", "") + "</model></model>"),
      {9.5, 6, -1.5}, {10.5, 8, 51.5});
}

TEST_CASE("SDFormat: a world may be called as SDFormat's own descriptions are") {
  const auto here = std::filesystem::current_path();
  for (const char* name : {"world.sdf", "model.sdf", "box_shape.sdf"}) {
    CAPTURE(name);
    const auto file =
        write_text(name, sdf_world("<model name='m'><static>1</static>" + box_link("l", "") + "</model>"));
    std::filesystem::current_path(file.parent_path());
    Aabb bounds;
    CHECK_NOTHROW(bounds = load_world(name).bounds);
    std::filesystem::current_path(here);
    check_box(bounds, {-0.5, -1, -1.5}, {0.5, 1, 1.5});
  }
}

TEST_CASE("SDFormat: visuals count only where a link has no collision") {
  check_box(bounds_of("<model name='m'><static>1</static>" + box_link("l", "", "visual") + "</model>"),
            {-0.5, -1, -1.5}, {0.5, 1, 1.5});
  check_box(bounds_of("<model name='m'><static>1</static><link name='l'><collision name='c'><geometry><sphere>"
                      "<radius>0.5</radius></sphere></geometry></collision><visual name='v'><geometry><sphere>"
                      "<radius>9</radius></sphere></geometry></visual></link></model>"),
            {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
}

TEST_CASE("SDFormat: each primitive has its area and bounds") {
  const auto shape = [](const std::string& geometry) {
    return world_info(load_world(write_text(
        "shape.sdf", sdf_world("<model name='m'><static>1</static><link name='l'><collision name='c'><geometry>" +
                               geometry + "</geometry></collision></link></model>"))));
  };
  const WorldInfo cylinder = shape("<cylinder><radius>2</radius><length>3</length></cylinder>");
  CHECK(cylinder.area_m2 == Approx(2 * M_PI * 2 * 3 + 2 * M_PI * 4).epsilon(0.01));
  check_box(cylinder.bounds, {-2, -2, -1.5}, {2, 2, 1.5});
  const WorldInfo sphere = shape("<sphere><radius>2</radius></sphere>");
  CHECK(sphere.area_m2 == Approx(4 * M_PI * 4).epsilon(0.01));
  check_box(sphere.bounds, {-2, -2, -2}, {2, 2, 2});
  const WorldInfo capsule = shape("<capsule><radius>1</radius><length>3</length></capsule>");
  CHECK(capsule.area_m2 == Approx(4 * M_PI + 2 * M_PI * 3).epsilon(0.01));
  check_box(capsule.bounds, {-1, -1, -2.5}, {1, 1, 2.5});
  check_box(shape("<ellipsoid><radii>1 2 3</radii></ellipsoid>").bounds, {-1, -2, -3}, {1, 2, 3});
  const WorldInfo plane = shape("<plane><normal>1 0 0</normal><size>4 6</size></plane>");
  CHECK(plane.area_m2 == Approx(24.0));
  CHECK(plane.bounds.size_m().x() == Approx(0.0).margin(1e-6));
  CHECK(plane.triangles == 2);
}

TEST_CASE("SDFormat: meshes are found beside the file, scaled, and cut to a submesh") {
  write_text("models/thing/meshes/two.obj",
             "o one\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no two\nv 4 0 0\nv 6 0 0\nv 4 2 0\nf 4 5 6\n");
  const auto world = [](const std::string& mesh) {
    return "<model name='m'><static>1</static><link name='l'><collision name='c'><geometry><mesh>" + mesh +
           "</mesh></geometry></collision></link></model>";
  };
  check_box(bounds_of(world("<uri>models/thing/meshes/two.obj</uri><scale>2 1 1</scale>")), {0, 0, 0}, {12, 2, 0});
  check_box(bounds_of(world("<uri>model://thing/meshes/two.obj</uri><submesh><name>two</name></submesh>")), {4, 0, 0},
            {6, 2, 0});
  check_box(bounds_of(world("<uri>model://thing/meshes/two.obj</uri>"
                            "<submesh><name>two</name><center>true</center></submesh>")),
            {-1, -1, 0}, {1, 1, 0});
  const auto refused = [&](const std::string& mesh) {
    return refusal(write_text("refused.sdf", sdf_world(world(mesh))));
  };
  CHECK_THAT(refused("<uri>nothing.stl</uri>"), Catch::Contains("nothing.stl") && Catch::Contains("not there"));
  CHECK_THAT(refused("<uri>model://thing/meshes/two.obj</uri><submesh><name>six</name></submesh>"),
             Catch::Contains("six"));
}

TEST_CASE("SDFormat: included models come from folders beside the file") {
  write_text("included/model.config",
             "<?xml version='1.0'?><model><name>included</name><sdf version='1.9'>model.sdf</sdf></model>");
  write_text("included/part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write_text(
      "included/model.sdf",
      "<?xml version='1.0'?><sdf version='1.9'><model name='i'><static>1</static><link name='l'>"
      "<collision name='c'><geometry><mesh><uri>part.obj</uri></mesh></geometry></collision></link></model></sdf>");
  check_box(bounds_of("<include><uri>model://included</uri><pose>1 2 3 0 0 0</pose></include>"), {1, 2, 3}, {2, 3, 3});
  check_box(bounds_of("<include><uri>included</uri><name>a</name><pose>1 2 3 0 0 0</pose></include>"
                      "<include><uri>included</uri><name>b</name><pose>5 2 3 0 0 0</pose></include>"),
            {1, 2, 3}, {6, 3, 3});
  CHECK(load_world(temporary("included/model.sdf")).mesh.triangles.size() == 1);
  CHECK_THAT(refusal(write_text("r.sdf", sdf_world("<include><uri>model://missing_model</uri></include>"))),
             Catch::Contains("missing_model"));
}

TEST_CASE("map images: rows, thresholds, origin and encodings") {
  // 3 x 2 pixels: wall at the upper left (x 0, y 1) and grey (unknown) at the lower right.
  const std::vector<int> grey{0, 254, 254, 254, 254, 205};
  std::string p2 = "P2\n# comment\n3 2\n255\n";
  std::string p5 = "P5 3 2 255\n";
  for (const int value : grey) {
    p2 += std::to_string(value) + " ";
    p5 += static_cast<char>(value);
  }
  write_text("a.pgm", p2);
  write_text("b.pgm", p5);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = 3;
  png.height = 2;
  png.format = PNG_FORMAT_GRAY;
  const std::vector<png_byte> pixels(grey.begin(), grey.end());
  REQUIRE(png_image_write_to_file(&png, temporary("c.png").c_str(), 0, pixels.data(), 0, nullptr) != 0);
  for (const std::string image : {"a.pgm", "b.pgm", "c.png"}) {
    const auto load = [&](const std::string& more) {
      return load_world(write_text("map.yaml", "image: " + image + "\nresolution: 0.5\n" + more),
                        {.extrude_height_m = 2.0});
    };
    check_box(load("origin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n").bounds, {0, 0.5, 0}, {0.5, 1, 2});
    check_box(load("origin: [-3.0, 1.0, 0]\n").bounds, {-3, 1.5, 0}, {-2.5, 2, 2});
    check_box(load("origin: [0, 0, 1.5707963267948966]\n").bounds, {-1, 0, 0}, {-0.5, 0.5, 2});
    // Unknown becomes a wall only when the threshold is below it; negated, white is a wall.
    check_box(load("occupied_thresh: 0.1\n").bounds, {0, 0, 0}, {1.5, 1, 2});
    CHECK(load("negate: 1\n").mesh.triangles.size() > 12);
  }
}

}  // namespace stairwell::sim3d::test
