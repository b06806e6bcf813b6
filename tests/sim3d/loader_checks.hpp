#pragma once

#include "core/errors.hpp"
#include "sim3d/world.hpp"
#include "tests/test_folder.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace stairwell::sim3d::test {

inline std::filesystem::path temporary(const std::string& name) {
  return testing::test_folder() / name;
}

inline std::filesystem::path write_text(const std::string& name, const std::string& text) {
  const auto path = temporary(name);
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// Corners of every triangle, rotated to begin with the smallest and sorted: equal for equal oriented surfaces.
inline std::vector<std::array<std::array<float, 3>, 3>> triangle_list(const TriangleMesh& mesh) {
  std::vector<std::array<std::array<float, 3>, 3>> list;
  for (const auto& triangle : mesh.triangles) {
    auto& corners = list.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3f& v = mesh.vertices_m[triangle[i]];
      corners[i] = {v.x(), v.y(), v.z()};
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  }
  std::sort(list.begin(), list.end());
  return list;
}

/// What the loader says about a file it refuses; "accepted" when it does not, and what is wrong with the message.
inline std::string refusal(const std::filesystem::path& file, const WorldOptions& options = {}) {
  try {
    load_world(file, options);
  } catch (const InputError& error) {
    const std::string message = error.what();
    return message.find('\n') == std::string::npos ? message : "more than one line: " + message;
  }
  return "accepted";
}

}  // namespace stairwell::sim3d::test
