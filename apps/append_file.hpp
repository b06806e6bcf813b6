#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace stairwell::apps {

/// A file that only grows (logs of a running exploration). Written as `<name>.part` until `publish` gives it its name.
class AppendFile {
 public:
  /// Begins a new file, or goes on after the first `keep_bytes` of what an interrupted run left (published or not).
  /// @throws RunError naming the file when it cannot be written; InputError when it is shorter than `keep_bytes`.
  AppendFile(std::filesystem::path file, std::uint64_t keep_bytes);
  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  void append(std::string_view text);
  /// Hands everything over to the operating system. @returns the file's length. @throws RunError naming the file.
  std::uint64_t flush();
  void publish();

 private:
  [[noreturn]] void fail(int error) const;

  std::filesystem::path file_;
  std::filesystem::path part_;
  std::string buffer_;
  std::uint64_t written_ = 0;
  int descriptor_ = -1;
};

}  // namespace stairwell::apps
