/// OctoMap's readers trust their stream: they follow any node byte and take any size. Files are checked here, as
/// bytes, before OctoMap sees them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace stairwell::mapping {

enum class OctomapFormat { kBinary, kFull };  ///< .bt and .ot

struct OctomapHeader {
  OctomapFormat format = OctomapFormat::kFull;
  double resolution_m = 0.0;
  std::size_t nodes = 0;
  std::size_t body = 0;  ///< offset of the first node
};

/// The header of an OcTree file whose nodes are known to be well formed, no deeper than 16 levels, as many as the
/// header says, and to end where the file ends.
/// @param name begins every message. @throws InputError
OctomapHeader checked_octomap_header(std::string_view content, const std::string& name);

}  // namespace stairwell::mapping
