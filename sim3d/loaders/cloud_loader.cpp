#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"
#include "sim3d/loaders/voxel_faces.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace stairwell::sim3d {

namespace {

struct Field {
  std::string name;
  std::size_t size = 4;
  char type = 'F';
  std::size_t count = 1;
  std::size_t offset = 0;  ///< within a point, bytes
  std::size_t first_word = 0;
};

struct PcdHeader {
  std::vector<Field> fields;
  std::size_t points = 0;
  std::size_t point_bytes = 0;
  std::size_t point_words = 0;
  std::string encoding;
  std::size_t body = 0;
  std::array<std::size_t, 3> xyz{};  ///< indices into fields
};

[[noreturn]] void fail_header(const std::filesystem::path& file, const std::string& what) {
  fail_input(file, "has a damaged PCD header (" + what + "); save it again");
}

void read_header_line(std::string_view line, PcdHeader& header, const std::filesystem::path& file) {
  WordReader words(line);
  const std::string_view keyword = words.word();
  if (keyword == "FIELDS") {
    for (std::string_view word = words.word(); !word.empty(); word = words.word()) {
      header.fields.emplace_back().name = word;
    }
  } else if (keyword == "SIZE" || keyword == "COUNT") {
    for (Field& field : header.fields) {
      const auto number = parse_number<std::size_t>(words.word());
      if (!number || *number > 1'000'000) {
        fail_header(file, std::string(keyword) + " needs one number per field");
      }
      (keyword == "SIZE" ? field.size : field.count) = *number;
    }
  } else if (keyword == "TYPE") {
    for (Field& field : header.fields) {
      const std::string_view word = words.word();
      if (word != "F" && word != "U" && word != "I") {
        fail_header(file, "TYPE needs F, U or I per field");
      }
      field.type = word[0];
    }
  } else if (keyword == "POINTS") {
    const auto number = parse_number<std::size_t>(words.word());
    if (!number) {
      fail_header(file, "POINTS needs a number");
    }
    header.points = *number;
  } else if (keyword == "DATA") {
    header.encoding = words.word();
  } else if (keyword != "VERSION" && keyword != "WIDTH" && keyword != "HEIGHT" && keyword != "VIEWPOINT" &&
             !keyword.empty() && keyword.front() != '#') {
    fail_header(file, "unknown line '" + std::string(keyword.substr(0, 20)) + "'");
  }
}

void place_fields(PcdHeader& header, const std::filesystem::path& file) {
  for (Field& field : header.fields) {
    field.offset = header.point_bytes;
    field.first_word = header.point_words;
    header.point_bytes += field.size * field.count;
    header.point_words += field.count;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    const auto found = std::find_if(header.fields.begin(), header.fields.end(),
                                    [&](const Field& field) { return field.name == name; });
    if (found == header.fields.end() || found->type != 'F' || found->count != 1 ||
        (found->size != 4 && found->size != 8)) {
      fail_input(file, "has no field '" + name + "' of type float or double; only clouds with x y z can be a world");
    }
    header.xyz[axis] = static_cast<std::size_t>(found - header.fields.begin());
  }
}

PcdHeader read_pcd_header(std::string_view bytes, const std::filesystem::path& file) {
  PcdHeader header;
  TextReader reader(bytes);
  while (header.encoding.empty()) {
    const auto line = reader.line();
    if (!line) {
      fail_input(file, "is truncated or not a PCD file: no line 'DATA' in it; save it again");
    }
    read_header_line(*line, header, file);
  }
  header.body = reader.position();
  place_fields(header, file);
  // At least one byte per value, so that a damaged count cannot ask for more memory than the file is long.
  if (header.encoding != "binary_compressed" &&
      header.points > (bytes.size() - header.body) / std::max<std::size_t>(header.point_words, 1)) {
    fail_input(file, "is truncated: its header promises " + std::to_string(header.points) + " points; save it again");
  }
  return header;
}

double read_float(std::string_view bytes, std::size_t offset, std::size_t size) {
  return size == 8 ? read_value<double>(bytes, offset) : static_cast<double>(read_value<float>(bytes, offset));
}

std::vector<Eigen::Vector3d> read_ascii(std::string_view bytes, const PcdHeader& header,
                                        const std::filesystem::path& file) {
  std::vector<Eigen::Vector3d> points_m;
  points_m.reserve(header.points);
  TextReader reader(bytes, header.body);
  for (std::size_t i = 0; i < header.points; ++i) {
    Eigen::Vector3d point_m;
    for (std::size_t word_index = 0; word_index < header.point_words; ++word_index) {
      const std::string_view word = reader.word();
      if (word.empty()) {
        fail_input(file, "is truncated: its header promises " + std::to_string(header.points) + " points, it holds " +
                             std::to_string(i) + "; save it again");
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (header.fields[header.xyz[axis]].first_word != word_index) {
          continue;
        }
        const auto value = parse_number<double>(word);
        if (!value) {
          fail_input(file, "point " + std::to_string(i) + ": '" + std::string(word.substr(0, 20)) + "' is no number");
        }
        point_m[static_cast<Eigen::Index>(axis)] = *value;
      }
    }
    points_m.push_back(point_m);
  }
  return points_m;
}

std::vector<Eigen::Vector3d> read_binary(std::string_view bytes, const PcdHeader& header,
                                         const std::filesystem::path& file) {
  if (header.points > (bytes.size() - header.body) / header.point_bytes) {
    fail_input(file, "is truncated: " + std::to_string(header.points) + " points of " +
                         std::to_string(header.point_bytes) + " bytes do not fit into it; save it again");
  }
  std::vector<Eigen::Vector3d> points_m(header.points);
  for (std::size_t i = 0; i < header.points; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Field& field = header.fields[header.xyz[axis]];
      points_m[i][static_cast<Eigen::Index>(axis)] =
          read_float(bytes, header.body + i * header.point_bytes + field.offset, field.size);
    }
  }
  return points_m;
}

/// LZF (Lehmann's format, as in PCD files); false when the bytes are damaged or do not give exactly `size` bytes.
bool unpack_lzf(std::string_view packed, std::size_t size, std::string& out) {
  out.clear();
  out.reserve(size);
  std::size_t i = 0;
  while (i < packed.size()) {
    const auto control = static_cast<unsigned char>(packed[i++]);
    if (control < 32) {  // that many bytes plus one as they are
      const std::size_t count = std::size_t{control} + 1;
      if (packed.size() - i < count || size - out.size() < count) {
        return false;
      }
      out.append(packed.substr(i, count));
      i += count;
      continue;
    }
    std::size_t count = control >> 5;
    if (count == 7) {
      if (i == packed.size()) {
        return false;
      }
      count += static_cast<unsigned char>(packed[i++]);
    }
    count += 2;
    if (i == packed.size()) {
      return false;
    }
    const std::size_t back = (std::size_t{control} & 31U) << 8 | static_cast<unsigned char>(packed[i++]);
    if (back + 1 > out.size() || size - out.size() < count) {
      return false;
    }
    for (std::size_t from = out.size() - back - 1; count > 0; --count, ++from) {
      out.push_back(out[from]);
    }
  }
  return out.size() == size;
}

std::vector<Eigen::Vector3d> read_compressed(std::string_view bytes, const PcdHeader& header,
                                             const std::filesystem::path& file) {
  const std::size_t rest = bytes.size() - header.body;
  constexpr const char* kDamaged = "is truncated or damaged: its compressed points cannot be unpacked; save it again";
  if (rest < 8) {
    fail_input(file, kDamaged);
  }
  const std::size_t packed_size = read_value<std::uint32_t>(bytes, header.body);
  const std::size_t size = read_value<std::uint32_t>(bytes, header.body + 4);
  std::string points;
  if (packed_size > rest - 8 || header.points > size / header.point_bytes ||
      size != header.points * header.point_bytes || size / 264 > packed_size ||
      !unpack_lzf(bytes.substr(header.body + 8, packed_size), size, points)) {
    fail_input(file, kDamaged);
  }
  // All values of one field lie together.
  std::vector<Eigen::Vector3d> points_m(header.points);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Field& field = header.fields[header.xyz[axis]];
    for (std::size_t i = 0; i < header.points; ++i) {
      points_m[i][static_cast<Eigen::Index>(axis)] =
          read_float(points, field.offset * header.points + i * field.size, field.size);
    }
  }
  return points_m;
}

}  // namespace

std::vector<Eigen::Vector3d> load_pcd(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  const PcdHeader header = read_pcd_header(bytes, file);
  if (header.encoding == "ascii") {
    return read_ascii(bytes, header, file);
  }
  if (header.encoding == "binary") {
    return read_binary(bytes, header, file);
  }
  if (header.encoding == "binary_compressed") {
    return read_compressed(bytes, header, file);
  }
  fail_header(file, "DATA is none of ascii, binary, binary_compressed");
}

TriangleMesh mesh_of_points(const std::vector<Eigen::Vector3d>& points_m, const WorldOptions& options,
                            const std::filesystem::path& file) {
  const double point_size_m = options.point_size_m;
  SolidVoxels solid;
  solid.reserve(points_m.size());
  const double per_m = 1.0 / point_size_m;  // as OctoMap computes it, so that both put a point into the same voxel
  for (const Eigen::Vector3d& point_m : points_m) {
    if (!point_m.allFinite()) {
      continue;
    }
    const Eigen::Vector3d cell = (point_m * per_m).array().floor();
    if (!(cell.cwiseAbs().maxCoeff() < static_cast<double>(SolidVoxels::kMaxCell))) {
      std::ostringstream where;
      where << point_m.transpose();
      fail_input(file, "has a point at (" + where.str() + ") m, too far out for points of " +
                           std::to_string(point_size_m) + " m; crop it, or use a larger point size");
    }
    solid.add(static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
              static_cast<std::int64_t>(cell.z()));
  }
  if (solid.added() == 0) {
    fail_input(file, "holds no usable point (none at all, or all NaN); nothing to explore");
  }
  if (options.close_gaps) solid.close_gaps();
  return solid.exposed_faces(Eigen::Vector3d::Constant(point_size_m));
}

}  // namespace stairwell::sim3d
