/// Small worlds and folders for the tests of the program.
#pragma once

#include "tests/test_folder.hpp"

#include <filesystem>
#include <fstream>
#include <string>

namespace stairwell::apps::testing {

inline std::filesystem::path fresh_folder(const std::string& name) {
  const std::filesystem::path folder = stairwell::testing::test_folder() / name;
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

inline std::filesystem::path write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// A solid box as one OBJ group; `vertices` counts what the file holds so far.
inline std::string obj_box(const double (&lo)[3], const double (&hi)[3], int& vertices) {
  std::string text;
  for (int corner = 0; corner < 8; ++corner) {
    text += "v";
    for (int axis = 0; axis < 3; ++axis) text += " " + std::to_string((corner >> axis & 1) != 0 ? hi[axis] : lo[axis]);
    text += "\n";
  }
  constexpr int kQuads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& quad : kQuads) {
    text += "f";
    for (const int corner : quad) text += " " + std::to_string(vertices + corner + 1);
    text += "\n";
  }
  vertices += 8;
  return text;
}

/// A closed room, inside from (-2,-1.5,0) to (2,1.5,2), walls 0.2 m thick, with a low wall across at x = 0.
inline std::filesystem::path write_room(const std::filesystem::path& folder) {
  int vertices = 0;
  std::string text = "# room\n";
  text += obj_box({-2.2, -1.7, -0.2}, {2.2, 1.7, 0.0}, vertices);
  text += obj_box({-2.2, -1.7, 2.0}, {2.2, 1.7, 2.2}, vertices);
  text += obj_box({-2.2, -1.7, 0.0}, {-2.0, 1.7, 2.0}, vertices);
  text += obj_box({2.0, -1.7, 0.0}, {2.2, 1.7, 2.0}, vertices);
  text += obj_box({-2.0, -1.7, 0.0}, {2.0, -1.5, 2.0}, vertices);
  text += obj_box({-2.0, 1.5, 0.0}, {2.0, 1.7, 2.0}, vertices);
  text += obj_box({-0.1, -1.5, 0.0}, {0.1, 0.3, 2.0}, vertices);
  return write_text(folder / "room.obj", text);
}

inline constexpr const char* kRoomBox = "-2,-1.5,0,2,1.5,2";

}  // namespace stairwell::apps::testing
