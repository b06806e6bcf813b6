#include "apps/known_tour.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"
#include "coverage3d/tour.hpp"
#include "planning3d/yaw_turn.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stairwell::apps {

namespace {

constexpr double kLook_m = 0.6;   // what is seen on the way is looked at every so far
constexpr double kBend_s = 0.3;   // lost at each pose, by going round its corner
constexpr double kEvenly = 0.05;  // weight of all tours together against the longest
constexpr int kRounds = 6;

double turn_s(const MotionLimits& limits, double turn_rad) {
  return planning3d::YawTurn::to_heading(0.0, wrap_angle(turn_rad), limits.yaw_rate_radps,
                                         limits.yaw_acceleration_radps2)
      .duration_s();
}

}  // namespace

KnownTour::KnownTour(const TrueViews& views, const planning3d::FreeSpace& space, const explore::FleetConfig& config,
                     const std::vector<Eigen::Vector3d>& starts_m, const std::vector<double>& start_yaws_rad)
    : views_(views), space_(space), config_(config), starts_m_(starts_m) {
  for (const double yaw_rad : start_yaws_rad) start_yaws_.push_back(views.yaw_step(yaw_rad));
  tours_.resize(starts_m.size());
}

Eigen::Vector3d KnownTour::place_m(std::size_t place) const {
  return place < views_.places() ? views_.place_m(place) : starts_m_[place - views_.places()];
}

KnownTour::Pose KnownTour::pose_before(std::size_t uav, std::size_t stop) const {
  return stop == 0 ? Pose{start_place(uav), start_yaws_[uav]} : tours_[uav][stop - 1];
}

const KnownTour::Leg& KnownTour::leg(std::size_t from_place, std::size_t to_place) {
  const auto [entry, is_new] = legs_.try_emplace({from_place, to_place});
  Leg& leg = entry->second;
  if (!is_new) return leg;
  planning3d::PlanRequest request;
  request.start_m = place_m(from_place);
  request.goal_m = place_m(to_place);
  request.clearance_weight = 0.0;
  if (from_place == to_place) {
    leg.way_m = {request.start_m, request.goal_m};
    leg.length_m = 0.0;
  } else {
    planning3d::PlanResult way = planner_.plan(space_, request);
    leg.way_m = std::move(way.path_m);
    leg.length_m = way.status == planning3d::PlanStatus::kReached ? way.length_m : 1e6;
  }
  double flown_m = 0.0;
  for (std::size_t i = 1; i < leg.way_m.size(); ++i) {
    const Eigen::Vector3d part_m = leg.way_m[i] - leg.way_m[i - 1];
    const int looks = std::max(1, static_cast<int>(std::lround(part_m.norm() / kLook_m)));
    for (int k = 1; k <= looks; ++k) {
      const double share = static_cast<double>(k) / looks;
      const double part = leg.length_m > 0.0 ? (flown_m + share * part_m.norm()) / leg.length_m : 1.0;
      leg.passed.emplace_back(std::min(part, 1.0), views_.place_near(leg.way_m[i - 1] + share * part_m));
    }
    flown_m += part_m.norm();
  }
  leg.passed.emplace_back(1.0, to_place);
  return leg;
}

double KnownTour::move_s(double way_m, const Pose& from, const Pose& to) const {
  const double move_s = way_m / config_.limits.speed_mps + kBend_s;
  return config_.sensor.panoramic() ? move_s : std::max(move_s, turn_s(config_.limits, to.yaw_rad() - from.yaw_rad()));
}

double KnownTour::leg_s(const Pose& from, const Pose& to) {
  return move_s(leg(from.place, to.place).length_m, from, to);
}

double KnownTour::tour_s(std::size_t uav) {
  double time_s = 0.0;
  for (std::size_t i = 0; i < tours_[uav].size(); ++i) time_s += leg_s(pose_before(uav, i), tours_[uav][i]);
  return time_s;
}

double KnownTour::longest_s() {
  double longest_s = 0.0;
  for (std::size_t k = 0; k < tours_.size(); ++k) longest_s = std::max(longest_s, tour_s(k));
  return longest_s;
}

double KnownTour::cost() {
  double sum_s = 0.0;
  for (std::size_t k = 0; k < tours_.size(); ++k) sum_s += tour_s(k);
  return longest_s() + kEvenly * sum_s;
}

double KnownTour::seen_share() const {
  return static_cast<double>(seen_targets_) / static_cast<double>(std::max<std::size_t>(1, views_.targets()));
}

void KnownTour::count(const Pose& from, const Pose& to, int sign) {
  const double turn_rad = config_.sensor.panoramic() ? 0.0 : wrap_angle(to.yaw_rad() - from.yaw_rad());
  const double turned_by = turn_s(config_.limits, turn_rad) / std::max(leg_s(from, to), 1e-9);
  for (const auto& [part, place] : leg(from.place, to.place).passed) {
    const double turned = turned_by > 0.0 ? std::min(1.0, part / turned_by) : 1.0;
    const int yaw = views_.yaw_step(from.yaw_rad() + turned * turn_rad);
    for (const TrueViews::Sight& sight : views_.sights(place)) {
      if ((sight.yaws >> yaw & 1u) == 0) continue;
      int& times = seen_[sight.target];
      if (times == 0) ++seen_targets_;
      times += sign;
      if (times == 0) --seen_targets_;
    }
  }
}

void KnownTour::recount() {
  seen_.assign(views_.targets(), 0);
  seen_targets_ = 0;
  for (std::size_t k = 0; k < tours_.size(); ++k)
    for (std::size_t i = 0; i < tours_[k].size(); ++i) count(pose_before(k, i), tours_[k][i], 1);
}

/// The legs to and from a stop.
void KnownTour::count_around(std::size_t uav, std::size_t stop, int sign) {
  const std::vector<Pose>& tour = tours_[uav];
  if (stop < tour.size()) count(pose_before(uav, stop), tour[stop], sign);
  if (stop + 1 < tour.size()) count(tour[stop], tour[stop + 1], sign);
}

void KnownTour::replace(std::size_t uav, std::size_t stop, const Pose& pose) {
  count_around(uav, stop, -1);
  tours_[uav][stop] = pose;
  count_around(uav, stop, 1);
}

void KnownTour::erase(std::size_t uav, std::size_t stop) {
  count_around(uav, stop, -1);
  tours_[uav].erase(tours_[uav].begin() + static_cast<std::ptrdiff_t>(stop));
  if (stop < tours_[uav].size()) count(pose_before(uav, stop), tours_[uav][stop], 1);
}

void KnownTour::insert(std::size_t uav, std::size_t stop, const Pose& pose) {
  if (stop < tours_[uav].size()) count(pose_before(uav, stop), tours_[uav][stop], -1);
  tours_[uav].insert(tours_[uav].begin() + static_cast<std::ptrdiff_t>(stop), pose);
  count_around(uav, stop, 1);
}

double KnownTour::saved_s(std::size_t uav, std::size_t stop) {
  const std::vector<Pose>& tour = tours_[uav];
  const Pose before = pose_before(uav, stop);
  const double there_s = leg_s(before, tour[stop]);
  if (stop + 1 == tour.size()) return there_s;
  return there_s + leg_s(tour[stop], tour[stop + 1]) - leg_s(before, tour[stop + 1]);
}

/// From what saves most on; what could not be left out once is not tried again.
void KnownTour::leave_out(double share) {
  std::vector<Pose> needed;
  const auto is_needed = [&](const Pose& pose) {
    return std::ranges::any_of(needed, [&](const Pose& p) { return p.place == pose.place && p.yaw == pose.yaw; });
  };
  for (;;) {
    double most_s = -std::numeric_limits<double>::infinity();
    std::pair<std::size_t, std::size_t> best{tours_.size(), 0};
    for (std::size_t k = 0; k < tours_.size(); ++k)
      for (std::size_t i = 0; i < tours_[k].size(); ++i) {
        if (is_needed(tours_[k][i]) || saved_s(k, i) <= most_s) continue;
        most_s = saved_s(k, i);
        best = {k, i};
      }
    if (best.first == tours_.size()) return;
    const Pose pose = tours_[best.first][best.second];
    erase(best.first, best.second);
    if (seen_share() >= share) continue;
    insert(best.first, best.second, pose);
    needed.push_back(pose);
  }
}

std::vector<KnownTour::Pose> KnownTour::alternatives(std::size_t uav, std::size_t stop) {
  const Pose present = tours_[uav][stop];
  std::vector<Pose> others;
  for (const int turn : {-2, -1, 1, 2})
    if (views_.yaws() > 1) others.push_back({present.place, (present.yaw + turn + views_.yaws()) % views_.yaws()});
  const bool last = stop + 1 == tours_[uav].size();
  const std::size_t before = pose_before(uav, stop).place;
  const std::size_t after = last ? present.place : tours_[uav][stop + 1].place;
  const double present_m = leg(before, present.place).length_m + (last ? 0.0 : leg(present.place, after).length_m);
  for (const std::size_t place : views_.beside(present.place)) {  // only where the way may become shorter
    const double least_m =
        (place_m(place) - place_m(before)).norm() + (last ? 0.0 : (place_m(after) - place_m(place)).norm());
    if (least_m < present_m - 0.05) others.push_back({place, present.yaw});
  }
  return others;
}

void KnownTour::shift(std::size_t uav, std::size_t stop, double share) {
  Pose best = tours_[uav][stop];
  double best_s = cost() - 1e-3;
  for (const Pose& other : alternatives(uav, stop)) {
    const Pose kept = std::exchange(tours_[uav][stop], other);
    const double cost_s = cost();
    tours_[uav][stop] = kept;
    if (cost_s >= best_s) continue;
    replace(uav, stop, other);
    if (seen_share() >= share) {
      best_s = cost_s;
      best = other;
    }
    replace(uav, stop, best);
  }
}

void KnownTour::improve(double share) {
  for (int round = 0; round < kRounds; ++round) {
    const double before_s = cost();
    leave_out(share);
    for (std::size_t k = 0; k < tours_.size(); ++k)
      for (std::size_t i = 0; i < tours_[k].size(); ++i) shift(k, i, share);
    const auto kept = tours_;
    const double kept_s = cost();
    order(all_poses());
    if (seen_share() < share || cost() >= kept_s) {
      tours_ = kept;
      recount();
    }
    if (round > 0 && cost() > before_s - 0.05) return;
  }
}

std::vector<KnownTour::Pose> KnownTour::all_poses() const {
  std::vector<Pose> poses;
  for (const std::vector<Pose>& tour : tours_) poses.insert(poses.end(), tour.begin(), tour.end());
  return poses;
}

/// Geodesic, to every place.
const std::vector<float>& KnownTour::ways_from(std::size_t place) {
  const auto [entry, is_new] = ways_m_.try_emplace(place);
  if (!is_new) return entry->second;
  planning3d::TravelCosts costs;
  costs.compute(space_, place_m(place), planning3d::MotionRule::volume(), std::numeric_limits<double>::infinity(),
                &lattice_);
  for (std::size_t to = 0; to < views_.places(); ++to) entry->second.push_back(costs.distance_m(views_.place_m(to)));
  return entry->second;
}

void KnownTour::order(const std::vector<Pose>& poses) {
  coverage3d::TourProblem problem;
  problem.promptness = 0.0;
  problem.ready_s.assign(starts_m_.size(), 0.0);
  const auto row = [&](const Pose& from) {
    const std::vector<float>& ways_m = ways_from(from.place);
    std::vector<double> times_s;
    for (const Pose& to : poses) {
      const double straight_m = (place_m(to.place) - place_m(from.place)).norm();
      times_s.push_back(move_s(std::max(static_cast<double>(ways_m[to.place]), straight_m), from, to));
    }
    return times_s;
  };
  for (std::size_t k = 0; k < starts_m_.size(); ++k) problem.start_s.push_back(row({start_place(k), start_yaws_[k]}));
  for (const Pose& from : poses) problem.between_s.push_back(row(from));
  for (std::size_t k = 0; k < tours_.size(); ++k) tours_[k].clear();
  const auto plan = coverage3d::plan_tours(problem);
  for (std::size_t k = 0; k < plan.size(); ++k)
    for (const std::size_t stop : plan[k]) tours_[k].push_back(poses[stop]);
  recount();
}

const std::vector<Eigen::Vector3d>& KnownTour::way_m(std::size_t uav, std::size_t stop) {
  return leg(pose_before(uav, stop).place, tours_[uav][stop].place).way_m;
}

}  // namespace stairwell::apps
