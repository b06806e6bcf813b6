/// The program in this process, as if called with these words.
#pragma once

#include "apps/cli.hpp"

#include <nlohmann/json.hpp>

#include <csignal>
#include <sstream>
#include <string>
#include <vector>

namespace stairwell::apps::testing {

using Words = std::vector<std::string>;

struct Outcome {
  int code;
  std::string out, err;
  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

/// @param signal  what has interrupted it; 0 = nothing
inline Outcome run(const Words& words, std::sig_atomic_t signal = 0) {
  const volatile std::sig_atomic_t interrupted = signal;
  std::ostringstream out, err;
  const int code = run_program(words, out, err, interrupted);
  return {code, out.str(), err.str()};
}

}  // namespace stairwell::apps::testing
