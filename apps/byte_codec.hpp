/// Numbers and blocks of bytes as the replay and the report hold them: LEB128, zigzag, zlib, CRC-32, base64.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace stairwell::apps {

/// Seven bits a byte, lowest first.
void put_varint(std::string& bytes, std::uint64_t value);
/// Small magnitudes of either sign stay short: 0, -1, 1, -2, ...
void put_signed(std::string& bytes, std::int64_t value);
/// Little endian.
void put_u32(std::string& bytes, std::uint32_t value);

/// Reads what the functions above wrote.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  bool done() const { return rest_.empty(); }
  std::size_t left() const { return rest_.size(); }
  /// @throws InputError when the bytes end before the value does (all of them).
  std::uint64_t varint();
  std::int64_t signed_varint();
  std::uint32_t u32();
  std::uint8_t byte() { return static_cast<std::uint8_t>(take(1)[0]); }
  std::string_view take(std::uint64_t count);

 private:
  std::string_view rest_;
};

/// The checksum of PNG and zip.
std::uint32_t crc32_of(std::string_view bytes);
/// A zlib stream. @throws RunError when there is no memory for it.
std::string deflated(std::string_view bytes);
std::string base64(std::string_view bytes);

}  // namespace stairwell::apps
