/// Named settings of a run as text, before they are given a meaning: the one currency of YAML files, `--set` and the
/// command line's options.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::apps {

struct Setting {
  std::string text;
  std::string origin;  ///< for messages: `--uavs`, `--set uavs`, `run.yaml:3: uavs`
};

/// By key; later layers overwrite earlier ones.
using Settings = std::map<std::string, Setting>;

struct SettingKey {
  std::string_view key;
  std::string_view option;  ///< of `stairwell explore`; empty: only in YAML and `--set`
  std::string_view value;   ///< form of the value, for the help
  std::string_view help;
};

/// Every key a configuration may hold, in the order in which config.yaml lists them.
const std::vector<SettingKey>& setting_keys();
bool is_setting_key(std::string_view key);

/// `key=value`. @throws InputError for another form or an unknown key.
void add_assignment(Settings& settings, std::string_view assignment);

/// Reads a flat YAML map. Lists of numbers become comma-separated text, lists of lists are joined by `;`. A relative
/// `world` is taken relative to the file's folder.
/// @throws InputError naming file, line and key: missing, unreadable, malformed, unknown or repeated keys, wrong types.
void add_yaml_file(Settings& settings, const std::filesystem::path& file);

/// The settings as a YAML map in the order of setting_keys().
std::string to_yaml(const Settings& settings, std::string_view heading);

}  // namespace stairwell::apps
