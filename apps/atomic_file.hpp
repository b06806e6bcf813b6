#pragma once

#include <filesystem>
#include <string_view>

namespace stairwell::apps {

/// Writes the whole file to a temporary name beside the target, flushes it to the disk and renames it: a reader sees
/// the old file or the new one, never a part. @throws RunError naming the file; the temporary file is removed.
void write_file_atomically(const std::filesystem::path& file, std::string_view bytes);

}  // namespace stairwell::apps
