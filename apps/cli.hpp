/// The command line of the program `stairwell`.
#pragma once

#include <csignal>
#include <iosfwd>
#include <string>
#include <vector>

namespace stairwell::apps {

inline constexpr int kExitDone = 0;
inline constexpr int kExitRunFailed = 1;
inline constexpr int kExitBadInput = 2;

/// @param words the arguments without the program's name
/// @param interrupted set by a signal handler while the program runs
/// @returns the exit code. Errors are one line on `err`.
int run_program(const std::vector<std::string>& words, std::ostream& out, std::ostream& err,
                const volatile std::sig_atomic_t& interrupted);

}  // namespace stairwell::apps
