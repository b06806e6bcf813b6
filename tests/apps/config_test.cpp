#include "apps/run_config.hpp"
#include "core/errors.hpp"
#include "core/units.hpp"
#include "mapping/distance_field.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <map>
#include <string>

namespace stairwell::apps {

using Catch::Contains;
using Catch::EndsWith;

namespace {

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no InputError";
}

Settings from_yaml(const std::string& text, const std::string& name = "c.yaml") {
  Settings settings;
  add_yaml_file(settings, testing::write_text(testing::fresh_folder("yaml") / name, text));
  return settings;
}

}  // namespace

TEST_CASE("defaults follow mode and sensor") {
  Settings settings{{"world", {"a.sdf", "WORLD"}}};
  const RunConfig camera = resolve(settings);
  CHECK(camera.problems().empty());
  CHECK(camera.fleet.coverage == "frontiers");
  CHECK(camera.fleet.sensor.rays_azimuth == 160);
  CHECK(camera.fleet.sensor.azimuth_fov_rad == Approx(rad_from_deg(90.0)));
  CHECK(camera.fleet.sensor.max_range_m == 5.0);
  CHECK(camera.fleet.radial_scan_radps == Approx(explore::FleetConfig{}.radial_scan_radps));
  CHECK(camera.uavs == 1);

  Settings lidar_settings{{"world", {"a.sdf", ""}}, {"sensor", {"lidar", ""}}, {"mode", {"slice", ""}}};
  const RunConfig lidar = resolve(lidar_settings);
  CHECK(lidar.fleet.coverage == "layers");
  CHECK(lidar.fleet.sensor.rays_azimuth == 360);
  CHECK(lidar.fleet.sensor.rays_elevation == 60);
  CHECK(lidar.fleet.sensor.max_range_m == 10.0);

  Settings mid360{{"sensor", {"lidar", ""}}, {"fov_deg", {"360x-7..45", ""}}};
  CHECK(resolve(mid360).fleet.sensor.rays_elevation == 53);
}

// Clearances are compared with distances between voxels, so that a hair more can cost a whole voxel on either side
// (2 cm in voxels of 10 cm do).
TEST_CASE("by default planning keeps more than the radius and no passage is closed by it") {
  Settings settings{{"world", {"a.sdf", "WORLD"}}};
  const RunConfig config = resolve(settings);
  const Robot& robot = config.fleet.robot;
  CHECK(robot.margin_m >= 0.01);
  const auto to_walls = [](double clearance_m, double resolution_m) {
    const int squared = mapping::min_squared_cells_for(clearance_m, resolution_m);
    return std::ceil(std::sqrt(static_cast<double>(squared)));
  };
  for (const double resolution_m : {0.05, 0.1, 0.2}) {
    INFO(resolution_m);
    CHECK(to_walls(robot.clearance_m(), resolution_m) == to_walls(robot.radius_m, resolution_m));
  }
}

TEST_CASE("rules of exploring are read, and refused with the mend") {
  Settings settings{{"limits_norm", {"per-axis", "--limits"}}, {"finish", {"frontier:1.0..1.5", "--finish"}}};
  const RunConfig config = resolve(settings);
  CHECK(config.fleet.limits.norm == MotionLimits::Norm::kPerAxis);
  REQUIRE(config.fleet.finish_slab);
  CHECK(config.fleet.finish_slab->lo_m == 1.0);
  CHECK(config.fleet.finish_slab->hi_m == 1.5);
  CHECK_FALSE(config.fleet.finish_slab->past_walls);
  Settings strict{{"finish", {"all-frontier:1..1.5", ""}}};
  CHECK(resolve(strict).fleet.finish_slab->past_walls);
  for (const char* const text : {"frontier", "all-", "frontier:1", "slab:1..2", "frontier:a..2"}) {
    Settings bad{{"finish", {text, "--finish"}}};
    CHECK_THAT(message_of([&] { resolve(bad); }), Contains("--finish: "));
  }
  Settings fleet{{"uavs", {"2", ""}},
                 {"radio_range_m", {"5", "--radio-range"}},
                 {"return", {"home", "--return"}},
                 {"battery_min", {"15", "--battery-min"}},
                 {"lose", {"1@30,0@45.5", "--lose"}},
                 {"stall", {"1@30..60.5,0@45", "--stall"}}};
  const RunConfig limited = resolve(fleet);
  CHECK(limited.radio_range_m == 5.0);
  CHECK(limited.fleet.return_to == explore::ReturnTo::kHome);
  CHECK(limited.fleet.battery_s == 900.0);
  REQUIRE(limited.fleet.losses.size() == 2);
  CHECK(limited.fleet.losses[1].uav == 0);
  CHECK(limited.fleet.losses[1].at_s == 45.5);
  REQUIRE(limited.fleet.stalls.size() == 2);
  CHECK(limited.fleet.stalls[0].uav == 1);
  CHECK(limited.fleet.stalls[0].from_s == 30.0);
  CHECK(limited.fleet.stalls[0].to_s == 60.5);
  CHECK(limited.fleet.stalls[1].from_s == 45.0);
  CHECK(std::isinf(limited.fleet.stalls[1].to_s));
  CHECK_FALSE(config.radio_range_m);
  CHECK(config.fleet.battery_s == 0.0);
  Settings nobody{{"world", {"a.sdf", ""}}, {"lose", {"1@30", "--lose"}}};
  CHECK_THAT(message_of([&] { require_usable(resolve(nobody)); }), Contains("--lose 1@.."));
  for (const auto& [text, mend] :
       std::map<std::string, std::string>{{"1@30", "--stall 1@.."}, {"0@9..5", "1@30..60"}}) {
    Settings bad{{"world", {"a.sdf", ""}}, {"stall", {text, "--stall"}}};
    CHECK_THAT(message_of([&] { require_usable(resolve(bad)); }), Contains(mend));
  }
  for (const char* const text : {"1", "1..5", "1@", "1@5..", "@5"}) {
    Settings bad{{"stall", {text, "--stall"}}};
    CHECK_THAT(message_of([&] { resolve(bad); }), Contains("--stall: "));
  }
  for (const char* const text : {"0", "-1", "soon"}) {
    Settings bad{{"battery_min", {text, "--battery-min"}}};
    CHECK_THAT(message_of([&] { resolve(bad); }), Contains("--battery-min: "));
  }
  Settings reversed{{"world", {"a.sdf", ""}}, {"finish", {"frontier:2..1", "--finish"}}};
  CHECK_THAT(message_of([&] { require_usable(resolve(reversed)); }), Contains("Z0 < Z1"));
}

TEST_CASE("later layers win: file, then --set, then options") {
  Settings settings = from_yaml("vmax_mps: 1.0\namax_mps2: 1.5\nseed: 3\n");
  add_assignment(settings, "amax_mps2=2.5");
  add_assignment(settings, "jmax_mps3=12");
  add_assignment(settings, "seed=4");
  settings["seed"] = {"5", "--seed"};
  const RunConfig config = resolve(settings);
  CHECK(config.fleet.limits.speed_mps == 1.0);
  CHECK(config.fleet.limits.acceleration_mps2 == 2.5);
  CHECK(config.fleet.limits.jerk_mps3 == 12.0);
  CHECK(config.fleet.seed == 5);
}

TEST_CASE("the resolved configuration reads back as the same run") {
  Settings settings{{"world", {"/w/a.sdf", "WORLD"}},        {"starts", {"-9,0,0,33.3;1,2,3", "--start"}},
                    {"box", {"-10,-10,0,10,10,4", "--box"}}, {"layers", {"1,2.5", "--layers"}},
                    {"mode", {"slice", "--mode"}},           {"yaw_rate_deg", {"57.3", "--yaw-rate-deg"}}};
  const RunConfig first = resolve(settings);
  CHECK(first.uavs == 2);
  record_resolved(first, settings);
  Settings again = from_yaml(to_yaml(settings, "test"));
  for (const auto& [key, setting] : settings) {
    CAPTURE(key);
    REQUIRE(again.contains(key));
    CHECK(again.at(key).text == setting.text);
  }
  const RunConfig second = resolve(again);
  CHECK(second.starts[0].yaw_rad == first.starts[0].yaw_rad);
  CHECK(second.starts[1].position_m == first.starts[1].position_m);
  CHECK(second.fleet.limits.yaw_rate_radps == first.fleet.limits.yaw_rate_radps);
  CHECK(second.fleet.layers_m == first.fleet.layers_m);
  CHECK(to_yaml(again, "test") == to_yaml(settings, "test"));
}

TEST_CASE("bad YAML is named by file, line and key") {
  const auto says = [](const std::string& text) { return message_of([&] { from_yaml(text); }); };
  CHECK_THAT(says("seed: 1\nspeeed: 3\n"), Contains("c.yaml:2") && Contains("speeed"));
  CHECK_THAT(says("seed: [1, 2\n"), Contains("c.yaml:") && Contains("not valid YAML"));
  CHECK_THAT(says(""), Contains("c.yaml") && Contains("empty"));
  CHECK_THAT(says("- 1\n- 2\n"), Contains("map of key"));
  CHECK_THAT(says("seed: 1\nseed: 2\n"), Contains("twice"));
  CHECK_THAT(says("seed:\n"), Contains("no value"));
  CHECK_THAT(says("seed: {a: 1}\n"), Contains("c.yaml:1") && Contains("seed"));
  CHECK_THAT(message_of([] {
               Settings settings;
               add_yaml_file(settings, "/no/such.yaml");
             }),
             Contains("/no/such.yaml"));
  CHECK_THAT(message_of([] {
               Settings settings = from_yaml("mode: volume\nvmax_mps: fast\n");
               resolve(settings);
             }),
             Contains("c.yaml:2") && Contains("vmax_mps") && Contains("'fast'"));
  CHECK_THAT(message_of([] {
               Settings settings = from_yaml("vmax_mps: [1, 2]\n");
               resolve(settings);
             }),
             Contains("vmax_mps"));
}

TEST_CASE("a relative world is relative to the file that names it") {
  const Settings settings = from_yaml("world: worlds/a.sdf\n");
  CHECK_THAT(settings.at("world").text, EndsWith("yaml/worlds/a.sdf"));
}

TEST_CASE("every problem is listed") {
  Settings settings{{"world", {"a.sdf", ""}},
                    {"uavs", {"0", ""}},
                    {"vmax_mps", {"-1", ""}},
                    {"target_coverage", {"1.5", ""}},
                    {"resolution_m", {"0", ""}}};
  const RunConfig config = resolve(settings);
  const std::string all = message_of([&] { require_usable(config); });
  CHECK_THAT(all, Contains("--uavs 0") && Contains("target-coverage") && Contains("resolution"));
  CHECK(config.problems().size() >= 4);
  CHECK(all.find('\n') == std::string::npos);
}

TEST_CASE("every key has a default or may be left out, and unknown keys are refused") {
  CHECK_THROWS_AS(
      [] {
        Settings s;
        add_assignment(s, "nonsense=1");
      }(),
      InputError);
  CHECK_THROWS_AS(
      [] {
        Settings s;
        add_assignment(s, "seed");
      }(),
      InputError);
  Settings settings;
  resolve(settings);
  for (const SettingKey& known : setting_keys()) {
    const std::string key(known.key);
    if (key == "world" || key == "box" || key == "uavs" || key == "starts") continue;
    CAPTURE(key);
    CHECK(settings.contains(key));
  }
}

}  // namespace stairwell::apps
