#pragma once

#include <filesystem>

namespace stairwell::apps {

/// Where the learned agents' weights are: `models` beside the program or in a folder above it (the source tree of a
/// build), else `share/stairwell/models` of the installation.
std::filesystem::path models_dir();

}  // namespace stairwell::apps
