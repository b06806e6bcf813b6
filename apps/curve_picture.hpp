#pragma once

#include "apps/csv_table.hpp"

#include <filesystem>
#include <string_view>

namespace stairwell::apps {

/// A training's curves as a PNG: one panel under the other for every column but the first, `step` (along x) and
/// `wall_s`. Gaps where values are missing. @throws RunError naming the file when it cannot be written; InputError for
/// a column that is not numbers
void write_curve_picture(const CsvTable& curves, std::string_view title, const std::filesystem::path& file);

}  // namespace stairwell::apps
