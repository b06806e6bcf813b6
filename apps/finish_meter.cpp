#include "apps/finish_meter.hpp"

#include <nlohmann/json.hpp>

namespace stairwell::apps {

using nlohmann::json;

namespace {

constexpr double kStill_m = 1e-6;  // per tick; as the published clock has it
constexpr double kLook_s = 0.5;    // of simulated time between two looks at the frontiers

json to_json(const std::optional<double>& value) { return value ? json(*value) : json(nullptr); }
std::optional<double> from_json(const json& j) { return j.is_null() ? std::nullopt : std::optional(j.get<double>()); }

}  // namespace

FinishMeter::FinishMeter(const GridSpec& grid, const explore::FleetConfig& fleet)
    : slab_(fleet.finish_slab && fleet.finish_slab->past_walls) {
  if (!fleet.finish_slab) return;
  finder_.emplace(grid, coverage3d::slab_frontiers(fleet.task_box, fleet.finish_slab->lo_m, fleet.finish_slab->hi_m));
}

void FinishMeter::observe(double time_s, const mapping::OccupancyMap& map, const std::vector<MotionState>& states,
                          bool exploring) {
  for (std::size_t i = 0; i < before_m_.size() && exploring; ++i) {
    if ((states[i].position_m - before_m_[i]).norm() <= kStill_m) continue;
    if (!first_motion_s_) first_motion_s_ = time_s;
    last_motion_s_ = time_s;
  }
  before_m_.resize(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) before_m_[i] = states[i].position_m;
  const bool due = time_s >= next_look_s_ || !exploring;
  if (!finder_ || !due || map.revision() == revision_) return;
  next_look_s_ = time_s + kLook_s;
  revision_ = map.revision();
  finder_->update(map);
  slab_.update(map, *finder_);
  if (!slab_.met()) {
    met_s_.reset();
  } else if (!met_s_) {
    met_s_ = time_s;
  }
}

json FinishMeter::save() const {
  return {{"first_motion_s", to_json(first_motion_s_)},
          {"last_motion_s", to_json(last_motion_s_)},
          {"met_s", to_json(met_s_)}};
}

void FinishMeter::load(const json& state) {
  first_motion_s_ = from_json(state.at("first_motion_s"));
  last_motion_s_ = from_json(state.at("last_motion_s"));
  met_s_ = from_json(state.at("met_s"));
}

}  // namespace stairwell::apps
