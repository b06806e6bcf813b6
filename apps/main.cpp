#include "apps/cli.hpp"

#include <csignal>
#include <iostream>

namespace {

volatile std::sig_atomic_t interrupted = 0;

/// The first signal ends the run cleanly, the second one at once.
void on_signal(int signal) {
  interrupted = 1;
  std::signal(signal, SIG_DFL);
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  const std::vector<std::string> words(argv + 1, argv + argc);
  return stairwell::apps::run_program(words, std::cout, std::cerr, interrupted);
}
