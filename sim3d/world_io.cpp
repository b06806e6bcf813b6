#include "sim3d/world_io.hpp"

#include "core/errors.hpp"
#include "sim3d/loaders/input_file.hpp"

#include <Eigen/Geometry>

#include <bit>
#include <charconv>
#include <fstream>
#include <limits>
#include <system_error>

namespace stairwell::sim3d {

namespace {

template <typename Value>
void append_raw(std::string& out, const Value& value) {
  static_assert(std::endian::native == std::endian::little);
  const auto raw = std::bit_cast<std::array<char, sizeof(Value)>>(value);
  out.append(raw.data(), raw.size());
}

void append_vertex(std::string& out, const Eigen::Vector3f& v) {
  append_raw(out, v.x());
  append_raw(out, v.y());
  append_raw(out, v.z());
}

/// The shortest text that reads back as the same number.
template <typename Number>
void append_text(std::string& out, Number value) {
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  out.append(text.data(), result.ptr);
}

std::string stl_bytes(const TriangleMesh& mesh) {
  std::string out = "binary STL, metres";
  out.resize(80, ' ');
  append_raw(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d p = mesh.vertices_m[a].cast<double>();
    const Eigen::Vector3d q = mesh.vertices_m[b].cast<double>();
    const Eigen::Vector3d r = mesh.vertices_m[c].cast<double>();
    append_vertex(out, (q - p).cross(r - p).normalized().cast<float>());
    for (const std::uint32_t index : {a, b, c}) {
      append_vertex(out, mesh.vertices_m[index]);
    }
    append_raw(out, std::uint16_t{0});
  }
  return out;
}

std::string obj_bytes(const TriangleMesh& mesh) {
  std::string out = "# metres, z up\n";
  for (const Eigen::Vector3f& vertex : mesh.vertices_m) {
    out += 'v';
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      out += ' ';
      append_text(out, vertex[axis]);
    }
    out += '\n';
  }
  for (const auto& triangle : mesh.triangles) {
    out += 'f';
    for (const std::uint32_t index : triangle) {
      out += ' ';
      append_text(out, index + 1);
    }
    out += '\n';
  }
  return out;
}

std::string ply_bytes(const TriangleMesh& mesh) {
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment metres, z up\nelement vertex " +
                    std::to_string(mesh.vertices_m.size()) +
                    "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                    std::to_string(mesh.triangles.size()) + "\nproperty list uchar uint vertex_indices\nend_header\n";
  for (const Eigen::Vector3f& vertex : mesh.vertices_m) {
    append_vertex(out, vertex);
  }
  for (const auto& triangle : mesh.triangles) {
    append_raw(out, std::uint8_t{3});
    for (const std::uint32_t index : triangle) {
      append_raw(out, index);
    }
  }
  return out;
}

void write_whole(const std::filesystem::path& file, const std::string& bytes) {
  std::filesystem::path unfinished = file;
  unfinished += ".part";
  const auto fail = [&](const std::string& what) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw RunError(file.string() + ": " + what + "; check that the folder exists, is writable and has space left");
  };
  std::ofstream stream(unfinished, std::ios::binary | std::ios::trunc);
  if (!stream) {
    fail("cannot be written");
  }
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.flush();
  const bool written = stream.good();
  stream.close();
  if (!written || stream.fail()) {
    fail("cannot be written to its end");
  }
  std::error_code error;
  std::filesystem::rename(unfinished, file, error);
  if (error) {
    fail("cannot be put in place (" + error.message() + ")");
  }
}

}  // namespace

WorldInfo world_info(const World& world) {
  WorldInfo info;
  info.triangles = world.mesh.triangles.size();
  info.vertices = world.mesh.vertices_m.size();
  info.bounds = world.bounds;
  for (const auto& [a, b, c] : world.mesh.triangles) {
    const Eigen::Vector3d p = world.mesh.vertices_m[a].cast<double>();
    const Eigen::Vector3d ab = world.mesh.vertices_m[b].cast<double>() - p;
    const Eigen::Vector3d ac = world.mesh.vertices_m[c].cast<double>() - p;
    info.area_m2 += 0.5 * ab.cross(ac).norm();
  }
  return info;
}

void save_mesh(const World& world, const std::filesystem::path& file) {
  const std::string extension = lower_extension(file);
  if (extension == ".stl") {
    write_whole(file, stl_bytes(world.mesh));
  } else if (extension == ".obj") {
    write_whole(file, obj_bytes(world.mesh));
  } else if (extension == ".ply") {
    write_whole(file, ply_bytes(world.mesh));
  } else {
    fail_input(file, "a mesh can be written as .stl, .obj or .ply, not as '" + extension + "'");
  }
}

}  // namespace stairwell::sim3d
