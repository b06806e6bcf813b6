#include "coverage3d/agent_strategy.hpp"

#include "core/errors.hpp"
#include "learning/nn/model_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stairwell::coverage3d {
namespace {

constexpr std::size_t kPressingPerUav = 12;
constexpr std::size_t kRestPerUav = 8;
constexpr double kNear_s = 3.0;  // a remainder farther off waits until nothing pressing is left

}  // namespace

std::vector<FrontierStrategy::Stop> AgentStrategy::candidates(const planning3d::FreeSpace& space,
                                                              const AssignmentRequest& request, const Crew& crew,
                                                              const std::vector<Stop>& stops,
                                                              std::vector<bool>& pressing) const {
  const std::vector<Stop> open = unclaimed(request, stops);
  const std::vector<Stop> first = first_of_all(crew, open);
  const auto is_first = [&](const Stop& stop) {
    return std::any_of(first.begin(), first.end(), [&](const Stop& one) { return one.cluster == stop.cluster; });
  };
  std::vector<Stop> found = nearest_of(crew, first, kPressingPerUav, request.workers);
  std::vector<Stop> rest;
  for (const Stop& stop : open)
    if (!is_first(stop) && soonest_s(crew, stop.pose()) < kNear_s) rest.push_back(stop);
  rest = nearest_of(crew, rest, kRestPerUav, request.workers);
  found.insert(found.end(), rest.begin(), rest.end());
  found = without_absorbed(space, crew, found);
  for (const Stop& stop : found) pressing.push_back(is_first(stop));
  return found;
}

OptionScene AgentStrategy::scene_of(const planning3d::FreeSpace& space, const AssignmentRequest& request,
                                    const Crew& crew, std::size_t vehicle, const Assignment& assignment) const {
  OptionScene scene;
  scene.position_m = crew.start_m[vehicle];
  scene.velocity_mps = crew.velocity_mps[vehicle];
  scene.yaw_rad = crew.yaw_rad[vehicle];
  scene.speed_mps = config().limits.speed_mps;
  scene.known_share = std::min(1.0, space.map().known_volume_m3() / config().box.volume_m3());
  for (std::size_t i = 0; i < request.uavs.size(); ++i) {
    if (i == crew.uavs[vehicle]) continue;
    scene.fellows_m.push_back(request.uavs[i].position_m);
    const std::optional<Goal>& goal = assignment.goals[i] ? assignment.goals[i] : request.uavs[i].goal;
    if (goal) scene.fellow_goals_m.push_back(goal->position_m);
  }
  return scene;
}

CoverageOption AgentStrategy::option_of(const Crew& crew, std::size_t vehicle, const Stop& stop) const {
  const Viewpoint& view = stop.pose();
  CoverageOption option;
  option.position_m = view.position_m;
  option.yaw_rad = view.yaw_rad;
  option.time_s = start_s(crew, vehicle, view);
  option.way_m = way_m(vehicle, view);
  for (std::size_t other = 0; other < crew.uavs.size(); ++other)
    if (other != vehicle) option.fellow_s = std::min(option.fellow_s, crew.ready_s[other] + start_s(crew, other, view));
  option.gain_m3 = view.gain_m3;
  option.area_m2 = stop.cluster->area_m2;
  option.seen_fraction = view.seen_fraction;
  option.pocket_m3 = stop.cluster->pocket_m3;
  return option;
}

/// What the vehicle is flying to see, if that is still open; else what it chooses of the rest.
std::size_t AgentStrategy::choose(const Crew& crew, std::size_t vehicle, const std::vector<Stop>& stops,
                                  const std::vector<std::size_t>& left, const Menu& menu, const OptionScene& scene,
                                  double time_s) {
  std::vector<CoverageOption> options;
  std::vector<double> start_times_s;
  std::vector<std::vector<double>> among_s;
  for (const std::size_t i : left) {
    if (crew.target_m[vehicle] && belongs(*stops[i].cluster, *crew.target_m[vehicle])) return i;
    options.push_back(option_of(crew, vehicle, stops[i]));
    options.back().pressing = menu.pressing[i];
    start_times_s.push_back(options.back().time_s);
    among_s.emplace_back();
    for (const std::size_t j : left) among_s.back().push_back(menu.between_s[i][j]);
  }
  const std::vector<double> tours_s = nearest_neighbour_tours_s(start_times_s, among_s);
  for (std::size_t i = 0; i < options.size(); ++i) options[i].tour_s = tours_s[i];
  const std::vector<float> all_rows = option_rows(scene, options);
  const std::vector<std::size_t> listed = short_list(options);
  OptionChoice choice{crew.uavs[vehicle], time_s, {}};
  for (const std::size_t i : listed) {
    const auto row = all_rows.begin() + static_cast<std::ptrdiff_t>(i) * kOptionFeatures;
    choice.rows.insert(choice.rows.end(), row, row + kOptionFeatures);
  }
  return left[listed[chooser_(choice)]];
}

void AgentStrategy::share_out(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                              const std::vector<Stop>& all_stops, Assignment& assignment) {
  Menu menu;
  const std::vector<Stop> stops = candidates(space, request, crew, all_stops, menu.pressing);
  menu.between_s = all_between_s(space, stops, request.workers);
  std::vector<bool> taken(stops.size(), false);
  for (std::size_t k = 0; k < crew.uavs.size(); ++k) {
    const std::size_t uav = crew.uavs[k];
    if (!request.uavs[uav].wants_goal) continue;
    std::vector<std::size_t> left;
    for (std::size_t i = 0; i < stops.size(); ++i)
      if (!taken[i] && std::isfinite(way_m(k, stops[i].pose()))) left.push_back(i);
    if (left.empty()) continue;
    const OptionScene scene = scene_of(space, request, crew, k, assignment);
    const std::size_t chosen = choose(crew, k, stops, left, menu, scene, request.time_s);
    taken[chosen] = true;
    assignment.goals[uav] = goal_for(space, crew, k, stops[chosen], nullptr, request.time_s);
  }
}

OptionChooser load_coverage_agent(const std::filesystem::path& models_dir) {
  const std::filesystem::path file = models_dir / "coverage.model";
  const nn::Model model = nn::read_model(file, "coverage");
  if (model.input != kOptionInput)
    throw InputError(file.string() + ": input '" + model.input + "' where this program shows '" +
                     std::string(kOptionInput) + "'");
  const nn::NetworkSpec& spec = model.network;
  if (!spec.windows.empty() || spec.features != kOptionFeatures || spec.outputs != 1 || spec.head != nn::Head::kValues)
    throw InputError(file.string() + ": a network of another shape than " + std::to_string(kOptionFeatures) +
                     " features and one value");
  return [network = nn::Network(spec, model.parameters)](const OptionChoice& choice) mutable {
    std::vector<float> values(choice.count());
    network.infer_batch(choice.count(), {}, choice.rows, values);
    return static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
  };
}

}  // namespace stairwell::coverage3d
