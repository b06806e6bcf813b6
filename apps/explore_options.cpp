#include "apps/explore_options.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>

namespace stairwell::apps {

void ExploreOptions::add_to(CLI::App& command, const std::vector<std::string_view>& without) {
  command.add_option("--start", starts_, "Start of a UAV; repeat for each (default: found by the program)")
      ->type_name("x,y,z[,yaw_deg]")
      ->allow_extra_args(false);
  for (const SettingKey& known : setting_keys()) {
    if (known.option.empty() || std::ranges::find(without, known.option) != without.end()) continue;
    const std::string name(known.option);
    command
        .add_option_function<std::string>(
            name, [this, name](const std::string& text) { options_[name] = text; }, std::string(known.help))
        ->type_name(std::string(known.value));
  }
  command.add_option("--config", config_file_, "Configuration file, as config.yaml of a run")->type_name("FILE.yaml");
  command.add_option("--set", assignments_, "key=value, any key of config.yaml")->allow_extra_args(false);
}

Settings ExploreOptions::settings() const {
  Settings settings;
  if (!config_file_.empty()) add_yaml_file(settings, config_file_);
  for (const std::string& assignment : assignments_) add_assignment(settings, assignment);
  if (!starts_.empty()) {
    std::string joined;
    for (const std::string& start : starts_) joined += (joined.empty() ? "" : ";") + start;
    settings["starts"] = {joined, "--start"};
  }
  for (const SettingKey& known : setting_keys()) {
    const auto found = options_.find(std::string(known.option));
    if (known.option.empty() || found == options_.end()) continue;
    settings[std::string(known.key)] = {found->second, found->first};
  }
  return settings;
}

std::string ExploreOptions::given() const {
  if (!config_file_.empty()) return "--config";
  if (!starts_.empty()) return "--start";
  if (!assignments_.empty()) return "--set";
  return options_.empty() ? "" : options_.begin()->first;
}

}  // namespace stairwell::apps
