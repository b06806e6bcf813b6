#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"

namespace stairwell::sim3d {

namespace {

constexpr std::size_t kHeaderBytes = 84;
constexpr std::size_t kTriangleBytes = 50;

void add_triangle(const std::array<Eigen::Vector3f, 3>& corners, TriangleMesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.insert(mesh.vertices_m.end(), corners.begin(), corners.end());
  mesh.triangles.push_back({first, first + 1, first + 2});
}

TriangleMesh read_binary(std::string_view bytes, const std::filesystem::path& file) {
  const std::size_t count = read_value<std::uint32_t>(bytes, 80);
  const std::size_t expected = kHeaderBytes + kTriangleBytes * count;
  if (bytes.size() < expected) {
    fail_input(file, "is truncated or not an STL file: " + std::to_string(count) + " triangles need " +
                         std::to_string(expected) + " bytes, it has " + std::to_string(bytes.size()) +
                         "; export it again");
  }
  TriangleMesh mesh;
  mesh.vertices_m.reserve(3 * count);
  mesh.triangles.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t offset = kHeaderBytes + kTriangleBytes * i + 12;
    std::array<Eigen::Vector3f, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        corners[k][static_cast<Eigen::Index>(axis)] = read_value<float>(bytes, offset + 12 * k + 4 * axis);
      }
    }
    add_triangle(corners, mesh);
  }
  return mesh;
}

TriangleMesh read_ascii(std::string_view text, const std::filesystem::path& file) {
  TriangleMesh mesh;
  TextReader reader(text);
  std::array<Eigen::Vector3f, 3> corners;
  std::size_t corner = 0;
  bool ended = false;
  while (const auto line = reader.line()) {
    WordReader words(*line);
    const std::string_view keyword = words.word();
    if (keyword == "vertex") {
      if (corner == 3) {
        fail_input(file, "line " + std::to_string(reader.line_number()) + ": a facet with more than three corners");
      }
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const auto value = parse_number<float>(words.word());
        if (!value) {
          fail_input(file, "line " + std::to_string(reader.line_number()) + ": 'vertex' needs three numbers");
        }
        corners[corner][axis] = *value;
      }
      ++corner;
    } else if (keyword == "endfacet") {
      if (corner != 3) {
        fail_input(file, "line " + std::to_string(reader.line_number()) + ": a facet needs three corners, this has " +
                             std::to_string(corner));
      }
      add_triangle(corners, mesh);
      corner = 0;
    }
    ended = keyword == "endsolid" || (ended && keyword.empty());
  }
  if (!ended) {
    fail_input(file, "is truncated: no 'endsolid' at its end; export it again");
  }
  return mesh;
}

}  // namespace

TriangleMesh load_stl(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  // Binary files may also begin with "solid"; then only their exact length tells.
  const bool binary_length = bytes.size() >= kHeaderBytes &&
                             bytes.size() == kHeaderBytes + kTriangleBytes * read_value<std::uint32_t>(bytes, 80);
  const bool says_solid = bytes.starts_with("solid") && bytes.find('\0') == std::string::npos;
  if (says_solid && !binary_length) {
    return read_ascii(bytes, file);
  }
  if (bytes.size() < kHeaderBytes) {
    fail_input(file, "is truncated or not an STL file: shorter than an STL header; export it again");
  }
  return read_binary(bytes, file);
}

}  // namespace stairwell::sim3d
