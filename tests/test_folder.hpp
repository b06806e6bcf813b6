#pragma once

#include <filesystem>

namespace stairwell::testing {

/// A folder of this process alone, made when first asked for: cases run side by side, each in its own process.
/// Taken away at the end, unless a case failed.
const std::filesystem::path& test_folder();

}  // namespace stairwell::testing
