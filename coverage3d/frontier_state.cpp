/// What a resumed run needs of a frontier strategy.
#include "core/errors.hpp"
#include "coverage3d/frontier_strategy.hpp"
#include "coverage3d/json_vector.hpp"

#include <nlohmann/json.hpp>

#include <deque>
#include <optional>
#include <utility>

namespace stairwell::coverage3d {
namespace {

constexpr int kStateVersion = 1;

}  // namespace

std::string FrontierStrategy::save_state() const {
  nlohmann::json state = {{"strategy", std::string(name())},
                          {"version", kStateVersion},
                          {"blacklist", blacklist_.to_json()},
                          {"start_height_m", nullptr}};
  if (start_height_m_) state["start_height_m"] = *start_height_m_;
  state["given"] = nlohmann::json::array();
  for (const GivenGoal& given : given_) {
    nlohmann::json cells = nlohmann::json::array();
    for (const VoxelIndex& v : given.cells) cells.push_back({v.x, v.y, v.z});
    state["given"].push_back({{"position_m", json_of(given.position_m)},
                              {"target_m", json_of(given.target_m)},
                              {"cells", std::move(cells)}});
  }
  return state.dump();
}

void FrontierStrategy::load_state(const std::string& state) try {
  const nlohmann::json json = nlohmann::json::parse(state);
  if (json.at("strategy").get<std::string>() != name())
    throw InputError("saved state is of strategy '" + json.at("strategy").get<std::string>() + "', not '" +
                     std::string(name()) + "'");
  if (json.at("version").get<int>() != kStateVersion) throw InputError("saved coverage state has another version");
  std::deque<GivenGoal> given;
  for (const nlohmann::json& item : json.at("given")) {
    given.push_back({vector_of(item.at("position_m")), vector_of(item.at("target_m")), {}});
    for (const nlohmann::json& v : item.at("cells"))
      given.back().cells.push_back({v.at(0).get<int>(), v.at(1).get<int>(), v.at(2).get<int>()});
  }
  std::optional<double> start_height_m;
  if (!json.at("start_height_m").is_null()) start_height_m = json.at("start_height_m").get<double>();
  Blacklist blacklist = blacklist_;
  blacklist.from_json(json.at("blacklist"));
  blacklist_ = std::move(blacklist);
  given_ = std::move(given);
  start_height_m_ = start_height_m;
} catch (const nlohmann::json::exception& error) {
  throw InputError(std::string("saved coverage state is damaged: ") + error.what());
}

}  // namespace stairwell::coverage3d
