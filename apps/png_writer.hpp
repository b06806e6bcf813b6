#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace stairwell::apps {

/// 8-bit sRGB picture, rows from the top, three bytes per pixel.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;

  std::uint8_t* pixel(int x, int y) {
    return rgb.data() +
           3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  }
  const std::uint8_t* pixel(int x, int y) const { return const_cast<Image*>(this)->pixel(x, y); }
};

/// The bytes of a PNG file. @throws RunError when the picture is empty or too large.
std::string encode_png(const Image& image);

/// @throws RunError naming the file when it cannot be written, and for an empty picture.
void write_png(const Image& image, const std::filesystem::path& file);

}  // namespace stairwell::apps
