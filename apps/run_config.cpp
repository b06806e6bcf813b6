#include "apps/run_config.hpp"

#include "apps/models_dir.hpp"
#include "apps/option_values.hpp"
#include "apps/setting_entries.hpp"
#include "core/errors.hpp"
#include "core/units.hpp"
#include "coverage3d/strategy.hpp"
#include "planning3d/planner.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace stairwell::apps {

namespace {

std::string known_name(const std::string& text, const std::vector<std::string_view>& names) {
  std::vector<std::pair<std::string, std::string>> known;
  known.reserve(names.size());
  for (const std::string_view name : names) known.emplace_back(name, name);
  return choice<std::string>(text, known);
}

std::vector<std::string_view> hybrid_beginnings() {
  std::vector<std::string_view> names = coverage3d::strategy_names();
  std::erase(names, "hybrid");
  return names;
}

void apply_box(RunConfig& config, const std::string& text) {
  const std::vector<double> v = parse_numbers(text);
  if (v.size() != 6) throw InputError("'" + text + "' is not a box: give x0,y0,z0,x1,y1,z1");
  config.fleet.task_box = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
  config.box_given = true;
}

void apply_starts(RunConfig& config, const std::string& text) {
  config.starts.clear();
  std::istringstream items(text);
  for (std::string item; std::getline(items, item, ';');) {
    const std::vector<double> v = parse_numbers(item);
    if (v.size() != 3 && v.size() != 4) throw InputError("'" + item + "' is not a start: give x,y,z or x,y,z,yaw_deg");
    config.starts.push_back({{v[0], v[1], v[2]}, v.size() == 4 ? rad_from_deg(v[3]) : 0.0});
  }
}

void apply_sensor(RunConfig& config, const std::string& text) {
  config.fleet.sensor.kind =
      choice<SensorKind>(text, {{"depth", SensorKind::kDepthCamera}, {"lidar", SensorKind::kLidar}});
}

void apply_fov(RunConfig& config, const std::string& text) {
  const FieldOfView fov = parse_fov(text);
  config.fleet.sensor.azimuth_fov_rad = rad_from_deg(fov.azimuth_deg);
  config.fleet.sensor.elevation_lo_rad = rad_from_deg(fov.elevation_lo_deg);
  config.fleet.sensor.elevation_hi_rad = rad_from_deg(fov.elevation_hi_deg);
}

void apply_rays(RunConfig& config, const std::string& text) {
  SensorModel& sensor = config.fleet.sensor;
  std::tie(sensor.rays_azimuth, sensor.rays_elevation) = parse_size(text);
}

void apply_layers(RunConfig& config, const std::string& text) {
  config.fleet.layers_m = text == "auto" ? std::vector<double>{} : parse_numbers(text);
}

void apply_samples(RunConfig& config, const std::string& text) {
  const std::uint64_t samples = parse_count(text);
  if (samples > 10'000'000) throw InputError("'" + text + "' samples per scan are too many");
  config.fleet.sensor.samples_per_scan = static_cast<int>(samples);
}

int parse_threads(const std::string& text) {
  constexpr std::uint64_t kMost = 1'000'000;  // more than the fleet takes, and an int
  return static_cast<int>(std::min(parse_count(text), kMost));
}

const std::vector<Entry>& task_entries() {
  static const std::vector<Entry> entries = {
      {{"world", "", "FILE", "world file"}, "", [](RunConfig& c, const std::string& t) { c.world = t; }},
      {{"extrude_height_m", "--extrude-height", "M", "height of the walls of .pgm maps"},
       "2.5",
       number([](RunConfig& c) -> double& { return c.world_options.extrude_height_m; })},
      {{"point_size_m", "--point-size", "M", "edge of the voxel that a cloud's point fills"},
       "0.1",
       number([](RunConfig& c) -> double& { return c.world_options.point_size_m; })},
      {{"close_gaps", "--close-gaps", "on|off", "fill the voxels between two of a cloud's along an axis"},
       "on",
       on_off([](RunConfig& c) -> bool& { return c.world_options.close_gaps; })},
      {{"voxel_size_m", "--voxel-size", "M", "edge of a cell of a .3dmap"}, "1", number([](RunConfig& c) -> double& {
         return c.world_options.voxel_size_m;
       })},
      {{"box", "--box", "x0,y0,z0,x1,y1,z1", "what is to be explored, metres (default: the world's bounds)"},
       "",
       apply_box},
      {{"uavs", "--uavs", "N", "number of UAVs, 1 to 64 (default: the number of starts)"},
       "",
       [](RunConfig& c, const std::string& t) { c.uavs = parse_count(t); }},
      {{"starts", "", "", "list of [x, y, z, yaw_deg]"}, "", apply_starts},
      {{"start_spread_m", "--start-spread", "M",
        "move every start by up to so much along x and y, drawn from the seed"},
       "0",
       number([](RunConfig& c) -> double& { return c.start_spread_m; })},
      {{"mode", "--mode", "slice|volume", "fly in horizontal layers, or anywhere"},
       "volume",
       [](RunConfig& c, const std::string& t) {
         c.fleet.mode =
             choice<explore::Mode>(t, {{"slice", explore::Mode::kSlice}, {"volume", explore::Mode::kVolume}});
       }},
      {{"planner", "--planner", "NAME",
        "astar, theta, apf, slice, volume, rrtconnect, rrtstar, informed_rrtstar, bitstar, abitstar or prmstar"},
       "astar",
       [](RunConfig& c, const std::string& t) { c.fleet.planner = known_name(t, planning3d::planner_names()); }},
      {{"fallback", "--fallback", "NAME", "planner when that one has no answer: a name, none, or auto (astar)"},
       "auto",
       [](RunConfig& c, const std::string& t) {
         std::vector<std::string_view> names = planning3d::planner_names();
         names.insert(names.begin(), {"auto", "none"});
         c.fleet.fallback = known_name(t, names);
       }},
      {{"avoidance", "--avoidance", "priority|orca",
        "plans keep away from fellows, or UAVs that come near avoid each other"},
       "priority",
       [](RunConfig& c, const std::string& t) {
         using explore::Avoidance;
         c.fleet.avoidance = choice<Avoidance>(t, {{"priority", Avoidance::kPriority}, {"orca", Avoidance::kOrca}});
       }},
      {{"attraction", "--attraction", "cone|geodesic", "of apf to the goal: as the crow flies, or round obstacles"},
       "cone",
       [](RunConfig& c, const std::string& t) {
         using planning3d::Attraction;
         c.fleet.planner_options.attraction =
             choice<Attraction>(t, {{"cone", Attraction::kCone}, {"geodesic", Attraction::kGeodesic}});
       }},
      {{"experience", "--experience", "on|off", "apf fills local minima"},
       "off",
       [](RunConfig& c, const std::string& t) { c.fleet.planner_options.experience = parse_switch(t); }},
      {{"coverage", "--coverage", "NAME",
        "layers, frontiers, kmeans, hybrid, agent (learned), nearest, greedy, lawnmower or random (default: layers or "
        "frontiers, by mode)"},
       "",
       [](RunConfig& c, const std::string& t) { c.fleet.coverage = known_name(t, coverage3d::strategy_names()); }},
      {{"gain", "--gain", "volume|entropy",
        "of a view: the unknown volume in sight, or the entropy that the map is expected to lose"},
       "volume",
       [](RunConfig& c, const std::string& t) {
         using coverage3d::GainKind;
         c.fleet.gain = choice<GainKind>(t, {{"volume", GainKind::kVolume}, {"entropy", GainKind::kEntropy}});
       }},
      {{"turn_taking", "--turn-taking", "on|off",
        "whether a UAV plans knowing what the others are going to see, or as if alone"},
       "on",
       on_off([](RunConfig& c) -> bool& { return c.fleet.turn_taking; })},
      {{"hybrid_first", "", "", "strategy of hybrid before k-means"},
       "greedy",
       [](RunConfig& c, const std::string& t) { c.fleet.hybrid_first = known_name(t, hybrid_beginnings()); }},
      {{"hybrid_switch", "", "", "share of the box that is known when hybrid goes over to k-means"},
       "0.7",
       number([](RunConfig& c) -> double& { return c.fleet.hybrid_switch; })},
      {{"layers", "--layers", "z1,z2,..|auto", "heights of the layers in slice mode, metres"}, "auto", apply_layers},
  };
  return entries;
}

const std::vector<Entry>& sensor_entries() {
  static const std::vector<Entry> entries = {
      {{"sensor", "--sensor", "depth|lidar", "range sensor"}, "depth", apply_sensor},
      {{"fov_deg", "--fov-deg", "HxV|HxLO..HI", "field of view, as 90x73.7 or 360x-7..45"}, "", apply_fov},
      {{"range_m", "--range", "M", "largest range"}, "", number([](RunConfig& c) -> double& {
         return c.fleet.sensor.max_range_m;
       })},
      {{"min_range_m", "--min-range", "M", "smallest range"}, "0.1", number([](RunConfig& c) -> double& {
         return c.fleet.sensor.min_range_m;
       })},
      {{"rate_hz", "--rate-hz", "HZ", "scans per second"}, "10", number([](RunConfig& c) -> double& {
         return c.fleet.sensor.rate_hz;
       })},
      {{"rays", "--rays", "HxV", "rays per scan: columns x rows (lidar: lattice)"}, "", apply_rays},
      {{"samples", "--samples", "N", "lidar: rays drawn from the lattice per scan, 0 = all"}, "0", apply_samples},
      {{"noise", "--noise", "on|off", "noise, quantisation and drop-outs of a stereo camera"},
       "off",
       on_off([](RunConfig& c) -> bool& { return c.noise; })},
      {{"remove_outliers", "", "", "statistical outlier removal"}, "off", on_off([](RunConfig& c) -> bool& {
         return c.fleet.cloud.remove_outliers;
       })},
      {{"cloud_voxel_m", "", "", "voxel-grid filter of the returns, 0 = off"}, "0", number([](RunConfig& c) -> double& {
         return c.fleet.cloud.voxel_m;
       })},
      {{"fellow_radius_m", "", "", "returns this near to a fellow UAV are dropped"},
       "0.5",
       number([](RunConfig& c) -> double& { return c.fleet.cloud.fellow_radius_m; })},
  };
  return entries;
}

const std::vector<Entry>& motion_entries() {
  static const std::vector<Entry> entries = {
      {{"motion", "--motion", "limited|step", "motion model"},
       "limited",
       [](RunConfig& c, const std::string& t) {
         using explore::MotionModel;
         c.fleet.motion = choice<MotionModel>(t, {{"limited", MotionModel::kLimited}, {"step", MotionModel::kStep}});
       }},
      {{"step_delta_m", "", "", "step motion: distance per step"}, "0.12", number([](RunConfig& c) -> double& {
         return c.fleet.step_delta_m;
       })},
      {{"step_period_s", "", "", "step motion: duration of a step"}, "0.1", number([](RunConfig& c) -> double& {
         return c.fleet.step_period_s;
       })},
      {{"vmax_mps", "--vmax", "M/S", "largest speed"}, "2", number([](RunConfig& c) -> double& {
         return c.fleet.limits.speed_mps;
       })},
      {{"amax_mps2", "--amax", "M/S2", "largest acceleration"}, "2", number([](RunConfig& c) -> double& {
         return c.fleet.limits.acceleration_mps2;
       })},
      {{"jmax_mps3", "--jmax", "M/S3", "largest jerk of planned motions; 0 = no limit"},
       "0",
       number([](RunConfig& c) -> double& { return c.fleet.limits.jerk_mps3; })},
      {{"yaw_rate_deg", "--yaw-rate-deg", "DEG/S", "largest turning rate"},
       "90",
       angle_deg([](RunConfig& c) -> double& { return c.fleet.limits.yaw_rate_radps; })},
      {{"yaw_acc_deg", "--yaw-acc-deg", "DEG/S2", "largest turning acceleration"},
       "90",
       angle_deg([](RunConfig& c) -> double& { return c.fleet.limits.yaw_acceleration_radps2; })},
      {{"robot_radius_m", "--robot-radius", "M", "radius of a UAV"}, "0.2", number([](RunConfig& c) -> double& {
         return c.fleet.robot.radius_m;
       })},
      {{"robot_margin_m", "", "", "planning keeps this much more than the radius"},
       "0.015",
       number([](RunConfig& c) -> double& { return c.fleet.robot.margin_m; })},
      {{"fellow_clearance_m", "", "", "least distance between two UAVs' centres"},
       "0.6",
       number([](RunConfig& c) -> double& { return c.fleet.fellow_clearance_m; })},
      {{"takeoff_height_m", "", "", "height of the take-off"}, "1", number([](RunConfig& c) -> double& {
         return c.fleet.takeoff_height_m;
       })},
      {{"start_bubble_m", "", "", "radius around a start that is assumed free"},
       "0.6",
       number([](RunConfig& c) -> double& { return c.fleet.start_bubble_m; })},
      {{"radial_scan", "", "", "turn around once after take-off"}, "on", on_off([](RunConfig& c) -> bool& {
         return c.fleet.radial_scan;
       })},
      {{"radial_scan_rate_deg", "", "", "turning rate of the radial scan"},
       "90",
       angle_deg([](RunConfig& c) -> double& { return c.fleet.radial_scan_radps; })},
  };
  return entries;
}

const std::vector<Entry>& run_entries() {
  static const std::vector<Entry> entries = {
      {{"resolution_m", "--resolution", "M", "edge of the map's voxels"}, "0.1", number([](RunConfig& c) -> double& {
         return c.fleet.resolution_m;
       })},
      {{"p_hit", "", "", "OctoMap's sensor model"}, "0.7", number([](RunConfig& c) -> double& {
         return c.fleet.occupancy.p_hit;
       })},
      {{"p_miss", "", "", "OctoMap's sensor model"}, "0.4", number([](RunConfig& c) -> double& {
         return c.fleet.occupancy.p_miss;
       })},
      {{"clamp_min", "", "", "OctoMap's sensor model"}, "0.1192", number([](RunConfig& c) -> double& {
         return c.fleet.occupancy.clamp_min;
       })},
      {{"clamp_max", "", "", "OctoMap's sensor model"}, "0.971", number([](RunConfig& c) -> double& {
         return c.fleet.occupancy.clamp_max;
       })},
      {{"p_occupied", "", "", "OctoMap's sensor model"}, "0.5", number([](RunConfig& c) -> double& {
         return c.fleet.occupancy.p_occupied;
       })},
      {{"discretize", "", "", "one ray per end voxel"}, "off", on_off([](RunConfig& c) -> bool& {
         return c.fleet.discretize;
       })},
      {{"seed", "--seed", "S", "seed of everything random"},
       "1",
       [](RunConfig& c, const std::string& t) { c.fleet.seed = parse_count(t); }},
      {{"threads", "--threads", "N", "that work on the run; what comes of it is the same with any number"},
       "1",
       [](RunConfig& c, const std::string& t) { c.fleet.threads = parse_threads(t); }},
      {{"time_limit_s", "--time-limit", "S", "simulated time after which the run ends"},
       "1800",
       number([](RunConfig& c) -> double& { return c.fleet.time_limit_s; })},
      {{"target_coverage", "--target-coverage", "F", "end when this share is known; 1 = explore all"},
       "1",
       number([](RunConfig& c) -> double& { return c.target_coverage; })},
      {{"charge_planning", "--charge-planning", "on|off", "planning time passes in the simulation too"},
       "on",
       on_off([](RunConfig& c) -> bool& { return c.fleet.charge_planning; })},
      {{"plan_latency_s", "", "", "least time between deciding and turning"},
       "0.1",
       number([](RunConfig& c) -> double& { return c.fleet.plan_latency_s; })},
      {{"replan_period_s", "", "", "a goal is reconsidered this often"}, "1.5", number([](RunConfig& c) -> double& {
         return c.fleet.replan_period_s;
       })},
      {{"blacklist_radius_m", "", "", "around goals that failed"}, "0.6", number([](RunConfig& c) -> double& {
         return c.fleet.blacklist_radius_m;
       })},
      {{"patience_s", "", "", "with only remainders left, and the map hardly growing, the run ends after this"},
       "20",
       number([](RunConfig& c) -> double& { return c.fleet.patience_s; })},
      {{"remainder_gain_m3", "", "", "goals that promise less are remainders"},
       "1.5",
       number([](RunConfig& c) -> double& { return c.fleet.remainder_gain_m3; })},
      {{"min_growth", "", "", "share by which a map grows while exploring is worth it"},
       "0.003",
       number([](RunConfig& c) -> double& { return c.fleet.min_growth; })},
      {{"fruitless_visits", "", "", "so many goals in a row, or 5 per UAV, that show next to nothing end the run"},
       "20",
       [](RunConfig& c, const std::string& t) { c.fleet.fruitless_visits = parse_count(t); }},
      {{"blacklist_time_s", "", "", "for goals that failed"}, "120", number([](RunConfig& c) -> double& {
         return c.fleet.blacklist_time_s;
       })},
      {{"checkpoint_period_s", "", "", "wall time between checkpoints"}, "2", number([](RunConfig& c) -> double& {
         return c.checkpoint_period_s;
       })},
  };
  return entries;
}

std::vector<Entry> all_entries() {
  std::vector<Entry> all;
  for (const auto* group : {&task_entries(), &sensor_entries(), &motion_entries(), &rule_entries(), &run_entries()}) {
    all.insert(all.end(), group->begin(), group->end());
  }
  return all;
}

void set_default(Settings& settings, const std::string& key, const std::string& text) {
  settings.try_emplace(key, Setting{text, key});
}

/// A lidar's lattice has one ray per degree unless told otherwise.
std::string default_rays(const Settings& settings, bool lidar) {
  if (!lidar) return "160x120";
  const FieldOfView fov = parse_fov(settings.at("fov_deg").text);
  const bool whole_turn = fov.azimuth_deg >= 360.0;
  const long columns = std::max(1L, std::lround(std::min(fov.azimuth_deg, 360.0)) + (whole_turn ? 0 : 1));
  const long rows = std::lround(std::clamp(fov.elevation_hi_deg - fov.elevation_lo_deg, 0.0, 180.0)) + 1;
  return std::to_string(columns) + "x" + std::to_string(rows);
}

[[noreturn]] void rethrow_with_origin(const Setting& setting, const InputError& error) {
  throw InputError(setting.origin + ": " + error.what());
}

void add_dependent_defaults(Settings& settings, const RunConfig& config) {
  const bool lidar = config.fleet.sensor.kind == SensorKind::kLidar;
  set_default(settings, "coverage", config.fleet.mode == explore::Mode::kSlice ? "layers" : "frontiers");
  set_default(settings, "fov_deg", lidar ? "360x-7..52" : "90x73.7");
  set_default(settings, "range_m", lidar ? "10" : "5");
  try {
    set_default(settings, "rays", default_rays(settings, lidar));
  } catch (const InputError& error) {
    rethrow_with_origin(settings.at("fov_deg"), error);
  }
}

}  // namespace

const std::vector<SettingKey>& setting_keys() {
  static const std::vector<SettingKey> keys = [] {
    std::vector<SettingKey> found;
    for (const Entry& entry : all_entries()) found.push_back(entry.key);
    return found;
  }();
  return keys;
}

RunConfig resolve(Settings& settings) {
  RunConfig config;
  config.fleet.planner_options.models_dir = models_dir();
  const std::vector<Entry> entries = all_entries();
  for (const Entry& entry : entries) {
    if (!entry.fallback.empty()) set_default(settings, std::string(entry.key.key), entry.fallback);
  }
  const auto apply = [&](const Entry& entry) {
    const auto found = settings.find(std::string(entry.key.key));
    if (found == settings.end()) return;
    try {
      entry.apply(config, found->second.text);
    } catch (const InputError& error) {
      rethrow_with_origin(found->second, error);
    }
  };
  for (const Entry& entry : entries) {
    if (entry.key.key == "sensor" || entry.key.key == "mode") apply(entry);
  }
  add_dependent_defaults(settings, config);
  for (const Entry& entry : entries) apply(entry);
  if (!settings.contains("uavs")) config.uavs = std::max<std::size_t>(1, config.starts.size());
  return config;
}

void record_resolved(const RunConfig& config, Settings& settings) {
  const auto joined = [](std::initializer_list<double> values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : ",") + format_number(value);
    return text;
  };
  const Aabb& box = config.fleet.task_box;
  const Eigen::Vector3d &lo = box.min_m, &hi = box.max_m;
  set_default(settings, "box", joined({lo.x(), lo.y(), lo.z(), hi.x(), hi.y(), hi.z()}));
  // Starts that were given keep their own text: degrees do not survive the way through radians bit by bit.
  std::string starts;
  const auto given = settings.find("starts");
  std::istringstream given_texts(given == settings.end() ? "" : given->second.text);
  for (const Start& start : config.starts) {
    std::string text;
    if (!std::getline(given_texts, text, ';') || config.start_spread_m > 0.0) {
      const Eigen::Vector3d& p = start.position_m;
      text = joined({p.x(), p.y(), p.z(), deg_from_rad(start.yaw_rad)});
    }
    starts += (starts.empty() ? "" : ";") + text;
  }
  settings["starts"] = {starts, "starts"};
  settings["start_spread_m"] = {"0", "start_spread_m"};  // these are moved already
  settings["uavs"] = {std::to_string(config.uavs), "uavs"};
  settings["world"].text = std::filesystem::absolute(config.world).lexically_normal().string();
}

const char* to_string(explore::Mode mode) { return mode == explore::Mode::kSlice ? "slice" : "volume"; }

std::vector<std::string> RunConfig::problems() const {
  std::vector<std::string> found;
  if (world.empty()) found.emplace_back("no world given: name a world file");
  if (uavs < 1 || uavs > kMostUavs) {
    found.push_back("--uavs " + std::to_string(uavs) + ": the number of UAVs must be 1 to " +
                    std::to_string(kMostUavs));
  }
  if (starts.size() > uavs) {
    found.push_back("--start is given " + std::to_string(starts.size()) + " times for " + std::to_string(uavs) +
                    " UAVs: raise --uavs or remove starts");
  }
  if (!(start_spread_m >= 0.0) || !std::isfinite(start_spread_m)) {
    found.emplace_back("--start-spread must be a number of metres that is not negative");
  }
  if (!(target_coverage > 0.0) || target_coverage > 1.0) {
    found.emplace_back("--target-coverage must be above 0 and at most 1");
  }
  for (const explore::Loss& loss : fleet.losses) {
    if (loss.uav >= uavs) found.push_back("--lose " + std::to_string(loss.uav) + "@..: UAVs are numbered from 0");
  }
  for (const explore::Stall& stall : fleet.stalls) {
    if (stall.uav >= uavs) found.push_back("--stall " + std::to_string(stall.uav) + "@..: UAVs are numbered from 0");
  }
  if (radio_range_m && !(*radio_range_m >= 0.0)) found.emplace_back("--radio-range must not be negative");
  if (!(checkpoint_period_s >= 0.0)) found.emplace_back("checkpoint_period_s must not be negative");
  if (!(world_options.extrude_height_m > 0.0)) found.emplace_back("--extrude-height must be positive");
  if (!(world_options.point_size_m > 0.0)) found.emplace_back("--point-size must be positive");
  if (!(world_options.voxel_size_m > 0.0)) found.emplace_back("--voxel-size must be positive");
  if (box_given && !fleet.task_box.empty() && (fleet.task_box.size_m().array() <= 0.0).any()) {
    found.emplace_back("--box has no volume: give x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1, z0 < z1");
  }
  explore::FleetConfig checked = fleet;
  if (!box_given && fleet.task_box.empty()) {  // known only once the world is read
    checked.task_box = {Eigen::Vector3d::Constant(-1e9), Eigen::Vector3d::Constant(1e9)};
  }
  const std::vector<std::string> more = checked.problems();
  found.insert(found.end(), more.begin(), more.end());
  const double voxels = fleet.task_box.volume_m3() / std::pow(fleet.resolution_m, 3);
  if (fleet.resolution_m > 0.0 && voxels > kMostVoxels) {
    found.emplace_back("--box holds more than 400 million voxels: make it smaller or raise --resolution");
  }
  return found;
}

void require_usable(const RunConfig& config) {
  std::string all;
  for (const std::string& problem : config.problems()) all += (all.empty() ? "" : "; ") + problem;
  if (!all.empty()) throw InputError(all);
}

}  // namespace stairwell::apps
