#include "sim3d/loaders/input_file.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <system_error>

namespace stairwell::sim3d {

namespace {
bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f' || c == '\v'; }

bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0x80 ? 1 : lead >> 5 == 6 ? 2 : lead >> 4 == 14 ? 3 : lead >> 3 == 30 ? 4 : 0;
    if (length == 0 || text.size() - i < length) {
      return false;
    }
    for (std::size_t k = 1; k < length; ++k) {
      if (static_cast<unsigned char>(text[i + k]) >> 6 != 2) {
        return false;
      }
    }
    i += length;
  }
  return true;
}
}  // namespace

void fail_input(const std::filesystem::path& file, const std::string& what) {
  std::string message = file.string() + ": " + what;
  const bool readable = is_utf8(message);  // quoted words of a damaged file often are not
  for (char& c : message) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f || (!readable && byte >= 0x80)) {
      c = byte >= 0x80 ? '?' : ' ';
    }
  }
  throw InputError(message);
}

void require_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) {
    fail_input(file, "no such file; check the path");
  }
  if (std::filesystem::is_directory(status)) {
    fail_input(file, "is a folder; name a world file inside it");
  }
  if (!std::filesystem::is_regular_file(status)) {
    fail_input(file, "is not a regular file");
  }
  if (std::filesystem::file_size(file, error) == 0 && !error) {
    fail_input(file, "is empty; export or download it again");
  }
}

std::string read_bytes(const std::filesystem::path& file) {
  require_file(file);
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    fail_input(file, "cannot be opened; check its permissions");
  }
  std::string bytes(std::filesystem::file_size(file), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (stream.gcount() != static_cast<std::streamsize>(bytes.size())) {
    fail_input(file, "cannot be read to its end");
  }
  return bytes;
}

std::string lower_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return extension;
}

std::optional<std::string_view> TextReader::line() {
  if (at_end()) {
    return std::nullopt;
  }
  ++line_number_;
  const std::size_t begin = position_;
  const std::size_t end = std::min(text_.find('\n', begin), text_.size());
  position_ = std::min(end + 1, text_.size());
  std::string_view found = text_.substr(begin, end - begin);
  if (!found.empty() && found.back() == '\r') {
    found.remove_suffix(1);
  }
  return found;
}

std::string_view TextReader::word() {
  while (position_ < text_.size() && is_space(text_[position_])) {
    ++position_;
  }
  const std::size_t begin = position_;
  while (position_ < text_.size() && !is_space(text_[position_])) {
    ++position_;
  }
  return text_.substr(begin, position_ - begin);
}

std::string_view WordReader::word() {
  std::size_t begin = 0;
  while (begin < rest_.size() && is_space(rest_[begin])) {
    ++begin;
  }
  std::size_t end = begin;
  while (end < rest_.size() && !is_space(rest_[end])) {
    ++end;
  }
  const std::string_view found = rest_.substr(begin, end - begin);
  rest_.remove_prefix(end);
  return found;
}

}  // namespace stairwell::sim3d
