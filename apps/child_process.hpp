#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace stairwell::apps {

/// A program that runs beside this one, without input, and is killed when this one dies.
class ChildProcess {
 public:
  /// @param words its arguments @param output, errors files that it writes to, made new
  /// (126: they or the program could not be opened)
  /// @throws RunError when there can be no more processes
  ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& words,
               const std::filesystem::path& output, const std::filesystem::path& errors);

  /// None while it runs; 128 and more: killed by that signal.
  std::optional<int> exit_code();
  void interrupt() const;

 private:
  pid_t process_ = -1;
  std::optional<int> code_;
};

}  // namespace stairwell::apps
