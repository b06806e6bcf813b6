#pragma once

#include "apps/settings.hpp"

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace stairwell::apps {

/// The options of `stairwell explore` that say what a run is, for all commands that take them.
class ExploreOptions {
 public:
  /// @param without options that the command has in a form of its own. `this` must outlive the parser.
  void add_to(CLI::App& command, const std::vector<std::string_view>& without = {});

  /// In the order of precedence: --config, --set, --start and the options. @throws InputError
  Settings settings() const;
  /// Any option that was given, or nothing.
  std::string given() const;

 private:
  std::string config_file_;
  std::vector<std::string> starts_, assignments_;
  std::map<std::string, std::string> options_;  ///< by option name
};

}  // namespace stairwell::apps
