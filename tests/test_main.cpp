#define CATCH_CONFIG_RUNNER
#include "tests/test_folder.hpp"

#include <catch2/catch.hpp>

#include <string>

#include <unistd.h>

namespace stairwell::testing {

namespace fs = std::filesystem;

namespace {

fs::path folder_of_process() { return fs::path(STAIRWELL_TEST_TMP) / std::to_string(::getpid()); }

}  // namespace

const fs::path& test_folder() {
  static const fs::path folder = [] {
    fs::path made = folder_of_process();
    fs::remove_all(made);  // of an earlier process with this number
    fs::create_directories(made);
    return made;
  }();
  return folder;
}

}  // namespace stairwell::testing

int main(int argc, char* argv[]) {
  const int failed = Catch::Session().run(argc, argv);
  std::error_code none;
  if (failed == 0) std::filesystem::remove_all(stairwell::testing::folder_of_process(), none);
  return failed;
}
