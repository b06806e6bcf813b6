#include "coverage3d/frontier_strategy.hpp"

#include "coverage3d/tour.hpp"
#include "coverage3d/unknown_room.hpp"
#include "mapping/worker_pool.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

namespace stairwell::coverage3d {
namespace {

constexpr std::size_t kStopsPerUav = 12;
constexpr std::size_t kMostStops = 36;
constexpr int kNewFields = 5;
constexpr std::size_t kGivenKept = 64;
constexpr double kCostsKept_s = 2.0;  // ways of a UAV that flies to its goal are measured again after this
constexpr double kLarge_m3 = 5e4;     // in larger boxes long ways are estimated
constexpr double kUseful = 0.25;      // a goal is dropped when less of its cells is left
constexpr double kBelievedDepth_m = 1.0;
constexpr double kMostWorth_m3 = 40.0;       // a larger gain does not make a stop more urgent, ...
constexpr double kPanoramicWorth_m3 = 10.0;  // ... nor this for a sensor that sees all round, ...
constexpr double kPromptness = 0.06;         // ... which may take its time; others see much first
constexpr double kAbsorbed = 0.7;            // a cluster seen to this part from another stop needs no stop of its own
constexpr double kMuch_m2 = 0.6;             // in sight of a cluster: such stops come first ...
constexpr double kSome_m2 = 0.3;  // ... then those of this much, then those of less and of shallow pockets ...
constexpr int kRest = 2;
constexpr double kTakenAlong_s = 0.7;        // ... unless they are this near, ...
constexpr double kTakenAlongInSlab_s = 1.5;  // ... or this near where every last one counts
constexpr double kLeftBehind_s = 6.0;        // likewise, what is within this and would be farther away later
constexpr double kOtherWork = 0.5;           // ... or nearer than this part of the way to what others get at sooner
constexpr std::size_t kFewStops = 4;         // a UAV of what comes first; where there are more, all work there
constexpr int kSlabPatience = 2;             // failures of a goal more than else, where every last one counts
constexpr double kSamePlace_m = 0.4;         // margin around a cluster within which a goal's target belongs to it
constexpr std::ptrdiff_t kMostRepeats = 3;

ViewpointConfig viewpoint_config(const CoverageConfig& config) {
  ViewpointConfig views;
  views.sensor = config.sensor;
  views.box = config.box;
  views.gain = config.gain;
  views.occupancy = config.occupancy;
  views.nearest_m = std::max(0.4, config.sensor.min_range_m);
  views.planar = config.finish.has_value();
  views.seed = config.seed;
  return views;
}

}  // namespace

bool FrontierStrategy::belongs(const FrontierCluster& cluster, const Eigen::Vector3d& target_m) {
  return cluster.bounds_m.inflated(kSamePlace_m).contains(target_m);
}

FrontierStrategy::FrontierStrategy(const CoverageConfig& config, bool views_at_layers)
    : config_(config),
      views_at_layers_(views_at_layers),
      book_(viewpoint_config(config)),
      blacklist_(config.blacklist_radius_m, config.blacklist_time_s, config.finish ? kSlabPatience : 0) {
  if (config.finish) finish_.emplace(config.finish->past_walls);
}

const LayerFinder& FrontierStrategy::layer_finder() const { return *layers_; }

planning3d::MotionRule FrontierStrategy::motion_rule() const {
  if (!config_.slice) return planning3d::MotionRule::volume();
  if (!config_.layers_m.empty()) return planning3d::MotionRule::slice(config_.layers_m);
  if (layers_) return planning3d::MotionRule::slice(layers_->layers_m());
  std::vector<double> layers_m;
  LayerConfig defaults;
  for (double z = config_.box.min_m.z() + defaults.above_floor_m; z < config_.box.max_m.z(); z += defaults.spacing_m)
    layers_m.push_back(z);
  if (layers_m.empty()) layers_m.push_back(config_.box.center_m().z());
  return planning3d::MotionRule::slice(std::move(layers_m));
}

void FrontierStrategy::set_up(const planning3d::FreeSpace& space) {
  if (finder_) return;
  FrontierConfig frontiers;
  frontiers.box = config_.box;
  if (config_.finish) frontiers = slab_frontiers(config_.box, config_.finish->lo_m, config_.finish->hi_m);
  finder_.emplace(space.grid(), frontiers);
  LayerConfig layers;
  layers.box = config_.box.intersection(space.flight_box());
  layers_.emplace(space.grid(), layers);
  if (start_height_m_) layers_->set_start_height(*start_height_m_);
}

void FrontierStrategy::refresh(const planning3d::FreeSpace& space, const AssignmentRequest& request) {
  if (!start_height_m_ && !request.uavs.empty()) start_height_m_ = request.uavs.front().position_m.z();
  set_up(space);
  finder_->update(space.map(), request.workers);
  if (finish_) finish_->update(space.map(), *finder_);
  if (!views_at_layers_ || !config_.layers_m.empty()) return;
  if (layers_->update(space.map(), finder_->changed_blocks())) book_.forget();
}

void FrontierStrategy::compute_costs(const planning3d::FreeSpace& space, const AssignmentRequest& request,
                                     const Crew& crew) {
  costs_.resize(crew.uavs.size());
  const Eigen::Vector3d nowhere_m = Eigen::Vector3d::Zero();
  cost_sources_.resize(crew.uavs.size(), {nowhere_m, -kCostsKept_s});
  const planning3d::MotionRule rule = motion_rule();
  std::vector<FarWays::Source> sources;
  for (std::size_t k = 0; k < crew.uavs.size(); ++k) {
    CostSource& source = cost_sources_[k];
    const bool settled = !request.uavs[crew.uavs[k]].wants_goal && (source.start_m - crew.start_m[k]).norm() < 1e-6;
    if (settled && request.time_s - source.time_s < kCostsKept_s) continue;
    source = {crew.start_m[k], request.time_s};
    sources.push_back({crew.start_m[k], &costs_[k]});
  }
  if (sources.empty()) return;
  lattice_.update(space, rule);
  if (!config_.slice && space.grid().box().volume_m3() > kLarge_m3) {
    far_ways_.compute(space, lattice_, sources, request.time_s, crew.uavs.size(), request.workers);
    return;
  }
  mapping::for_each_index(request.workers, sources.size(), [&](std::size_t i) {
    sources[i].costs->compute(space, sources[i].start_m, rule, std::numeric_limits<double>::infinity(), &lattice_);
  });
}

bool FrontierStrategy::reachable(const VoxelIndex& v) const {
  return std::any_of(costs_.begin(), costs_.end(),
                     [&](const planning3d::TravelCosts& costs) { return std::isfinite(costs.distance_m(v)); });
}

ViewpointPlaces FrontierStrategy::places(const AssignmentRequest& request) const {
  ViewpointPlaces places;
  places.reachable = [this](const VoxelIndex& v) { return reachable(v); };
  if (views_at_layers_) places.layers_m = config_.layers_m.empty() ? layers_->layers_m() : config_.layers_m;
  for (const UavView& uav : request.uavs)
    if (uav.shares_map) places.also_m.push_back(uav.position_m);
  return places;
}

/// Nothing where the target promises nothing; without views where it is closed for now.
std::optional<FrontierStrategy::Stop> FrontierStrategy::stop_at(const FrontierCluster& cluster,
                                                                const TargetBook::Target& target, double time_s) const {
  // What a small gap lets through is not believed to be deep: mostly it is the inside of a solid.
  const double believed_m3 = cluster.area_m2 * kBelievedDepth_m;
  const auto rewarding = [&](const Viewpoint& view) {
    return finish_ || std::min(view.gain_m3, believed_m3) >= config_.min_gain_m3;
  };
  if (!target.views.empty() && std::none_of(target.views.begin(), target.views.end(), rewarding)) return std::nullopt;
  Stop stop{&cluster, {}, 0};
  for (const Viewpoint& view : target.views) {
    if (rewarding(view) && !blacklist_.blocks_place(view.position_m, time_s)) stop.views.push_back(&view);
  }
  if (blacklist_.blocks_target(cluster, time_s)) stop.views.clear();
  return stop;
}

std::vector<FrontierStrategy::Stop> FrontierStrategy::open_stops(const AssignmentRequest& request,
                                                                 std::size_t& closed) const {
  std::vector<std::pair<const FrontierCluster*, const TargetBook::Target*>> all;
  all.reserve(book_.targets().size());
  auto beside = finder_->clusters().begin();  // both are in the order of ids
  for (const auto& [id, target] : book_.targets()) {
    while (beside->first < id) ++beside;
    if (!finish_ || finish_->counts(id)) all.emplace_back(&beside->second, &target);
  }
  std::vector<std::optional<Stop>> found(all.size());
  mapping::for_each_index_in_parts(request.workers, all.size(), [&](std::size_t i) {
    found[i] = stop_at(*all[i].first, *all[i].second, request.time_s);
  });
  std::vector<Stop> stops;
  closed = 0;
  for (std::optional<Stop>& stop : found) {
    if (!stop) continue;
    if (stop->views.empty()) {
      ++closed;
    } else {
      stops.push_back(std::move(*stop));
    }
  }
  return stops;
}

void FrontierStrategy::choose_poses(const AssignmentRequest& request, const Crew& crew,
                                    std::vector<Stop>& stops) const {
  mapping::for_each_index_in_parts(request.workers, stops.size(), [&](std::size_t at) {
    Stop& stop = stops[at];
    double best_s = std::numeric_limits<double>::infinity();
    for (std::size_t i = stop.view; i < stop.views.size(); ++i) {
      const Viewpoint& view = *stop.views[i];
      const double cost_s = soonest_s(crew, view) + price_s(stop, view);
      if (cost_s >= best_s) continue;
      best_s = cost_s;
      stop.view = i;
    }
  });
}

int FrontierStrategy::rank(const Stop& stop) const {
  const double seen_m2 = finder_->deep(*stop.cluster) ? stop.cluster->area_m2 * stop.pose().seen_fraction : 0.0;
  return seen_m2 >= kMuch_m2 ? 0 : seen_m2 >= kSome_m2 ? 1 : kRest;
}

/// The stops that come first: of those with much in sight of a deep cluster, or else with some, or else of all. What is
/// near is taken along.
std::vector<FrontierStrategy::Stop> FrontierStrategy::first_of_all(const Crew& crew,
                                                                   const std::vector<Stop>& stops) const {
  const double near_s = finish_ ? kTakenAlongInSlab_s : kTakenAlong_s;
  int least = kRest;
  for (const Stop& stop : stops) least = std::min(least, rank(stop));
  std::vector<Stop> first;
  std::vector<std::pair<double, const Stop*>> later;
  for (const Stop& stop : stops) {
    const double now_s = rank(stop) == least ? 0.0 : soonest_s(crew, stop.pose());
    if (now_s < near_s) {
      first.push_back(stop);
    } else {
      later.emplace_back(now_s, &stop);
    }
  }
  if (!finish_) {
    if (config_.sensor.panoramic() && first.size() < kFewStops * crew.uavs.size()) add_for_others(crew, later, first);
    return first;
  }
  // Where every last one counts, what nothing that comes first leads nearer to is not left behind.
  const std::size_t leading = first.size();
  for (const auto& entry : later) {
    const double soonest = entry.first;
    const Stop* const stop = entry.second;
    const double reach_m = soonest * config_.limits.speed_mps;
    const bool led_to = std::any_of(
        first.begin(), first.begin() + static_cast<std::ptrdiff_t>(leading),
        [&](const Stop& other) { return (other.pose().position_m - stop->pose().position_m).norm() < reach_m; });
    if (soonest < kLeftBehind_s && !led_to) first.push_back(*stop);
  }
  return first;
}

/// A UAV that is the soonest at none of what comes first, and far from it, does not follow the others: it gets on with
/// what else it is the soonest at. A camera had better help them, for it sees much less of a room on its way.
void FrontierStrategy::add_for_others(const Crew& crew, const std::vector<std::pair<double, const Stop*>>& later,
                                      std::vector<Stop>& first) const {
  const std::size_t uavs = crew.uavs.size();
  const auto there_s = [&](std::size_t k, const Stop& stop) { return crew.ready_s[k] + start_s(crew, k, stop.pose()); };
  std::vector<double> least_s(uavs, std::numeric_limits<double>::infinity());
  std::vector<bool> leads(uavs, false);
  for (const Stop& stop : first) {
    std::size_t soonest = 0;
    double soonest_s = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < uavs; ++k) {
      const double time_s = there_s(k, stop);
      least_s[k] = std::min(least_s[k], time_s);
      if (time_s >= soonest_s) continue;
      soonest_s = time_s;
      soonest = k;
    }
    leads[soonest] = true;
  }
  for (const auto& [soonest_s, stop] : later) {
    for (std::size_t k = 0; k < uavs; ++k) {
      if (leads[k] || soonest_s >= kOtherWork * least_s[k] || there_s(k, *stop) > soonest_s) continue;
      first.push_back(*stop);
      break;
    }
  }
}

std::vector<FrontierStrategy::Stop> FrontierStrategy::unclaimed(const AssignmentRequest& request,
                                                                const std::vector<Stop>& stops) {
  std::vector<Stop> unclaimed;
  for (const Stop& stop : stops) {
    const bool claimed = std::any_of(request.uavs.begin(), request.uavs.end(), [&](const UavView& uav) {
      return !uav.wants_goal && uav.goal && belongs(*stop.cluster, uav.goal->target_m);
    });
    if (!claimed) unclaimed.push_back(stop);
  }
  return unclaimed;
}

std::vector<FrontierStrategy::Stop> FrontierStrategy::nearest_of(const Crew& crew, const std::vector<Stop>& stops,
                                                                 std::size_t per_uav,
                                                                 mapping::WorkerPool* workers) const {
  std::vector<std::vector<std::pair<double, std::size_t>>> orders(crew.uavs.size());
  mapping::for_each_index(workers, orders.size(), [&](std::size_t k) {
    for (std::size_t i = 0; i < stops.size(); ++i) {
      const double time_s = start_s(crew, k, stops[i].pose());
      if (std::isfinite(time_s)) orders[k].emplace_back(time_s, i);
    }
    std::sort(orders[k].begin(), orders[k].end());
  });
  std::set<std::size_t> chosen;
  for (std::size_t rank = 0; rank < per_uav; ++rank) {  // in turns: the first UAVs shall not take all the room
    for (const auto& order : orders) {
      if (rank < order.size() && chosen.size() < kMostStops) chosen.insert(order[rank].second);
    }
  }
  std::vector<Stop> nearest;
  nearest.reserve(chosen.size());
  for (const std::size_t i : chosen) nearest.push_back(stops[i]);
  return nearest;
}

std::vector<FrontierStrategy::Stop> FrontierStrategy::without_absorbed(const planning3d::FreeSpace& space,
                                                                       const Crew& crew,
                                                                       const std::vector<Stop>& stops) const {
  std::vector<std::pair<double, std::size_t>> order;  // large and near ones absorb the others
  for (std::size_t i = 0; i < stops.size(); ++i) {
    order.emplace_back(soonest_s(crew, stops[i].pose()) - 2.0 * std::min(stops[i].cluster->area_m2, 2.0), i);
  }
  std::sort(order.begin(), order.end());
  std::vector<Stop> kept;
  for (const auto& ranked : order) {
    const Stop& stop = stops[ranked.second];
    const bool absorbed = std::any_of(kept.begin(), kept.end(), [&](const Stop& other) {
      return book_.sampler().seen_part(space, other.pose(), *stop.cluster) >= kAbsorbed;
    });
    if (!absorbed) kept.push_back(stop);
  }
  return kept;
}

std::vector<FrontierStrategy::Stop> FrontierStrategy::nearest_stops(const AssignmentRequest& request, const Crew& crew,
                                                                    const std::vector<Stop>& stops) const {
  return nearest_of(crew, first_of_all(crew, unclaimed(request, stops)), kStopsPerUav, request.workers);
}

std::vector<std::vector<double>> FrontierStrategy::all_between_s(const planning3d::FreeSpace& space,
                                                                 const std::vector<Stop>& stops,
                                                                 mapping::WorkerPool* workers) {
  travel_.begin(space, motion_rule(), kNewFields);
  std::vector<TravelBook::Pair> pairs;
  for (std::size_t i = 0; i < stops.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      pairs.emplace_back(stops[i].pose().position_m, stops[j].pose().position_m);
      pairs.emplace_back(stops[j].pose().position_m, stops[i].pose().position_m);
    }
  const std::vector<double> ways_m = travel_.distances_m(space, pairs, workers);
  std::vector<std::vector<double>> times_s(stops.size(), std::vector<double>(stops.size(), 0.0));
  auto way_m = ways_m.begin();
  for (std::size_t i = 0; i < stops.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      times_s[i][j] = between_s(*way_m++, stops[i].pose(), stops[j].pose());
      times_s[j][i] = between_s(*way_m++, stops[j].pose(), stops[i].pose());
    }
  return times_s;
}

/// How urgent a stop is. A camera sees little of what lies behind an opening or up a stairwell before it is there; what
/// may be got at is urgent for the others, who may work there, the more of them there are.
double FrontierStrategy::worth_m3(const planning3d::FreeSpace& space, const Crew& crew, const Stop& stop) const {
  if (config_.sensor.panoramic()) return std::min(stop.pose().gain_m3, kPanoramicWorth_m3);
  const double others = 1.0 - 1.0 / static_cast<double>(crew.uavs.size());
  const double room_m3 = others > 0.0 ? unknown_beyond_m3(space.map(), finder_->box(), *stop.cluster) : 0.0;
  return std::min(stop.pose().gain_m3, kMostWorth_m3) + others * room_m3;
}

std::vector<std::vector<std::size_t>> FrontierStrategy::tours(const planning3d::FreeSpace& space, const Crew& crew,
                                                              const std::vector<Stop>& stops,
                                                              mapping::WorkerPool* workers) {
  TourProblem problem;
  problem.ready_s = crew.ready_s;
  for (std::size_t k = 0; k < crew.uavs.size(); ++k) {
    problem.start_s.emplace_back();
    for (const Stop& stop : stops) {
      problem.start_s.back().push_back(start_s(crew, k, stop.pose()) - commitment_s(crew, k, stop));
    }
  }
  if (!config_.sensor.panoramic()) problem.promptness = kPromptness;
  for (const Stop& stop : stops) problem.worth.push_back(worth_m3(space, crew, stop));
  problem.between_s = all_between_s(space, stops, workers);
  return plan_tours(problem);
}

Goal FrontierStrategy::goal_for(const planning3d::FreeSpace& space, const Crew& crew, std::size_t vehicle,
                                const Stop& stop, const Stop* next, double time_s) {
  std::size_t best = stop.view;
  double best_s = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < stop.views.size(); ++i) {
    const Viewpoint& view = *stop.views[i];
    double cost_s = start_s(crew, vehicle, view) + price_s(stop, view);
    if (next != nullptr) {
      const double way_m = travel_.distance_m(space, view.position_m, next->pose().position_m);
      cost_s += between_s(way_m, view, next->pose());
    }
    if (i < stop.view || cost_s >= best_s) continue;
    best_s = cost_s;
    best = i;
  }
  const Viewpoint& view = *stop.views[best];
  Goal goal;
  goal.position_m = view.position_m;
  goal.yaw_rad = view.yaw_rad;
  goal.target_m = stop.cluster->center_m;
  goal.gain_m3 = view.gain_m3;
  goal.travel_m = static_cast<double>(costs_[crew.ways[vehicle]].distance_m(view.voxel));
  // Sent here again and again although it stands here: whatever is left is not seen from here.
  const auto before = std::count_if(given_.begin(), given_.end(), [&](const GivenGoal& one) {
    return (one.position_m - goal.position_m).norm() < 1e-3 && (one.target_m - goal.target_m).norm() < 1e-3;
  });
  if (before >= kMostRepeats && (crew.start_m[vehicle] - goal.position_m).norm() < 0.2)
    blacklist_.report(goal.position_m, goal.target_m, time_s);
  remember(goal, view.seen_cells);
  return goal;
}

void FrontierStrategy::remember(const Goal& goal, const std::vector<VoxelIndex>& cells) {
  given_.push_back({goal.position_m, goal.target_m, cells});
  if (given_.size() > kGivenKept) given_.pop_front();
}

void FrontierStrategy::share_out(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                                 const std::vector<Stop>& all_stops, Assignment& assignment) {
  if (!config_.turn_taking) return share_out_alone(space, request, crew, all_stops, assignment);
  const std::vector<Stop> stops = without_absorbed(space, crew, nearest_stops(request, crew, all_stops));
  const std::vector<std::vector<std::size_t>> plan = tours(space, crew, stops, request.workers);
  std::vector<bool> taken(stops.size(), false);
  for (std::size_t k = 0; k < plan.size(); ++k) {
    if (!request.uavs[crew.uavs[k]].wants_goal || plan[k].empty()) continue;
    const Stop* const next = plan[k].size() > 1 ? &stops[plan[k][1]] : nullptr;
    assignment.goals[crew.uavs[k]] = goal_for(space, crew, k, stops[plan[k][0]], next, request.time_s);
    taken[plan[k][0]] = true;
  }
  for (std::size_t k = 0; k < plan.size(); ++k) {  // nobody waits while there is a stop that nobody flies to yet
    const std::size_t uav = crew.uavs[k];
    if (!request.uavs[uav].wants_goal || assignment.goals[uav]) continue;
    std::size_t nearest = stops.size();
    double nearest_s = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < stops.size(); ++i) {
      const double time_s = taken[i] ? nearest_s : start_s(crew, k, stops[i].pose());
      if (time_s >= nearest_s) continue;
      nearest_s = time_s;
      nearest = i;
    }
    if (nearest == stops.size()) continue;
    assignment.goals[uav] = goal_for(space, crew, k, stops[nearest], nullptr, request.time_s);
    taken[nearest] = true;
  }
}

Assignment FrontierStrategy::assign(const planning3d::FreeSpace& space, const AssignmentRequest& request) {
  Assignment assignment;
  assignment.goals.resize(request.uavs.size());
  refresh(space, request);
  if (request.uavs.empty()) return assignment;
  const Crew crew = crew_of(request);
  compute_costs(space, request, crew);
  const ViewpointPlaces where = places(request);
  book_.refresh(space, *finder_, where, request.time_s, request.workers);
  std::function<bool(std::uint32_t)> counts;
  if (finish_) counts = [this](std::uint32_t cluster) { return finish_->counts(cluster); };
  std::size_t pending = book_.look(space, *finder_, where, {}, counts, request.workers);
  std::size_t closed = 0;
  std::vector<Stop> stops = open_stops(request, closed);
  while (stops.empty() && pending > 0) {  // before giving up, look at everything
    pending = book_.look(space, *finder_, where, {}, counts, request.workers);
    stops = open_stops(request, closed);
  }
  assignment.open_targets = stops.size();
  assignment.unreachable_targets = closed >= pending ? closed - pending : 0;
  assignment.open_targets += pending;
  stops = near_ones(request, crew, std::move(stops));
  choose_poses(request, crew, stops);
  stops = own_work(space, request, crew, std::move(stops));
  prepare(request, stops);
  share_out(space, request, crew, stops, assignment);
  return assignment;
}

bool FrontierStrategy::still_useful(const planning3d::FreeSpace& space, const Goal& goal) {
  set_up(space);  // a resumed run asks this first
  const auto given = std::find_if(given_.rbegin(), given_.rend(), [&](const GivenGoal& one) {
    return (one.target_m - goal.target_m).norm() < 1e-3 && (one.position_m - goal.position_m).norm() < 1e-3;
  });
  const auto frontier = [&](const VoxelIndex& v) {
    return is_frontier(space.map(), finder_->box(), finder_->config(), v);
  };
  if (given != given_.rend() && !given->cells.empty()) {
    const auto left = std::count_if(given->cells.begin(), given->cells.end(),
                                    [&](const VoxelIndex& v) { return space.map().at(v) == Occupancy::kUnknown; });
    return static_cast<double>(left) >= kUseful * static_cast<double>(given->cells.size());
  }
  const Eigen::Vector3d reach_m = Eigen::Vector3d::Constant(0.5);
  const VoxelIndex lo = space.grid().index_of(goal.target_m - reach_m);
  const VoxelIndex hi = space.grid().index_of(goal.target_m + reach_m);
  for (int z = lo.z; z <= hi.z; ++z)
    for (int y = lo.y; y <= hi.y; ++y)
      for (int x = lo.x; x <= hi.x; ++x)
        if (frontier({x, y, z})) return true;
  return false;
}

void FrontierStrategy::report_failure(const Goal& goal, double time_s) {
  blacklist_.report(goal.position_m, goal.target_m, time_s);
}

}  // namespace stairwell::coverage3d
