#include "coverage3d/blacklist.hpp"

#include "coverage3d/json_vector.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace stairwell::coverage3d {
namespace {

constexpr double kSmall_m2 = 0.3;       // one failed look is enough for a cluster this small
constexpr double kSameReport_s = 0.05;  // a failure seen by two parties at once counts once
constexpr int kMostDoublings = 6;

}  // namespace

void Blacklist::report(const Eigen::Vector3d& position_m, const Eigen::Vector3d& target_m, double time_s) {
  int failures = 0;
  for (const Entry& entry : entries_) {
    if ((entry.target_m - target_m).norm() > radius_m_) continue;
    if ((entry.position_m - position_m).norm() < 0.05 && time_s - entry.last_s < kSameReport_s) return;
    failures = std::max(failures, entry.failures);
  }
  const double time = time_s_ * std::pow(2.0, std::min(failures, kMostDoublings));
  entries_.push_back({position_m, target_m, time_s + time, time_s, failures + 1});
  std::erase_if(live_, [time_s](const Entry& entry) { return time_s >= entry.until_s; });
  live_.push_back(entries_.back());
}

bool Blacklist::blocks_place(const Eigen::Vector3d& position_m, double time_s) const {
  return std::any_of(live_.begin(), live_.end(), [&](const Entry& entry) {
    return time_s < entry.until_s && (entry.position_m - position_m).norm() <= radius_m_;
  });
}

bool Blacklist::blocks_target(const FrontierCluster& cluster, double time_s) const {
  const int allowed = patience_ + (cluster.area_m2 <= kSmall_m2 ? 1 : 2);
  return std::any_of(live_.begin(), live_.end(), [&](const Entry& entry) {
    return time_s < entry.until_s && entry.failures >= allowed &&
           (entry.target_m - cluster.center_m).norm() <= radius_m_;
  });
}

nlohmann::json Blacklist::to_json() const {
  nlohmann::json list = nlohmann::json::array();
  for (const Entry& entry : entries_)
    list.push_back({{"position_m", json_of(entry.position_m)},
                    {"target_m", json_of(entry.target_m)},
                    {"until_s", entry.until_s},
                    {"last_s", entry.last_s},
                    {"failures", entry.failures}});
  return list;
}

void Blacklist::from_json(const nlohmann::json& json) {
  std::vector<Entry> entries;
  for (const nlohmann::json& item : json)
    entries.push_back({vector_of(item.at("position_m")), vector_of(item.at("target_m")),
                       item.at("until_s").get<double>(), item.at("last_s").get<double>(),
                       item.at("failures").get<int>()});
  entries_ = std::move(entries);
  live_ = entries_;
}

}  // namespace stairwell::coverage3d
