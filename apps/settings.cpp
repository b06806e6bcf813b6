#include "apps/settings.hpp"

#include "core/errors.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace stairwell::apps {

namespace {

std::string place(const std::filesystem::path& file, const YAML::Mark& mark) {
  return mark.is_null() ? file.string() : file.string() + ":" + std::to_string(mark.line + 1);
}

std::string read_text(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) throw InputError(file.string() + ": no such configuration file");
  if (std::filesystem::is_directory(file, error)) throw InputError(file.string() + ": is a folder, not a YAML file");
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) throw InputError(file.string() + ": cannot be read");
  return text.str();
}

/// Lists become text: `,` between numbers, `;` between the lists of a list.
std::string text_of(const YAML::Node& node, const std::string& where, int depth) {
  if (node.IsScalar()) return node.Scalar();
  if (!node.IsSequence() || depth > 1) throw InputError(where + " must be a value or a list of values");
  std::string joined;
  const bool nested = node.size() > 0 && node[0].IsSequence();
  for (const YAML::Node& item : node) {
    if (item.IsSequence() != nested) throw InputError(where + " mixes values and lists");
    if (!joined.empty()) joined += nested ? ";" : ",";
    joined += text_of(item, where, depth + 1);
  }
  return joined;
}

void emit_numbers(YAML::Emitter& out, const std::string& text) {
  out << YAML::Flow << YAML::BeginSeq;
  std::istringstream items(text);
  for (std::string item; std::getline(items, item, ',');) out << item;
  out << YAML::EndSeq;
}

void emit_value(YAML::Emitter& out, std::string_view key, const std::string& text) {
  if (key == "starts") {
    out << YAML::Flow << YAML::BeginSeq;
    std::istringstream starts(text);
    for (std::string start; std::getline(starts, start, ';');) emit_numbers(out, start);
    out << YAML::EndSeq;
  } else if (key == "box" || (key == "layers" && text != "auto")) {
    emit_numbers(out, text);
  } else {
    out << text;
  }
}

}  // namespace

bool is_setting_key(std::string_view key) {
  return std::ranges::any_of(setting_keys(), [key](const SettingKey& known) { return known.key == key; });
}

void add_assignment(Settings& settings, std::string_view assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    throw InputError("--set " + std::string(assignment) + ": give key=value, as in --set robot_radius_m=0.25");
  }
  const std::string key(assignment.substr(0, equals));
  if (!is_setting_key(key)) {
    throw InputError("--set " + key + ": no such key (a run's config.yaml lists them all)");
  }
  settings[key] = {std::string(assignment.substr(equals + 1)), "--set " + key};
}

void add_yaml_file(Settings& settings, const std::filesystem::path& file) {
  const std::string text = read_text(file);
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw InputError(place(file, error.mark) + ": not valid YAML: " + error.msg);
  }
  if (root.IsNull()) throw InputError(file.string() + ": the configuration is empty");
  if (!root.IsMap()) throw InputError(file.string() + ": the configuration must be a map of key: value");
  Settings found;
  for (const auto& entry : root) {
    const std::string where = place(file, entry.first.Mark());
    if (!entry.first.IsScalar()) throw InputError(where + ": a key must be a word");
    const std::string key = entry.first.Scalar();
    if (!is_setting_key(key)) throw InputError(where + ": unknown key '" + key + "'");
    if (found.contains(key)) throw InputError(where + ": key '" + key + "' appears twice");
    if (entry.second.IsNull()) throw InputError(where + ": key '" + key + "' has no value");
    std::string value = text_of(entry.second, where + ": key '" + key + "'", 0);
    if (key == "world" && std::filesystem::path(value).is_relative()) {
      value = (file.parent_path() / value).lexically_normal().string();
    }
    found[key] = {std::move(value), where + ": " + key};
  }
  for (auto& [key, setting] : found) settings[key] = std::move(setting);
}

std::string to_yaml(const Settings& settings, std::string_view heading) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  for (const SettingKey& known : setting_keys()) {
    const auto found = settings.find(std::string(known.key));
    if (found == settings.end()) continue;
    out << YAML::Key << std::string(known.key) << YAML::Value;
    emit_value(out, known.key, found->second.text);
  }
  out << YAML::EndMap;
  return "# " + std::string(heading) + "\n" + out.c_str() + "\n";
}

}  // namespace stairwell::apps
