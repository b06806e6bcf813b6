#include "coverage3d/hybrid_strategy.hpp"

#include "core/errors.hpp"

#include <nlohmann/json.hpp>

namespace stairwell::coverage3d {

HybridStrategy::HybridStrategy(std::unique_ptr<CoverageStrategy> first, std::unique_ptr<CoverageStrategy> then,
                               const Aabb& box, double switch_at)
    : first_(std::move(first)), then_(std::move(then)), switch_m3_(switch_at * box.volume_m3()) {}

Assignment HybridStrategy::assign(const planning3d::FreeSpace& space, const AssignmentRequest& request) {
  switched_ = switched_ || space.map().known_volume_m3() >= switch_m3_;
  return present().assign(space, request);
}

bool HybridStrategy::still_useful(const planning3d::FreeSpace& space, const Goal& goal) {
  return present().still_useful(space, goal);
}

std::string HybridStrategy::save_state() const {
  return nlohmann::json{
      {"strategy", "hybrid"}, {"switched", switched_}, {"first", first_->save_state()}, {"then", then_->save_state()}}
      .dump();
}

void HybridStrategy::load_state(const std::string& state) try {
  const nlohmann::json json = nlohmann::json::parse(state);
  if (json.at("strategy").get<std::string>() != "hybrid") throw InputError("saved state is not of strategy 'hybrid'");
  const bool switched = json.at("switched").get<bool>();
  const std::string before = first_->save_state();
  first_->load_state(json.at("first").get<std::string>());
  try {
    then_->load_state(json.at("then").get<std::string>());
  } catch (...) {
    first_->load_state(before);
    throw;
  }
  switched_ = switched;
} catch (const nlohmann::json::exception& error) {
  throw InputError(std::string("saved coverage state is damaged: ") + error.what());
}

}  // namespace stairwell::coverage3d
