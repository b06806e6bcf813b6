#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"
#include "sim3d/loaders/voxel_faces.hpp"

#include <cmath>
#include <vector>

namespace stairwell::sim3d {

namespace {

constexpr int kDepth = 16;
constexpr std::int64_t kHalf = 1 << (kDepth - 1);

struct Header {
  std::string id;
  std::size_t size = 0;
  double resolution_m = 0.0;
  std::size_t body = 0;
};

Header read_header(std::string_view bytes, const std::filesystem::path& file, std::string_view first_line) {
  TextReader reader(bytes);
  const auto first = reader.line();
  if (!first || !first->starts_with(first_line)) {
    fail_input(file, "is not an OctoMap file: it does not begin with '" + std::string(first_line) + "'");
  }
  Header header;
  while (const auto line = reader.line()) {
    WordReader words(*line);
    const std::string_view keyword = words.word();
    if (keyword == "data") {
      header.body = reader.position();
      break;
    }
    if (keyword == "id") {
      header.id = words.word();
    } else if (keyword == "size") {
      header.size = parse_number<std::size_t>(words.word()).value_or(0);
    } else if (keyword == "res") {
      header.resolution_m = parse_number<double>(words.word()).value_or(0.0);
    }
  }
  if (header.body == 0) {
    fail_input(file, "has a truncated OctoMap header: no line 'data'; save it again");
  }
  if (!(header.resolution_m > 0.0) || !std::isfinite(header.resolution_m)) {
    fail_input(file, "has a damaged OctoMap header: 'res' is not a positive number");
  }
  return header;
}

/// Walks the node stream by itself: the library's reader follows damaged bytes into endless recursion.
class TreeReader {
 public:
  TreeReader(std::string_view bytes, const Header& header, const std::filesystem::path& file)
      : bytes_(bytes), file_(file), position_(header.body) {}

  std::size_t nodes = 0;

  /// .bt: two bytes per inner node, two bits per child (1 free, 2 occupied, 3 inner; low bit first).
  void read_binary_node(int depth, std::int64_t x, std::int64_t y, std::int64_t z) {
    require(2, depth);
    const auto children = read_value<std::uint16_t>(bytes_, position_);
    position_ += 2;
    ++nodes;
    for (int i = 0; i < 8; ++i) {
      const unsigned kind = children >> (2 * i) & 3U;
      if (kind == 2) {
        add_leaf(depth + 1, child_x(x, depth, i), child_y(y, depth, i), child_z(z, depth, i));
      }
      nodes += kind == 1 || kind == 2 ? 1 : 0;
    }
    for (int i = 0; i < 8; ++i) {
      if ((children >> (2 * i) & 3U) == 3U) {
        read_binary_node(depth + 1, child_x(x, depth, i), child_y(y, depth, i), child_z(z, depth, i));
      }
    }
  }

  /// .ot: the node's log-odds (and colour), then one byte with a bit per child, then the children.
  void read_full_node(std::size_t extra_bytes, int depth, std::int64_t x, std::int64_t y, std::int64_t z) {
    require(sizeof(float) + extra_bytes + 1, depth - 1);
    const auto log_odds = read_value<float>(bytes_, position_);
    position_ += sizeof(float) + extra_bytes;
    const auto children = read_value<std::uint8_t>(bytes_, position_);
    ++position_;
    ++nodes;
    if (children == 0) {
      if (log_odds >= 0.0F) {  // occupied: probability of at least one half
        add_leaf(depth, x, y, z);
      }
      return;
    }
    require(0, depth);
    for (int i = 0; i < 8; ++i) {
      if ((children >> i & 1) != 0) {
        read_full_node(extra_bytes, depth + 1, child_x(x, depth, i), child_y(y, depth, i), child_z(z, depth, i));
      }
    }
  }

  bool finished() const { return position_ == bytes_.size(); }

  SolidVoxels solid() const {
    SolidVoxels found;
    found.reserve(static_cast<std::size_t>(cells_));
    for (const auto& [x, y, z, edge] : leaves_) {
      for (std::int64_t dz = 0; dz < edge; ++dz) {
        for (std::int64_t dy = 0; dy < edge; ++dy) {
          for (std::int64_t dx = 0; dx < edge; ++dx) {
            found.add(x + dx, y + dy, z + dz);
          }
        }
      }
    }
    return found;
  }

 private:
  static std::int64_t half(int depth) { return std::int64_t{1} << (kDepth - 1 - depth); }
  static std::int64_t child_x(std::int64_t x, int depth, int i) { return x + ((i & 1) != 0 ? half(depth) : 0); }
  static std::int64_t child_y(std::int64_t y, int depth, int i) { return y + ((i & 2) != 0 ? half(depth) : 0); }
  static std::int64_t child_z(std::int64_t z, int depth, int i) { return z + ((i & 4) != 0 ? half(depth) : 0); }

  void require(std::size_t count, int depth) const {
    if (bytes_.size() - position_ < count || depth >= kDepth) {
      fail_input(file_, "is truncated or damaged: its tree of voxels does not end where the file does; save it again");
    }
  }

  void add_leaf(int depth, std::int64_t x, std::int64_t y, std::int64_t z) {
    const std::int64_t edge = std::int64_t{1} << (kDepth - depth);
    cells_ += edge * edge * edge;
    if (cells_ > static_cast<std::int64_t>(SolidVoxels::kMaxCount)) {
      fail_input(file_, "has more than " + std::to_string(SolidVoxels::kMaxCount) +
                            " occupied voxels, or is damaged; save it with a coarser resolution");
    }
    leaves_.push_back({x, y, z, edge});
  }

  struct Leaf {
    std::int64_t x, y, z, edge;
  };

  std::string_view bytes_;
  const std::filesystem::path& file_;
  std::size_t position_;
  std::int64_t cells_ = 0;
  std::vector<Leaf> leaves_;  ///< occupied; a damaged file must not cost the memory of its cells
};

void check_end(const TreeReader& reader, const Header& header, const std::filesystem::path& file) {
  if (reader.nodes != header.size) {
    fail_input(file, "is damaged: its header promises " + std::to_string(header.size) + " nodes, its data hold " +
                         std::to_string(reader.nodes) + "; save it again");
  }
  if (!reader.finished()) {
    fail_input(file, "is damaged: bytes are left over after the last node; save it again");
  }
}

}  // namespace

TriangleMesh load_octomap(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  const bool binary = lower_extension(file) == ".bt";
  const Header header = read_header(bytes, file, binary ? "# Octomap OcTree binary file" : "# Octomap OcTree file");
  const bool colour = !binary && header.id == "ColorOcTree";
  if (header.id != "OcTree" && !colour) {
    fail_input(file, "holds a tree of type '" + header.id.substr(0, 40) + "'; known are OcTree and ColorOcTree (.ot)");
  }
  if (header.size == 0) {
    fail_input(file, "holds an empty map; nothing to explore");
  }
  TreeReader reader(bytes, header, file);
  if (binary) {
    reader.read_binary_node(0, -kHalf, -kHalf, -kHalf);
  } else {
    reader.read_full_node(colour ? 3 : 0, 0, -kHalf, -kHalf, -kHalf);
  }
  check_end(reader, header, file);
  return reader.solid().exposed_faces(Eigen::Vector3d::Constant(header.resolution_m));
}

}  // namespace stairwell::sim3d
