#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"
#include "sim3d/loaders/polygon.hpp"

namespace stairwell::sim3d {

namespace {

/// Corner indices of the open face, and the vertices of the whole file; each part keeps only global indices until
/// the end because OBJ numbers vertices over all parts.
struct ObjReader {
  const std::filesystem::path& file;
  TextReader text;
  std::vector<Eigen::Vector3f> vertices_m{};
  std::vector<MeshPart> parts{};

  [[noreturn]] void fail(const std::string& what) const {
    fail_input(file, "line " + std::to_string(text.line_number()) + ": " + what);
  }

  void read_vertex(WordReader& words) {
    Eigen::Vector3f vertex;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const auto value = parse_number<float>(words.word());
      if (!value) {
        fail("'v' needs three numbers; is the file complete?");
      }
      vertex[axis] = *value;
    }
    vertices_m.push_back(vertex);
  }

  std::uint32_t corner(std::string_view word) const {
    const auto number = parse_number<std::int64_t>(word.substr(0, word.find('/')));
    const auto count = static_cast<std::int64_t>(vertices_m.size());
    if (!number || *number == 0 || *number > count || *number < -count) {
      fail("'f' names vertex '" + std::string(word.substr(0, 40)) + "', but " + std::to_string(count) +
           " vertices are defined before it");
    }
    return static_cast<std::uint32_t>(*number > 0 ? *number - 1 : count + *number);
  }

  void read_face(WordReader& words) {
    std::vector<std::uint32_t> corners;
    for (std::string_view word = words.word(); !word.empty(); word = words.word()) {
      corners.push_back(corner(word));
    }
    if (corners.size() < 3) {
      fail("'f' needs at least three corners; is the file complete?");
    }
    if (parts.empty()) {
      parts.push_back({});
    }
    triangulate(corners, vertices_m, parts.back().mesh.triangles);
  }

  void read_line(std::string_view line) {
    WordReader words(line);
    const std::string_view keyword = words.word();
    if (keyword == "v") {
      read_vertex(words);
    } else if (keyword == "f") {
      read_face(words);
    } else if (keyword == "o" || keyword == "g") {
      parts.push_back({std::string(words.word()), {}});
    }
  }
};

/// From indices into the file's vertices to the part's own.
void localise(const std::vector<Eigen::Vector3f>& vertices_m, std::vector<std::int64_t>& local, TriangleMesh& mesh) {
  std::vector<std::uint32_t> used;
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& index : triangle) {
      if (local[index] < 0) {
        local[index] = static_cast<std::int64_t>(mesh.vertices_m.size());
        mesh.vertices_m.push_back(vertices_m[index]);
        used.push_back(index);
      }
      index = static_cast<std::uint32_t>(local[index]);
    }
  }
  for (const std::uint32_t index : used) {
    local[index] = -1;
  }
}

}  // namespace

std::vector<MeshPart> load_obj(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  ObjReader reader{file, TextReader(bytes)};
  while (const auto line = reader.text.line()) {
    if (!line->empty() && line->back() == '\\') {  // the statement goes on in the next line
      std::string joined(line->substr(0, line->size() - 1));
      while (const auto next = reader.text.line()) {
        const bool goes_on = !next->empty() && next->back() == '\\';
        joined += next->substr(0, next->size() - (goes_on ? 1 : 0));
        if (!goes_on) {
          break;
        }
      }
      reader.read_line(joined);
    } else {
      reader.read_line(*line);
    }
  }
  if (reader.vertices_m.empty()) {
    fail_input(file, "is not a Wavefront OBJ file: no line 'v x y z' in it");
  }
  std::vector<std::int64_t> local(reader.vertices_m.size(), -1);
  for (MeshPart& part : reader.parts) {
    localise(reader.vertices_m, local, part.mesh);
  }
  return std::move(reader.parts);
}

}  // namespace stairwell::sim3d
