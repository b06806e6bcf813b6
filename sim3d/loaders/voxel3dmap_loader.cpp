#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"
#include "sim3d/loaders/voxel_faces.hpp"

namespace stairwell::sim3d {

namespace {

std::array<std::int64_t, 3> read_size(TextReader& reader, const std::filesystem::path& file) {
  WordReader words(reader.line().value_or(""));
  std::array<std::int64_t, 3> size{};
  bool good = words.word() == "voxel";
  for (std::int64_t& cells : size) {
    cells = parse_number<std::int64_t>(words.word()).value_or(0);
    good = good && cells > 0 && cells < SolidVoxels::kMaxCell;
  }
  if (!good) {
    fail_input(file, "is not a .3dmap file: its first line must read 'voxel X Y Z' with the three sizes");
  }
  return size;
}

}  // namespace

TriangleMesh load_voxel3dmap(const std::filesystem::path& file, double voxel_size_m) {
  const std::string bytes = read_bytes(file);
  TextReader reader(bytes);
  const std::array<std::int64_t, 3> size = read_size(reader, file);
  SolidVoxels solid;
  while (const auto line = reader.line()) {
    WordReader words(*line);
    std::string_view word = words.word();
    if (word.empty()) {
      continue;
    }
    std::array<std::int64_t, 3> cell{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto value = parse_number<std::int64_t>(word);
      if (!value || *value < 0 || *value >= size[axis]) {
        fail_input(file, "line " + std::to_string(reader.line_number()) +
                             ": a blocked cell needs three whole numbers within the sizes of the first line");
      }
      cell[axis] = *value;
      word = words.word();
    }
    if (!word.empty()) {
      fail_input(file, "line " + std::to_string(reader.line_number()) + ": more than three numbers");
    }
    solid.add(cell[0], cell[1], cell[2]);
  }
  return solid.exposed_faces(Eigen::Vector3d::Constant(voxel_size_m));
}

}  // namespace stairwell::sim3d
