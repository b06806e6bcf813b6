#include "half_seen.hpp"

#include <catch2/catch.hpp>

#include <algorithm>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;
using toy::HalfSeen;
using toy::kStartHeight_m;

void check_same(const Assignment& a, const Assignment& b) {
  CHECK(a.open_targets == b.open_targets);
  CHECK(a.unreachable_targets == b.unreachable_targets);
  REQUIRE(a.goals.size() == b.goals.size());
  for (std::size_t i = 0; i < a.goals.size(); ++i) {
    REQUIRE(a.goals[i].has_value() == b.goals[i].has_value());
    if (!a.goals[i]) continue;
    CHECK(a.goals[i]->position_m == b.goals[i]->position_m);
    CHECK(a.goals[i]->target_m == b.goals[i]->target_m);
    CHECK(a.goals[i]->yaw_rad == b.goals[i]->yaw_rad);
  }
}

}  // namespace

TEST_CASE("a resumed strategy that is asked about a goal first goes on as one that is not") {
  for (const std::string_view name : strategy_names()) {
    for (const bool slice : {false, true}) {
      INFO(name << (slice ? " slice" : " volume"));
      const HalfSeen scene(slice);
      const planning3d::FreeSpace space = scene.space();
      const auto first = make_strategy(name, scene.config);
      const Assignment given = first->assign(space, scene.request);
      REQUIRE(given.goals.at(0).has_value());
      const Goal& goal = *given.goals[0];
      const std::string state = first->save_state();

      const auto asked = make_strategy(name, scene.config);
      asked->load_state(state);
      CHECK(asked->still_useful(space, goal) == first->still_useful(space, goal));
      // Before the next assignment no floor has been looked for: the layers lie by the height that was saved.
      const planning3d::MotionRule rule = asked->motion_rule();
      if (slice) {
        const double layer_m = space.grid().center_of(space.grid().index_of({0.0, 0.0, kStartHeight_m})).z();
        REQUIRE(std::find(rule.layers_m.begin(), rule.layers_m.end(), layer_m) != rule.layers_m.end());
      }

      const auto unasked = make_strategy(name, scene.config);
      unasked->load_state(state);
      check_same(asked->assign(space, scene.request), unasked->assign(space, scene.request));
      CHECK(asked->motion_rule().layers_m == unasked->motion_rule().layers_m);
      CHECK(asked->motion_rule().layers_m == first->motion_rule().layers_m);
    }
  }
}
