#include "core/errors.hpp"
#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"
#include "sim3d/loaders/voxel_faces.hpp"

#include <png.h>
#include <yaml-cpp/yaml.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cctype>
#include <cmath>

namespace stairwell::sim3d {

namespace {

constexpr std::size_t kLargestSide = 100'000;

/// Grey values scaled to 0..1, first row on top; transparent pixels are NaN (unknown).
struct GreyImage {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<float> values;
};

/// What ROS map_server reads from the .yaml file.
struct MapInfo {
  std::filesystem::path image;
  double resolution_m = 0.0;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< x m, y m, yaw rad of the lower left corner
  bool negate = false;
  double occupied_thresh = 0.65;
};

MapInfo parse_info(const YAML::Node& root, const std::filesystem::path& file) {
  if (!root.IsMap() || !root["image"] || !root["resolution"]) {
    fail_input(file, "is not a ROS map_server file: it needs 'image' and 'resolution'");
  }
  MapInfo info;
  info.image = root["image"].as<std::string>();
  info.resolution_m = root["resolution"].as<double>();
  if (const YAML::Node origin = root["origin"]) {
    for (std::size_t i = 0; i < 3 && i < origin.size(); ++i) {
      info.origin[static_cast<Eigen::Index>(i)] = origin[i].as<double>();
    }
  }
  if (const YAML::Node negate = root["negate"]) {
    const auto text = negate.as<std::string>();
    info.negate = text == "1" || text == "true";
  }
  if (const YAML::Node threshold = root["occupied_thresh"]) {
    info.occupied_thresh = threshold.as<double>();
  }
  if (const YAML::Node mode = root["mode"]; mode && mode.as<std::string>() == "raw") {
    fail_input(file, "uses 'mode: raw', which is not supported; use trinary or scale");
  }
  return info;
}

MapInfo read_info(const std::filesystem::path& file) {
  const std::string text = read_bytes(file);
  MapInfo info;
  try {
    info = parse_info(YAML::Load(text), file);
  } catch (const YAML::Exception& error) {
    fail_input(file, "is not a usable ROS map_server file (" + std::string(error.what()) + ")");
  }
  if (!(info.resolution_m > 0.0) || !std::isfinite(info.resolution_m)) {
    fail_input(file, "'resolution' must be a positive number of metres");
  }
  if (!info.origin.allFinite()) {
    fail_input(file, "'origin' must hold finite numbers [x, y, yaw]");
  }
  if (!(info.occupied_thresh >= 0.0 && info.occupied_thresh <= 1.0)) {
    fail_input(file, "'occupied_thresh' must lie between 0 and 1");
  }
  if (info.image.is_relative()) {
    info.image = file.parent_path() / info.image;
  }
  std::error_code error;
  if (!std::filesystem::exists(info.image, error)) {
    fail_input(file, "names the image '" + info.image.string() + "', which is not there; mend 'image'");
  }
  return info;
}

/// Numbers of a PGM header: white space and comments between them.
std::size_t header_number(std::string_view bytes, std::size_t& position, const std::filesystem::path& file) {
  const auto is_space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  while (position < bytes.size() && (is_space(bytes[position]) || bytes[position] == '#')) {
    position = bytes[position] == '#' ? std::min(bytes.find('\n', position), bytes.size()) : position + 1;
  }
  const std::size_t begin = position;
  while (position < bytes.size() && bytes[position] >= '0' && bytes[position] <= '9') {
    ++position;
  }
  const auto number = parse_number<std::size_t>(bytes.substr(begin, position - begin));
  if (!number) {
    fail_input(file, "is truncated or damaged: a number is missing; export it again");
  }
  return *number;
}

[[noreturn]] void fail_short(const std::filesystem::path& file, std::size_t width, std::size_t height) {
  fail_input(file, "is truncated: " + std::to_string(width) + " x " + std::to_string(height) +
                       " pixels do not fit into it; export it again");
}

GreyImage read_pgm(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  if (!bytes.starts_with("P5") && !bytes.starts_with("P2")) {
    fail_input(file, "is not a PGM image (P5 or P2); export it as one");
  }
  const bool binary = bytes[1] == '5';
  std::size_t position = 2;
  GreyImage image;
  image.width = header_number(bytes, position, file);
  image.height = header_number(bytes, position, file);
  const std::size_t white = header_number(bytes, position, file);
  if (image.width == 0 || image.height == 0 || image.width > kLargestSide || image.height > kLargestSide ||
      white == 0 || white > 65535) {
    fail_input(file, "has a damaged PGM header (width, height or largest grey value); export it again");
  }
  const std::size_t count = image.width * image.height;
  const std::size_t value_bytes = binary && white > 255 ? 2 : 1;
  position += binary ? 1 : 0;
  if (position > bytes.size() || bytes.size() - position < count * value_bytes) {
    fail_short(file, image.width, image.height);
  }
  image.values.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t value = 0;
    if (binary) {
      for (std::size_t k = 0; k < value_bytes; ++k) {
        value = value << 8 | static_cast<unsigned char>(bytes[position++]);
      }
    } else {
      value = header_number(bytes, position, file);
    }
    image.values.push_back(static_cast<float>(value) / static_cast<float>(white));
  }
  return image;
}

GreyImage read_png(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) {
    fail_input(file, "cannot be read as PNG (" + std::string(png.message) + "); export it again");
  }
  GreyImage image;
  image.width = png.width;
  image.height = png.height;
  // A pixel takes at least 1/8 byte before compression of at most about 1:1032.
  if (image.width > kLargestSide || image.height > kLargestSide ||
      image.width * image.height / 8 / 1100 > bytes.size()) {
    png_image_free(&png);
    fail_input(file, "is damaged: its size in pixels does not fit its length; export it again");
  }
  png.format = PNG_FORMAT_GA;
  std::vector<png_byte> raw(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, raw.data(), 0, nullptr) == 0) {
    const std::string message = png.message;
    png_image_free(&png);
    fail_input(file, "is truncated or damaged (" + message + "); export it again");
  }
  image.values.reserve(image.width * image.height);
  for (std::size_t i = 0; i + 1 < raw.size(); i += 2) {
    image.values.push_back(raw[i + 1] == 0 ? std::numeric_limits<float>::quiet_NaN()
                                           : static_cast<float>(raw[i]) / 255.0F);
  }
  return image;
}

GreyImage read_any_image(const std::filesystem::path& file) {
  const std::string extension = lower_extension(file);
  if (extension == ".png") {
    return read_png(file);
  }
  if (extension != ".pgm") {
    require_file(file);
    fail_input(file, "is an image of an unknown kind; known are .pgm and .png");
  }
  return read_pgm(file);
}

GreyImage read_image(const MapInfo& info, const std::filesystem::path& file) {
  try {
    return read_any_image(info.image);
  } catch (const InputError& error) {
    fail_input(file, "names the image " + std::string(error.what()));
  }
}

}  // namespace

TriangleMesh load_image_map(const std::filesystem::path& file, double extrude_height_m) {
  const MapInfo info = read_info(file);
  const GreyImage image = read_image(info, file);
  SolidVoxels solid;
  for (std::size_t row = 0; row < image.height; ++row) {
    const std::size_t y = image.height - 1 - row;  // the first row is the largest y
    for (std::size_t x = 0; x < image.width; ++x) {
      const double grey = static_cast<double>(image.values[row * image.width + x]);
      if ((info.negate ? grey : 1.0 - grey) > info.occupied_thresh) {  // never for NaN
        solid.add(static_cast<std::int64_t>(x), static_cast<std::int64_t>(y), 0);
      }
    }
  }
  if (solid.added() == 0) {
    fail_input(info.image, "has no occupied cell; check 'occupied_thresh' and 'negate' in " + file.string());
  }
  TriangleMesh mesh = solid.exposed_faces({info.resolution_m, info.resolution_m, extrude_height_m});
  const Eigen::Matrix3d R_world_map = Eigen::AngleAxisd(info.origin.z(), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d offset_m(info.origin.x(), info.origin.y(), 0.0);
  if (info.origin.any()) {
    for (Eigen::Vector3f& vertex : mesh.vertices_m) {
      vertex = (R_world_map * vertex.cast<double>() + offset_m).cast<float>();
    }
  }
  return mesh;
}

}  // namespace stairwell::sim3d
