#include "core/rng.hpp"
#include "loader_checks.hpp"
#include "sim3d/world.hpp"
#include "sim3d/world_io.hpp"

#include <catch2/catch.hpp>

#include <cmath>

namespace stairwell::sim3d::test {

namespace {

const std::string kSdf =
    "<?xml version='1.0'?><sdf version='1.9'><world name='w'><model name='m'><static>1</static><pose>1 2 3 0 0 0</pose>"
    "<link name='l'><collision name='c'><geometry><box><size>1 2 3</size></box></geometry></collision></link></model>"
    "</world></sdf>";
const std::string kPcd =
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
    "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n0.05 0.05 0.05\n1 2 3\n";
const std::string kYaml = "image: walls.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n";

/// One valid file of every kind that needs no other program to write it.
std::vector<std::filesystem::path> valid_files() {
  std::vector<std::filesystem::path> files;
  files.push_back(write_text("valid/box.sdf", kSdf));
  const World world = load_world(files[0]);
  for (const char* name : {"valid/box.stl", "valid/box.obj", "valid/box.ply"}) {
    files.push_back(temporary(name));
    save_mesh(world, files.back());
  }
  files.push_back(write_text("valid/cloud.pcd", kPcd));
  std::string binary = kPcd.substr(0, kPcd.find("ascii")) + "binary\n";
  binary.append(24, '\1');
  files.push_back(write_text("valid/binary.pcd", binary));
  write_text("valid/walls.pgm", "P5 2 2 255\n" + std::string(4, '\0'));
  files.push_back(write_text("valid/walls.yaml", kYaml));
  files.push_back(write_text("valid/cells.3dmap", "voxel 5 5 5\n1 1 1\n4 4 4\n"));
  // Root with one inner child and so on for 15 levels, then an occupied leaf: 17 nodes.
  std::string tree = "# Octomap OcTree binary file\nid OcTree\nsize 17\nres 0.1\ndata\n";
  for (int depth = 0; depth < 15; ++depth) {
    tree += std::string("\3\0", 2);
  }
  tree += std::string("\2\0", 2);
  files.push_back(write_text("valid/tree.bt", tree));
  return files;
}

/// Accepted or refused with one line that names the file; anything else fails the test (or crashes it).
void check_answer(const std::filesystem::path& file) {
  const std::string answer = refusal(file);
  const bool good = answer == "accepted" || answer.find(file.parent_path().string()) == 0;
  if (!good) {
    FAIL("answer to a damaged file: " << answer);
  }
}

}  // namespace

TEST_CASE("files that are no worlds are refused with one line that names them") {
  const auto says = [](const std::filesystem::path& file, const std::string& words) {
    const std::string message = refusal(file);
    CHECK_THAT(message, Catch::StartsWith(file.string()) && Catch::Contains(words));
  };
  says(temporary("nothing_there.stl"), "no such file");
  says(temporary(""), "is a folder");
  says(write_text("empty.stl", ""), "is empty");
  says(write_text("odd.xyz", "1 2 3"), ".sdf .world .stl");
  says(write_text("image.pgm", "P5 1 1 255\n1"), ".yaml");
  says(write_text("short.stl", "abc"), "truncated");
  says(write_text("none.obj", "v 0 0 0\n"), "no geometry");
  says(write_text("far.obj", "v 0 0 0\nf 1 2 9\n"), "line 2");
  says(write_text("all_nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "none of its triangles is usable");
  says(write_text("words.bt", "something else"), "not an OctoMap file");
  // A chain of nodes one level deeper than the tree, which no shift may follow.
  std::string deep = "# Octomap OcTree file\nid OcTree\nsize 18\nres 0.1\ndata\n";
  for (int level = 0; level < 18; ++level) {
    deep += std::string("\0\0\0\0\x01", 5);
  }
  says(write_text("deep.ot", deep), "truncated or damaged");
  // Millions of cells in a few bytes, and then the wrong number of nodes.
  std::string large = "# Octomap OcTree file\nid OcTree\nsize 99\nres 0.1\ndata\n";
  for (int level = 0; level < 8; ++level) {
    large += std::string("\0\0\0\0\x01", 5);
  }
  says(write_text("rest.bt",
                  std::string("# Octomap OcTree binary file\nid OcTree\nsize 2\nres 1\ndata\n\x01\0more", 63)),
       "left over");
  says(write_text("large.ot", large + std::string("\0\0\0\0\0", 5)), "its header promises 99 nodes");
  says(write_text("words.3dmap", "pixel 3 3 3\n"), "voxel X Y Z");
  says(write_text("out.3dmap", "voxel 3 3 3\n1 1 1\n1 1 3\n"), "line 3");
  says(write_text("free.3dmap", "voxel 3 3 3\n"), "no geometry");
  says(write_text("words.sdf", "hello"), "XML");
  says(write_text("empty_world.sdf", "<sdf version='1.9'><world name='w'/></sdf>"), "no geometry");
  says(write_text("words.glb", "hello"), "not a .glb file");
  says(write_text("vast.glb", std::string("glTF\2\0\0\0\x1c\0\0\0\xff\xff\xff\x7fJSON12345678", 28)), "block");
  says(write_text("letters.dae", "<COLLADA version='1.4.1'><p>0 1 x</p></COLLADA>"), "index list");
  says(write_text("counts.dae", "<COLLADA version='1.4.1'><float_array count='99999999999'/></COLLADA>"), "promises");
  says(write_text("noimage.yaml", "image: none.pgm\nresolution: 1\n"), "none.pgm");
  says(write_text("elsewhere.yaml", "image: /\nresolution: 1\n"), "names the image /: is");
  says(write_text("list.yaml", "- 1\n- 2\n"), "map_server");
  says(write_text("nan.pcd", kPcd.substr(0, kPcd.find("0.05")) + "nan nan nan\nnan 1 2\n"), "no usable point");
  says(write_text("noxyz.pcd", "FIELDS a b c\nPOINTS 1\nDATA ascii\n1 2 3\n"), "field 'x'");
  const auto huge = kPcd.substr(0, kPcd.find("POINTS 2")) + "POINTS 4000000000\nDATA binary\n";
  says(write_text("huge.pcd", huge), "truncated");
  says(write_text("huge.ply", "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n1\n"),
       "truncated");
}

TEST_CASE("options that make no sense are refused") {
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    CHECK_THAT(refusal(write_text("o.pcd", kPcd), {.point_size_m = bad}), Catch::Contains("point size"));
    CHECK_THAT(refusal(write_text("o.3dmap", "voxel 1 1 1\n0 0 0\n"), {.voxel_size_m = bad}), Catch::Contains("voxel"));
    CHECK_THAT(refusal(write_text("o.yaml", kYaml), {.extrude_height_m = bad}), Catch::Contains("height"));
  }
  CHECK_THAT(refusal(write_text("o.pcd", kPcd), {.point_size_m = 1e-9}), Catch::Contains("too far out"));
}

TEST_CASE("every cut of a valid file is refused or a smaller world") {
  for (const auto& file : valid_files()) {
    REQUIRE(refusal(file) == "accepted");
    const std::string bytes = read_text(file);
    const std::size_t step = file.extension() == ".sdf" ? 11 : 3;
    for (std::size_t length = 0; length < bytes.size(); length += step) {
      check_answer(write_text("valid/cut" + file.extension().string(), bytes.substr(0, length)));
    }
  }
}

TEST_CASE("damaged bytes never do more than get the file refused") {
  Rng rng = make_rng(1, "damaged files");
  for (const auto& file : valid_files()) {
    const std::string bytes = read_text(file);
    const int rounds = file.extension() == ".sdf" ? 20 : 150;
    for (int round = 0; round < rounds; ++round) {
      std::string damaged = bytes;
      const int changes = rng.uniform_int(1, 6);
      for (int i = 0; i < changes; ++i) {
        const auto at = static_cast<std::size_t>(rng.uniform_int(0, static_cast<int>(bytes.size()) - 1));
        damaged[at] = static_cast<char>(rng.uniform_int(0, 255));
      }
      check_answer(write_text("valid/damaged" + file.extension().string(), damaged));
    }
  }
}

TEST_CASE("a damaged tree can neither recurse without end nor ask for endless memory") {
  const std::string header = "# Octomap OcTree binary file\nid OcTree\nsize 99\nres 0.1\ndata\n";
  CHECK_THAT(refusal(write_text("deep.bt", header + std::string(4000, '\xff'))), Catch::Contains("damaged"));
  CHECK_THAT(refusal(write_text("vast.bt", header + std::string("\2\0", 2))), Catch::Contains("coarser"));
}

}  // namespace stairwell::sim3d::test
