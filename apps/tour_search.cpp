#include "apps/tour_search.hpp"

#include "coverage3d/tour.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace stairwell::apps {

namespace {

constexpr double kEvenly = 0.05;     // weight of all tours together against the longest
constexpr double kMissing_s = 30.0;  // cost of a hundredth of the targets that is not seen: at first
constexpr double kMissingEnd_s = 60.0;
constexpr std::size_t kBeside = 30;
constexpr std::size_t kTries = 4;
constexpr std::size_t kStretch = 3;  // most stops that move together

}  // namespace

TourSearch::TourSearch(TourModel& model, Rng rng) : model_(model), rng_(rng), union_(model.views().words()) {
  const TrueViews& views = model.views();
  const KnownRoads& roads = model.roads();
  beside_.resize(views.places());
  std::vector<std::pair<double, std::uint32_t>> near;
  for (std::size_t a = 0; a < views.places(); ++a) {
    near.clear();
    for (std::uint32_t b = 0; b < views.places(); ++b)
      if (b != a && roads.straight(a, b)) near.emplace_back((roads.point_m(b) - roads.point_m(a)).norm(), b);
    std::ranges::sort(near);
    for (std::size_t i = 0; i < std::min(kBeside, near.size()); ++i) beside_[a].push_back(near[i].second);
  }
}

std::size_t TourSearch::below(std::size_t count) {
  return std::min(count - 1, static_cast<std::size_t>(rng_.uniform() * static_cast<double>(count)));
}

Tours TourSearch::order(const std::vector<TrueViews::Pose>& poses) const {
  coverage3d::TourProblem problem;
  problem.promptness = 0.0;
  problem.ready_s.assign(model_.uavs(), 0.0);
  const auto row = [&](std::size_t from) {
    std::vector<double> times_s;
    for (const TrueViews::Pose& to : poses) times_s.push_back(model_.roads().cruise_s(from, to.place));
    return times_s;
  };
  for (std::size_t k = 0; k < model_.uavs(); ++k) problem.start_s.push_back(row(model_.start(k).place));
  for (const TrueViews::Pose& from : poses) problem.between_s.push_back(row(from.place));
  const auto plan = coverage3d::plan_tours(problem);
  Tours tours(model_.uavs());
  for (std::size_t k = 0; k < plan.size(); ++k)
    for (const std::size_t stop : plan[k]) tours[k].push_back(poses[stop]);
  return tours;
}

double TourSearch::longest_s(const Tours& tours) {
  double longest_s = 0.0;
  for (std::size_t k = 0; k < tours.size(); ++k) longest_s = std::max(longest_s, model_.tour_s(k, tours[k]));
  return longest_s;
}

std::size_t TourSearch::seen(const Tours& tours) {
  std::ranges::fill(union_, std::uint64_t{0});
  for (std::size_t k = 0; k < tours.size(); ++k) model_.see(k, tours[k], union_.data());
  return std::accumulate(union_.begin(), union_.end(), std::size_t{0}, [](std::size_t sum, std::uint64_t word) {
    return sum + static_cast<std::size_t>(std::popcount(word));
  });
}

double TourSearch::time_cost(const std::vector<double>& time_s) const {
  return *std::ranges::max_element(time_s) + kEvenly * std::accumulate(time_s.begin(), time_s.end(), 0.0);
}

double TourSearch::missing_cost(std::size_t seen, std::size_t wanted, double per_share_s) const {
  if (seen >= wanted) return 0.0;
  return per_share_s * 100.0 * static_cast<double>(wanted - seen) / static_cast<double>(model_.views().targets());
}

/// The stops that a UAV has in the proposal.
Tour& TourSearch::change(const Tours& tours, std::size_t uav) {
  for (std::size_t i = 0; i < changed_.size(); ++i)
    if (changed_[i] == uav) return proposed_[i];
  changed_.push_back(uav);
  proposed_.resize(std::max(proposed_.size(), changed_.size()));
  proposed_[changed_.size() - 1] = tours[uav];
  return proposed_[changed_.size() - 1];
}

bool TourSearch::pick_stop(const Tours& tours, Stop& stop) {
  std::size_t stops = 0;
  for (const Tour& tour : tours) stops += tour.size();
  if (stops == 0) return false;
  std::size_t nth = below(stops);
  for (stop.uav = 0; nth >= tours[stop.uav].size(); ++stop.uav) nth -= tours[stop.uav].size();
  stop.at = nth;
  return true;
}

bool TourSearch::shift(const Tours& tours) {
  Stop stop{};
  if (!pick_stop(tours, stop)) return false;
  const TrueViews::Pose present = tours[stop.uav][stop.at];
  const auto& beside = beside_[present.place];
  if (beside.empty()) return false;
  TrueViews::Pose& pose = change(tours, stop.uav)[stop.at];
  pose.place = beside[below(beside.size())];
  if (model_.views().yaws() > 1 && rng_.uniform() < 0.3)
    pose.yaw = (present.yaw + rng_.uniform_int(-2, 2) + model_.views().yaws()) % model_.views().yaws();
  return true;
}

bool TourSearch::turn(const Tours& tours) {
  Stop stop{};
  const int yaws = model_.views().yaws();
  if (yaws == 1 || !pick_stop(tours, stop)) return false;
  TrueViews::Pose& pose = change(tours, stop.uav)[stop.at];
  pose.yaw = rng_.uniform() < 0.7 ? (pose.yaw + rng_.uniform_int(-3, 3) + yaws) % yaws : rng_.uniform_int(0, yaws - 1);
  return true;
}

bool TourSearch::leave_out(const Tours& tours) {
  Stop stop{};
  if (!pick_stop(tours, stop)) return false;
  Tour& tour = change(tours, stop.uav);
  tour.erase(tour.begin() + static_cast<std::ptrdiff_t>(stop.at));
  return true;
}

/// Where a pose lengthens a tour least, by the ways alone.
TourSearch::Stop TourSearch::cheapest_stop(const Tours& tours, const TrueViews::Pose& pose) {
  const KnownRoads& roads = model_.roads();
  Stop best{tours.size(), 0};
  double least_s = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < tours.size(); ++k) {
    std::uint32_t before = model_.start(k).place;
    for (std::size_t i = 0; i <= tours[k].size(); ++i) {
      double more_s = roads.cruise_s(before, pose.place);
      if (i < tours[k].size()) {
        const std::uint32_t after = tours[k][i].place;
        more_s += roads.cruise_s(pose.place, after) - roads.cruise_s(before, after);
        before = after;
      }
      if (!(more_s < least_s)) continue;
      least_s = more_s;
      best = {k, i};
    }
  }
  return best;
}

bool TourSearch::look_at_missing(const State& state) {
  const TrueViews& views = model_.views();
  std::size_t target = below(views.targets());
  if (state.seen < views.targets()) {
    std::ranges::fill(union_, std::uint64_t{0});
    for (const auto& sights : state.sights)
      for (std::size_t i = 0; i < union_.size(); ++i) union_[i] |= sights[i];
    std::size_t tries = 0;
    for (; (union_[target / 64] >> (target % 64) & 1u) != 0 && tries < views.targets(); ++tries)
      target = (target + 1) % views.targets();
  }
  const auto& viewers = views.viewers(target);
  if (viewers.empty()) return false;
  const TrueViews::Viewer& viewer = viewers[below(viewers.size())];
  const int nth = rng_.uniform_int(0, std::popcount(viewer.yaws) - 1);
  std::uint32_t yaws = viewer.yaws;
  for (int i = 0; i < nth; ++i) yaws &= yaws - 1;
  const TrueViews::Pose pose{viewer.place, std::countr_zero(yaws)};
  Stop stop{};
  if (rng_.uniform() < 0.4) {  // instead of another
    if (!pick_stop(state.tours, stop)) return false;
    Tour& tour = change(state.tours, stop.uav);
    tour.erase(tour.begin() + static_cast<std::ptrdiff_t>(stop.at));
  }
  stop = cheapest_stop(state.tours, pose);
  if (stop.uav == state.tours.size()) return false;
  Tour& tour = change(state.tours, stop.uav);
  tour.insert(tour.begin() + static_cast<std::ptrdiff_t>(std::min(stop.at, tour.size())), pose);
  return true;
}

/// What a stretch costs before stop `at` of a tour, by the ways alone.
double TourSearch::detour_s(std::size_t uav, const Tour& tour, std::size_t at, const Tour& stretch) const {
  const KnownRoads& roads = model_.roads();
  const std::uint32_t before = at == 0 ? model_.start(uav).place : tour[at - 1].place;
  const double there_s = roads.cruise_s(before, stretch.front().place);
  if (at == tour.size()) return there_s;
  return there_s + roads.cruise_s(stretch.back().place, tour[at].place) - roads.cruise_s(before, tour[at].place);
}

/// To the best of a few places.
bool TourSearch::move_stretch(const Tours& tours) {
  Stop stop{};
  if (!pick_stop(tours, stop)) return false;
  Tour& from = change(tours, stop.uav);
  const auto first = from.begin() + static_cast<std::ptrdiff_t>(stop.at);
  const std::size_t most = std::min(kStretch, from.size() - stop.at);
  Tour stretch(first, first + static_cast<std::ptrdiff_t>(1 + below(most)));
  from.erase(first, first + static_cast<std::ptrdiff_t>(stretch.size()));
  if (rng_.uniform() < 0.5) std::ranges::reverse(stretch);
  const std::size_t uav = tours.size() > 1 && rng_.uniform() < 0.5 ? below(tours.size()) : stop.uav;
  Tour& to = change(tours, uav);
  std::size_t best = below(to.size() + 1);
  double least_s = detour_s(uav, to, best, stretch);
  for (std::size_t i = 1; i < kTries; ++i) {
    const std::size_t at = below(to.size() + 1);
    const double more_s = detour_s(uav, to, at, stretch);
    if (!(more_s < least_s)) continue;
    least_s = more_s;
    best = at;
  }
  to.insert(to.begin() + static_cast<std::ptrdiff_t>(best), stretch.begin(), stretch.end());
  return true;
}

/// So that a stop is followed by the nearest of a few others.
bool TourSearch::reverse(const Tours& tours) {
  Stop stop{};
  if (!pick_stop(tours, stop)) return false;
  Tour& tour = change(tours, stop.uav);
  std::size_t nearest = stop.at;
  double least_s = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kTries; ++i) {
    const std::size_t other = below(tour.size());
    const double apart_s = model_.roads().cruise_s(tour[stop.at].place, tour[other].place);
    if (other == stop.at || apart_s >= least_s) continue;
    least_s = apart_s;
    nearest = other;
  }
  if (nearest == stop.at) return false;
  const auto [lo, hi] = std::minmax(nearest, stop.at);
  const bool from_lo = rng_.uniform() < 0.5;  // which of both keeps its place
  std::reverse(tour.begin() + static_cast<std::ptrdiff_t>(from_lo ? lo + 1 : lo),
               tour.begin() + static_cast<std::ptrdiff_t>(from_lo ? hi + 1 : hi));
  return true;
}

bool TourSearch::swap_ends(const Tours& tours) {
  if (tours.size() < 2) return false;
  const std::size_t a = below(tours.size());
  const std::size_t b = (a + 1 + below(tours.size() - 1)) % tours.size();
  change(tours, a);
  change(tours, b);  // may move what the first call gave
  Tour& one = proposed_[0];
  Tour& other = proposed_[1];
  const auto cut_one = one.begin() + static_cast<std::ptrdiff_t>(below(one.size() + 1));
  const auto cut_other = other.begin() + static_cast<std::ptrdiff_t>(below(other.size() + 1));
  const Tour end_one(cut_one, one.end());
  const Tour end_other(cut_other, other.end());
  one.erase(cut_one, one.end());
  other.erase(cut_other, other.end());
  one.insert(one.end(), end_other.begin(), end_other.end());
  other.insert(other.end(), end_one.begin(), end_one.end());
  return true;
}

bool TourSearch::propose(const State& state) {
  changed_.clear();
  const double pick = rng_.uniform();
  if (pick < 0.28) return shift(state.tours);
  if (pick < 0.46) return turn(state.tours);
  if (pick < 0.56) return leave_out(state.tours);
  if (pick < 0.74) return look_at_missing(state);
  if (pick < 0.88) return move_stretch(state.tours);
  if (pick < 0.95) return reverse(state.tours);
  return swap_ends(state.tours);
}

std::size_t TourSearch::count_seen(const State& state) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < union_.size(); ++i) {
    std::uint64_t word = 0;
    for (const auto& sights : state.sights) word |= sights[i];
    count += static_cast<std::size_t>(std::popcount(word));
  }
  return count;
}

Tours TourSearch::anneal(Tours tours, std::size_t wanted, const Annealing& annealing) {
  State state;
  state.tours = std::move(tours);
  for (std::size_t k = 0; k < state.tours.size(); ++k) {
    state.time_s.push_back(model_.tour_s(k, state.tours[k]));
    state.sights.emplace_back(union_.size(), 0);
    model_.see(k, state.tours[k], state.sights[k].data());
  }
  state.seen = count_seen(state);
  Tours best = state.tours;
  double best_cost = time_cost(state.time_s) + missing_cost(state.seen, wanted, kMissingEnd_s);
  std::vector<std::vector<std::uint64_t>> kept(state.tours.size(), std::vector<std::uint64_t>(union_.size()));
  for (std::size_t n = 0; n < annealing.evaluations; ++n) {
    const double done = static_cast<double>(n) / static_cast<double>(annealing.evaluations);
    const double temperature_s = annealing.from_s * std::pow(annealing.to_s / annealing.from_s, done);
    const double per_share_s = kMissing_s * std::pow(kMissingEnd_s / kMissing_s, done);
    const double present = time_cost(state.time_s) + missing_cost(state.seen, wanted, per_share_s);
    const double limit = present - temperature_s * std::log(std::max(1e-300, rng_.uniform()));
    if (!propose(state)) continue;
    const std::vector<double> kept_s = state.time_s;
    for (std::size_t i = 0; i < changed_.size(); ++i)
      state.time_s[changed_[i]] = model_.tour_s(changed_[i], proposed_[i]);
    const double time = time_cost(state.time_s);
    if (!(time <= limit)) {  // however much it sees
      state.time_s = kept_s;
      continue;
    }
    for (std::size_t i = 0; i < changed_.size(); ++i) {
      std::swap(state.sights[changed_[i]], kept[i]);
      std::ranges::fill(state.sights[changed_[i]], std::uint64_t{0});
      model_.see(changed_[i], proposed_[i], state.sights[changed_[i]].data());
    }
    const std::size_t seen = count_seen(state);
    if (!(time + missing_cost(seen, wanted, per_share_s) <= limit)) {
      for (std::size_t i = 0; i < changed_.size(); ++i) std::swap(state.sights[changed_[i]], kept[i]);
      state.time_s = kept_s;
      continue;
    }
    for (std::size_t i = 0; i < changed_.size(); ++i) std::swap(state.tours[changed_[i]], proposed_[i]);
    state.seen = seen;
    const double cost = time + missing_cost(seen, wanted, kMissingEnd_s);
    if (cost < best_cost) {
      best_cost = cost;
      best = state.tours;
    }
  }
  return best;
}

}  // namespace stairwell::apps
