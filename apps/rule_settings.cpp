#include "apps/setting_entries.hpp"

#include <optional>
#include <sstream>
#include <string>

namespace stairwell::apps {

namespace {

std::optional<coverage3d::FinishSlab> parse_finish(const std::string& text) {
  const bool past_walls = text.starts_with("all-");
  const std::string word = past_walls ? "all-frontier:" : "frontier:";
  if (text == "coverage") return std::nullopt;
  const std::size_t dots = text.find("..");
  if (!text.starts_with(word) || dots == std::string::npos) {
    throw InputError(
        "'" + text +
        "' is not a finish: give coverage, or frontier:Z0..Z1 as in frontier:1..1.5, or all-frontier:Z0..Z1");
  }
  return coverage3d::FinishSlab{parse_number(text.substr(word.size(), dots - word.size())),
                                parse_number(text.substr(dots + 2)), past_walls};
}

double battery_s(const std::string& text) {
  const double minutes = parse_number(text);
  if (!(minutes > 0.0)) throw InputError("'" + text + "' minutes of battery are none: give more, or unlimited");
  return 60.0 * minutes;
}

std::vector<explore::Loss> parse_losses(const std::string& text) {
  std::vector<explore::Loss> losses;
  if (text == "none") return losses;
  std::istringstream items(text);
  for (std::string item; std::getline(items, item, ',');) {
    const std::size_t at = item.find('@');
    if (at == std::string::npos) throw InputError("'" + item + "' is not a loss: give UAV@SECONDS as in 1@30");
    losses.push_back({static_cast<std::size_t>(parse_count(item.substr(0, at))), parse_number(item.substr(at + 1))});
  }
  return losses;
}

std::vector<explore::Stall> parse_stalls(const std::string& text) {
  std::vector<explore::Stall> stalls;
  if (text == "none") return stalls;
  std::istringstream items(text);
  for (std::string item; std::getline(items, item, ',');) {
    const std::size_t at = item.find('@');
    const std::size_t dots = item.find("..");
    if (at == std::string::npos || dots < at) {
      throw InputError("'" + item + "' is not a stall: give UAV@FROM..TO in seconds as in 1@30..60, or 1@30 for good");
    }
    explore::Stall& stall = stalls.emplace_back();
    stall.uav = static_cast<std::size_t>(parse_count(item.substr(0, at)));
    stall.from_s = parse_number(item.substr(at + 1, dots == std::string::npos ? dots : dots - at - 1));
    if (dots != std::string::npos) stall.to_s = parse_number(item.substr(dots + 2));
  }
  return stalls;
}

}  // namespace

const std::vector<Entry>& rule_entries() {
  static const std::vector<Entry> entries = {
      {{"limits_norm", "--limits", "euclidean|per-axis", "what the largest speed and acceleration limit"},
       "euclidean",
       [](RunConfig& c, const std::string& t) {
         using Norm = MotionLimits::Norm;
         c.fleet.limits.norm = choice<Norm>(
             t, {{"euclidean", Norm::kEuclidean}, {"per-axis", Norm::kPerAxis}, {"per_axis", Norm::kPerAxis}});
       }},
      {{"radio_range_m", "--radio-range", "M|unlimited", "maps are exchanged between UAVs this near"},
       "unlimited",
       [](RunConfig& c, const std::string& t) {
         c.radio_range_m = t == "unlimited" ? std::nullopt : std::optional(parse_number(t));
       }},
      {{"finish", "--finish", "coverage|[all-]frontier:Z0..Z1",
        "explored: all that can be seen, or no frontier at these heights (docs/exploration.md)"},
       "coverage",
       [](RunConfig& c, const std::string& t) { c.fleet.finish_slab = parse_finish(t); }},
      {{"return", "--return", "home|land|stay", "at the end: to the start and down, down where it is, or stay there"},
       "land",
       [](RunConfig& c, const std::string& t) {
         using explore::ReturnTo;
         c.fleet.return_to =
             choice<ReturnTo>(t, {{"home", ReturnTo::kHome}, {"land", ReturnTo::kLand}, {"stay", ReturnTo::kStay}});
       }},
      {{"battery_min", "--battery-min", "M|unlimited", "minutes in the air after which a UAV has to be down"},
       "unlimited",
       [](RunConfig& c, const std::string& t) { c.fleet.battery_s = t == "unlimited" ? 0.0 : battery_s(t); }},
      {{"lost_after_s", "", "", "a UAV that is not heard of for so long gives its task back"},
       "5",
       number([](RunConfig& c) -> double& { return c.fleet.lost_after_s; })},
      {{"lose", "--lose", "UAV@S,..|none", "UAVs that fail at these simulated times"},
       "none",
       [](RunConfig& c, const std::string& t) { c.fleet.losses = parse_losses(t); }},
      {{"stalled_after_s", "", "", "a UAV that gets on with its task no more for so long gives it back"},
       "8",
       number([](RunConfig& c) -> double& { return c.fleet.stalled_after_s; })},
      {{"stall", "--stall", "UAV@S[..S2],..|none", "UAVs that do not move from, and to, these simulated times"},
       "none",
       [](RunConfig& c, const std::string& t) { c.fleet.stalls = parse_stalls(t); }},
  };
  return entries;
}

}  // namespace stairwell::apps
