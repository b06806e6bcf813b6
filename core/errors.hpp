#pragma once

#include <stdexcept>
#include <string>

namespace stairwell {

/// The user's input cannot be used (file, option, start, box). The message is one line that names the input
/// and the fix. The command line turns it into exit code 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The work itself failed (disk full, unwritable folder, internal limit). Exit code 1.
class RunError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace stairwell
