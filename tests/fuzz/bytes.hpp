/// Numbers and choices out of a fuzzer's bytes; zeros when they have run out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

namespace stairwell::fuzz {

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : at_(data), left_(size) {}

  std::size_t left() const { return left_; }
  std::uint8_t byte() { return value<std::uint8_t>(); }
  std::int8_t signed_byte() { return value<std::int8_t>(); }
  /// 0 to count - 1.
  unsigned below(unsigned count) { return byte() % count; }

  template <typename Value>
  Value value() {
    Value result{};
    const std::size_t taken = left_ < sizeof(Value) ? left_ : sizeof(Value);
    if (taken > 0) std::memcpy(&result, at_, taken);
    at_ += taken;
    left_ -= taken;
    return result;
  }

 private:
  const std::uint8_t* at_;
  std::size_t left_;
};

/// A finding: libFuzzer keeps the input.
inline void require(bool good, std::string_view what) {
  if (good) return;
  const std::string line = "fuzzer: " + std::string(what) + "\n";
  std::fputs(line.c_str(), stderr);
  std::abort();
}

}  // namespace stairwell::fuzz
