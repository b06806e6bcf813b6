#include "apps/png_writer.hpp"

#include "apps/atomic_file.hpp"
#include "core/errors.hpp"

#include <png.h>

#include <string>

namespace stairwell::apps {

std::string encode_png(const Image& image) {
  const std::size_t wanted = 3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if (image.width <= 0 || image.height <= 0 || image.rgb.size() != wanted) throw RunError("the picture is empty");
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr) == 0)
    throw RunError(std::string("the picture cannot be encoded: ") + header.message);
  bytes.resize(size);
  return bytes;
}

void write_png(const Image& image, const std::filesystem::path& file) {
  write_file_atomically(file, encode_png(image));
}

}  // namespace stairwell::apps
