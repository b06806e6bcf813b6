/// What a training writes down to go on later: numbers in a row, with a seal that tells damage.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace stairwell::nn {

/// Puts numbers, lists and texts one after the other, as they lie in memory.
class ByteWriter {
 public:
  template <typename T>
  void number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    append(&value, sizeof value);
  }
  template <typename T>
  void list(std::span<const T> values) {
    number<std::uint64_t>(values.size());
    append(values.data(), values.size_bytes());
  }
  void text(std::string_view value) { list(std::span(value.data(), value.size())); }
  const std::string& bytes() const { return bytes_; }

 private:
  void append(const void* from, std::size_t size) { bytes_.append(static_cast<const char*>(from), size); }
  std::string bytes_;
};

/// Takes them out again, in the same order. Every call throws InputError where the bytes end too early.
class ByteReader {
 public:
  /// `bytes` must outlive the reader.
  explicit ByteReader(std::string_view bytes) : left_(bytes) {}

  template <typename T>
  T number() {
    T value;
    std::memcpy(&value, take(1, sizeof value).data(), sizeof value);
    return value;
  }
  template <typename T>
  std::vector<T> list() {
    const auto count = number<std::uint64_t>();
    const std::string_view bytes = take(count, sizeof(T));
    std::vector<T> values(static_cast<std::size_t>(count));
    if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
  std::string text() {
    const std::vector<char> letters = list<char>();
    return {letters.begin(), letters.end()};
  }
  /// @throws InputError if something is left
  void finish() const;

 private:
  std::string_view take(std::uint64_t count, std::size_t size);
  std::string_view left_;
};

/// The line `kind`, a line of settings, a line with size and hash (FNV-1a), then the payload.
std::string seal(std::string_view kind, std::string_view settings, std::string_view payload);

/// The payload, within `bytes`. @throws InputError when the bytes are of another kind or other settings, truncated or
/// damaged
std::string_view unseal(std::string_view bytes, std::string_view kind, std::string_view settings);

}  // namespace stairwell::nn
