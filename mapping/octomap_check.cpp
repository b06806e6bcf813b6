#include "mapping/octomap_check.hpp"

#include "core/errors.hpp"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace stairwell::mapping {

namespace {

constexpr std::size_t kTreeDepth = 16;
constexpr std::string_view kFullMagic = "# Octomap OcTree file";
constexpr std::string_view kBinaryMagic = "# Octomap OcTree binary file";

std::string_view without_trailing_space(std::string_view text) {
  while (!text.empty() && (text.back() == '\r' || text.back() == ' ' || text.back() == '\t')) {
    text.remove_suffix(1);
  }
  return text;
}

template <typename Number>
Number parse_number(std::string_view text, const std::string& name, std::string_view what) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw InputError(name + ": OctoMap header: bad " + std::string(what));
  }
  return value;
}

/// Takes the next line off `rest`.
std::string_view next_line(std::string_view& rest, const std::string& name) {
  const std::size_t end = rest.find('\n');
  if (end == std::string_view::npos) {
    throw InputError(name + ": OctoMap header is cut off");
  }
  const std::string_view line = without_trailing_space(rest.substr(0, end));
  rest.remove_prefix(end + 1);
  return line;
}

OctomapHeader read_header(std::string_view content, const std::string& name) {
  if (content.empty()) {
    throw InputError(name + ": file is empty");
  }
  OctomapHeader header;
  std::string_view rest = content;
  if (content.starts_with(kBinaryMagic)) {
    header.format = OctomapFormat::kBinary;
  } else if (!content.starts_with(kFullMagic)) {
    throw InputError(name + ": not an OctoMap file (.bt or .ot)");
  }
  bool has_id = false, has_size = false;
  for (;;) {
    const std::string_view line = next_line(rest, name);
    const std::size_t space = line.find(' ');
    const std::string_view key = line.substr(0, space);
    const std::string_view value = space == std::string_view::npos ? std::string_view{} : line.substr(space + 1);
    if (key == "data") {
      break;
    }
    if (key == "id") {
      if (value != "OcTree") {
        throw InputError(name + ": holds a tree of type '" + std::string(value.substr(0, 40)) +
                         "'; only OcTree can be read");
      }
      has_id = true;
    } else if (key == "size") {
      header.nodes = parse_number<std::size_t>(value, name, "size");
      has_size = true;
    } else if (key == "res") {
      header.resolution_m = parse_number<double>(value, name, "res");
    }  // comments and unknown lines are skipped, as OctoMap does
  }
  if (!has_id || !has_size || !(header.resolution_m > 0.0) || !std::isfinite(header.resolution_m)) {
    throw InputError(name + ": OctoMap header needs id, size and a positive res");
  }
  header.body = content.size() - rest.size();
  return header;
}

/// Children of the node at `at` that are stored as nodes of their own, one bit each; `leaves` counts children that
/// are not. Moves `at` behind the node.
struct NodeShape {
  unsigned inner = 0;
  std::size_t leaves = 0;
};

NodeShape full_node(std::string_view body, std::size_t& at, const std::string& name) {
  float log_odds = 0.0F;
  if (body.size() - at < sizeof(log_odds) + 1) {
    throw InputError(name + ": OctoMap file is truncated");
  }
  std::memcpy(&log_odds, body.data() + at, sizeof(log_odds));
  if (!std::isfinite(log_odds)) {
    throw InputError(name + ": OctoMap file holds an occupancy that is not a number");
  }
  at += sizeof(log_odds);
  return {static_cast<std::uint8_t>(body[at++]), 0};
}

NodeShape binary_node(std::string_view body, std::size_t& at, const std::string& name) {
  if (body.size() - at < 2) {
    throw InputError(name + ": OctoMap file is truncated");
  }
  const unsigned bits =
      static_cast<std::uint8_t>(body[at]) | static_cast<unsigned>(static_cast<std::uint8_t>(body[at + 1])) << 8;
  at += 2;
  NodeShape shape;
  for (unsigned child = 0; child < 8; ++child) {
    const unsigned code = (bits >> (2 * child)) & 3U;  // 0 unknown, 1 free, 2 occupied, 3 has children
    if (code == 3U) {
      shape.inner |= 1U << child;
    } else if (code != 0U) {
      ++shape.leaves;
    }
  }
  if (bits == 0) {
    throw InputError(name + ": damaged OctoMap file (a branch without leaves)");
  }
  return shape;
}

/// Nodes in the body, which has to end with the last of them.
std::size_t count_nodes(std::string_view body, OctomapFormat format, std::size_t limit, const std::string& name) {
  const bool binary = format == OctomapFormat::kBinary;
  std::array<unsigned, kTreeDepth + 1> waiting{};  // nodes still to come, by depth
  waiting[0] = 1;
  std::size_t depth = 0;
  std::size_t at = 0;
  std::size_t nodes = 0;
  for (;;) {
    while (waiting[depth] == 0) {
      if (depth == 0) {
        if (at != body.size()) {
          throw InputError(name + ": damaged OctoMap file (bytes left over after the last node)");
        }
        return nodes;
      }
      --depth;
    }
    --waiting[depth];
    const NodeShape shape = binary ? binary_node(body, at, name) : full_node(body, at, name);
    nodes += 1 + shape.leaves;
    if (nodes > limit) {
      throw InputError(name + ": damaged OctoMap file (more nodes than its header says)");
    }
    const bool has_children = shape.inner != 0 || shape.leaves != 0;
    if (has_children && depth == kTreeDepth) {
      throw InputError(name + ": damaged OctoMap file (deeper than 16 levels)");
    }
    if (shape.inner != 0) {
      waiting[++depth] = static_cast<unsigned>(std::popcount(shape.inner));
    }
  }
}

}  // namespace

OctomapHeader checked_octomap_header(std::string_view content, const std::string& name) {
  const OctomapHeader header = read_header(content, name);
  const std::string_view body = content.substr(header.body);
  if (header.nodes == 0) {
    if (!body.empty()) {
      throw InputError(name + ": damaged OctoMap file (size 0, but nodes follow)");
    }
    return header;
  }
  if (count_nodes(body, header.format, header.nodes, name) != header.nodes) {
    throw InputError(name + ": damaged OctoMap file (fewer nodes than its header says)");
  }
  return header;
}

}  // namespace stairwell::mapping
