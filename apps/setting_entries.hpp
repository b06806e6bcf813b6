/// One setting of a run: its name, its default text and what its text does to the configuration.
#pragma once

#include "apps/option_values.hpp"
#include "apps/run_config.hpp"
#include "core/errors.hpp"
#include "core/units.hpp"

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace stairwell::apps {

using Apply = std::function<void(RunConfig&, const std::string&)>;

struct Entry {
  SettingKey key;
  std::string fallback;  ///< default text; empty = none
  Apply apply;
};

inline Apply number(double& (*field)(RunConfig&)) {
  return [field](RunConfig& config, const std::string& text) { field(config) = parse_number(text); };
}

inline Apply angle_deg(double& (*field)(RunConfig&)) {
  return [field](RunConfig& config, const std::string& text) { field(config) = rad_from_deg(parse_number(text)); };
}

inline Apply on_off(bool& (*field)(RunConfig&)) {
  return [field](RunConfig& config, const std::string& text) { field(config) = parse_switch(text); };
}

/// One of a list of words.
template <typename Value>
Value choice(const std::string& text, const std::vector<std::pair<std::string, Value>>& known) {
  std::string names;
  for (const auto& [name, value] : known) {
    if (name == text) return value;
    names += (names.empty() ? "" : ", ") + name;
  }
  throw InputError("'" + text + "' is not one of " + names);
}

/// The rules by which a fleet explores: limits, radio, what counts as explored, what happens at the end.
const std::vector<Entry>& rule_entries();

}  // namespace stairwell::apps
