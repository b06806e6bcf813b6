/// What every loader needs from a file: plain errors, its bytes, and a reader over text that cannot run past the end.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace stairwell::sim3d {

/// @throws InputError "<file>: <what>" on one line.
[[noreturn]] void fail_input(const std::filesystem::path& file, const std::string& what);

/// @throws InputError when it is missing, a folder, not a regular file or empty.
void require_file(const std::filesystem::path& file);

/// The whole file. @throws InputError as require_file does, or when it cannot be read.
std::string read_bytes(const std::filesystem::path& file);

/// Lower-case extension with its dot.
std::string lower_extension(const std::filesystem::path& file);

/// Words and lines of a text, with the line number for messages.
class TextReader {
 public:
  explicit TextReader(std::string_view text, std::size_t position = 0) : text_(text), position_(position) {}

  bool at_end() const { return position_ >= text_.size(); }
  std::size_t position() const { return position_; }
  std::size_t line_number() const { return line_number_; }

  /// The next line without its line break; nullopt at the end.
  std::optional<std::string_view> line();
  /// The next word, over line breaks; empty at the end.
  std::string_view word();

 private:
  std::string_view text_;
  std::size_t position_;
  std::size_t line_number_ = 0;
};

/// The words of one line.
class WordReader {
 public:
  explicit WordReader(std::string_view line) : rest_(line) {}
  std::string_view word();

 private:
  std::string_view rest_;
};

/// The whole word as a number; nullopt when it is anything else.
template <typename Number>
std::optional<Number> parse_number(std::string_view word) {
  if (!word.empty() && word.front() == '+') {
    word.remove_prefix(1);
  }
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) {
    return std::nullopt;
  }
  return value;
}

/// A little-endian value at `offset`. @pre offset + sizeof(Value) <= bytes.size()
template <typename Value>
Value read_value(std::string_view bytes, std::size_t offset) {
  Value value;
  std::memcpy(&value, bytes.data() + offset, sizeof(Value));
  return value;
}

}  // namespace stairwell::sim3d
