#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"
#include "sim3d/loaders/polygon.hpp"

#include <algorithm>
#include <bit>

namespace stairwell::sim3d {

namespace {

enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct Property {
  std::string name;
  Scalar type = Scalar::kFloat;
  bool list = false;
  Scalar count_type = Scalar::kUint8;
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { kAscii, kLittle, kBig };

struct Header {
  Encoding encoding = Encoding::kAscii;
  std::vector<Element> elements;
  std::size_t body = 0;
};

std::optional<Scalar> scalar_of(std::string_view name) {
  struct Entry {
    std::string_view short_name, long_name;
    Scalar type;
  };
  static constexpr std::array<Entry, 8> kNames{{{"char", "int8", Scalar::kInt8},
                                                {"uchar", "uint8", Scalar::kUint8},
                                                {"short", "int16", Scalar::kInt16},
                                                {"ushort", "uint16", Scalar::kUint16},
                                                {"int", "int32", Scalar::kInt32},
                                                {"uint", "uint32", Scalar::kUint32},
                                                {"float", "float32", Scalar::kFloat},
                                                {"double", "float64", Scalar::kDouble}}};
  for (const Entry& entry : kNames) {
    if (name == entry.short_name || name == entry.long_name) {
      return entry.type;
    }
  }
  return std::nullopt;
}

std::size_t size_of(Scalar type) {
  static constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

Property read_property(WordReader& words, const std::filesystem::path& file, std::size_t line) {
  Property property;
  std::string_view type = words.word();
  property.list = type == "list";
  std::optional<Scalar> count_type = Scalar::kUint8;
  if (property.list) {
    count_type = scalar_of(words.word());
    type = words.word();
  }
  const auto scalar = scalar_of(type);
  property.name = words.word();
  if (!scalar || !count_type || property.name.empty()) {
    fail_input(file, "line " + std::to_string(line) + ": a PLY property this reader does not know");
  }
  property.type = *scalar;
  property.count_type = *count_type;
  return property;
}

Header read_header(std::string_view bytes, const std::filesystem::path& file) {
  Header header;
  TextReader reader(bytes);
  if (reader.line() != "ply") {
    fail_input(file, "is not a PLY file: it does not begin with 'ply'");
  }
  bool has_format = false;
  while (const auto line = reader.line()) {
    WordReader words(*line);
    const std::string_view keyword = words.word();
    if (keyword == "format") {
      const std::string_view format = words.word();
      has_format = format == "ascii" || format == "binary_little_endian" || format == "binary_big_endian";
      header.encoding = format == "ascii"                  ? Encoding::kAscii
                        : format == "binary_little_endian" ? Encoding::kLittle
                                                           : Encoding::kBig;
    } else if (keyword == "element") {
      Element& element = header.elements.emplace_back();
      element.name = words.word();
      const auto count = parse_number<std::size_t>(words.word());
      if (!count) {
        fail_input(file, "line " + std::to_string(reader.line_number()) + ": 'element' needs a name and a count");
      }
      element.count = *count;
    } else if (keyword == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(read_property(words, file, reader.line_number()));
    } else if (keyword == "end_header" && has_format) {
      header.body = reader.position();
      return header;
    } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      break;
    }
  }
  fail_input(file, "has a damaged PLY header (line " + std::to_string(reader.line_number()) + "); export it again");
}

/// Numbers of the body, one after the other; every read is checked against the end.
class BodyReader {
 public:
  BodyReader(std::string_view bytes, const Header& header, const std::filesystem::path& file)
      : bytes_(bytes), file_(file), encoding_(header.encoding), position_(header.body), text_(bytes, header.body) {}

  /// Whether `count` numbers of at least one byte each can still follow.
  bool can_hold(std::size_t count) const {
    return count <= bytes_.size() - (encoding_ == Encoding::kAscii ? text_.position() : position_);
  }

  double number(Scalar type) {
    if (encoding_ == Encoding::kAscii) {
      const auto value = parse_number<double>(text_.word());
      return value ? *value : truncated();
    }
    const std::size_t size = size_of(type);
    if (bytes_.size() - position_ < size) {
      return truncated();
    }
    std::array<char, 8> raw{};
    std::copy_n(bytes_.data() + position_, size, raw.begin());
    position_ += size;
    if (encoding_ == Encoding::kBig) {
      std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(size));
    }
    return decode({raw.data(), raw.size()}, type);
  }

  [[noreturn]] double truncated() const {
    fail_input(file_, "is truncated or damaged: its header promises more numbers than it holds; export it again");
  }

 private:
  static double decode(std::string_view raw, Scalar type) {
    switch (type) {
      case Scalar::kInt8:
        return read_value<std::int8_t>(raw, 0);
      case Scalar::kUint8:
        return read_value<std::uint8_t>(raw, 0);
      case Scalar::kInt16:
        return read_value<std::int16_t>(raw, 0);
      case Scalar::kUint16:
        return read_value<std::uint16_t>(raw, 0);
      case Scalar::kInt32:
        return read_value<std::int32_t>(raw, 0);
      case Scalar::kUint32:
        return read_value<std::uint32_t>(raw, 0);
      case Scalar::kFloat:
        return static_cast<double>(read_value<float>(raw, 0));
      case Scalar::kDouble:
        break;
    }
    return read_value<double>(raw, 0);
  }

  std::string_view bytes_;
  const std::filesystem::path& file_;
  Encoding encoding_;
  std::size_t position_;
  TextReader text_;
};

std::vector<double> read_list(BodyReader& body, const Property& property) {
  const double count = body.number(property.count_type);
  if (!(count >= 0.0) || !(count < 1e9) || !body.can_hold(static_cast<std::size_t>(count))) {
    body.truncated();
  }
  std::vector<double> values(static_cast<std::size_t>(count));
  for (double& value : values) {
    value = body.number(property.type);
  }
  return values;
}

void read_vertices(BodyReader& body, const Element& element, TriangleMesh& mesh) {
  for (std::size_t i = 0; i < element.count; ++i) {
    Eigen::Vector3f vertex = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
    for (const Property& property : element.properties) {
      if (property.list) {
        read_list(body, property);
        continue;
      }
      const double value = body.number(property.type);
      if (property.name == "x" || property.name == "y" || property.name == "z") {
        vertex[property.name[0] - 'x'] = static_cast<float>(value);
      }
    }
    mesh.vertices_m.push_back(vertex);
  }
}

void read_faces(BodyReader& body, const Element& element, const std::filesystem::path& file, TriangleMesh& mesh) {
  std::vector<std::uint32_t> corners;
  for (std::size_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      if (!property.list) {
        body.number(property.type);
        continue;
      }
      const std::vector<double> values = read_list(body, property);
      if (property.name != "vertex_indices" && property.name != "vertex_index") {
        continue;
      }
      corners.clear();
      for (const double value : values) {
        if (!(value >= 0.0) || !(value < static_cast<double>(mesh.vertices_m.size()))) {
          fail_input(file, "face " + std::to_string(i) + " names a vertex that does not exist; export it again");
        }
        corners.push_back(static_cast<std::uint32_t>(value));
      }
      triangulate(corners, mesh.vertices_m, mesh.triangles);
    }
  }
}

void skip_element(BodyReader& body, const Element& element) {
  for (std::size_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      if (property.list) {
        read_list(body, property);
      } else {
        body.number(property.type);
      }
    }
  }
}

}  // namespace

TriangleMesh load_ply(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  const Header header = read_header(bytes, file);
  BodyReader body(bytes, header, file);
  TriangleMesh mesh;
  for (const Element& element : header.elements) {
    if (!element.properties.empty() && !body.can_hold(element.count)) {
      body.truncated();
    }
    if (element.properties.empty()) {
      continue;
    }
    if (element.name == "vertex") {
      read_vertices(body, element, mesh);
    } else if (element.name == "face") {
      read_faces(body, element, file, mesh);
    } else {
      skip_element(body, element);
    }
  }
  return mesh;
}

}  // namespace stairwell::sim3d
