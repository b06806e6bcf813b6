#include "coverage3d/tour.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stairwell::coverage3d {
namespace {

using Tour = std::vector<std::size_t>;
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr int kRounds = 20;

struct TourTime {
  double end_s = 0.0;
  double arrivals_s = 0.0;
};

TourTime time_of(const TourProblem& problem, std::size_t vehicle, const Tour& tour) {
  TourTime time;
  time.end_s = problem.ready_s[vehicle];
  for (std::size_t i = 0; i < tour.size(); ++i) {
    time.end_s += i == 0 ? problem.start_s[vehicle][tour[0]] : problem.between_s[tour[i - 1]][tour[i]];
    time.arrivals_s += (problem.worth.empty() ? 1.0 : problem.worth[tour[i]]) * time.end_s;
  }
  return time;
}

/// Tours with their times, so that a change of one or two tours is priced without walking the others.
class Plan {
 public:
  explicit Plan(const TourProblem& problem) : problem_(problem), tours_(problem.start_s.size()) {
    for (std::size_t k = 0; k < tours_.size(); ++k) times_.push_back(time_of(problem, k, tours_[k]));
  }
  const std::vector<Tour>& tours() const { return tours_; }
  double cost() const { return price(times_); }
  double cost_with(std::size_t k, const Tour& tour) const {
    std::vector<TourTime> times = times_;
    times[k] = time_of(problem_, k, tour);
    return price(times);
  }
  double cost_with(std::size_t k, const Tour& tour, std::size_t l, const Tour& other) const {
    std::vector<TourTime> times = times_;
    times[k] = time_of(problem_, k, tour);
    times[l] = time_of(problem_, l, other);
    return price(times);
  }
  void set(std::size_t k, Tour tour) {
    tours_[k] = std::move(tour);
    times_[k] = time_of(problem_, k, tours_[k]);
  }

 private:
  double price(const std::vector<TourTime>& times) const {
    double sum = 0.0;
    double longest = 0.0;
    double arrivals = 0.0;
    for (const TourTime& time : times) {
      sum += time.end_s;
      longest = std::max(longest, time.end_s);
      arrivals += time.arrivals_s;
    }
    return sum + problem_.balance * static_cast<double>(times.size()) * longest + problem_.promptness * arrivals;
  }
  const TourProblem& problem_;
  std::vector<Tour> tours_;
  std::vector<TourTime> times_;
};

Tour with(const Tour& tour, std::size_t position, std::size_t stop) {
  Tour longer = tour;
  longer.insert(longer.begin() + static_cast<std::ptrdiff_t>(position), stop);
  return longer;
}

struct Insertion {
  double cost = kNever;
  std::size_t vehicle = 0;
  std::size_t position = 0;
};

void insert_all(const TourProblem& problem, Plan& plan) {
  const std::size_t stops = problem.between_s.size();
  std::vector<bool> done(stops, false);
  for (;;) {
    Insertion chosen;
    std::size_t chosen_stop = stops;
    double chosen_regret = -kNever;
    for (std::size_t stop = 0; stop < stops; ++stop) {
      if (done[stop]) continue;
      Insertion best;
      double second = kNever;
      for (std::size_t k = 0; k < plan.tours().size(); ++k) {
        double here = kNever;
        for (std::size_t i = 0; i <= plan.tours()[k].size(); ++i) {
          const double cost = plan.cost_with(k, with(plan.tours()[k], i, stop));
          here = std::min(here, cost);
          if (cost < best.cost) {
            second = std::min(second, best.cost);
            best = {cost, k, i};
          }
        }
        if (k != best.vehicle) second = std::min(second, here);
      }
      if (!std::isfinite(best.cost)) continue;
      const double regret = plan.tours().size() > 1 && std::isfinite(second) ? second - best.cost : -best.cost;
      if (chosen_stop == stops || regret > chosen_regret) {
        chosen = best;
        chosen_stop = stop;
        chosen_regret = regret;
      }
    }
    if (chosen_stop == stops) return;
    done[chosen_stop] = true;
    plan.set(chosen.vehicle, with(plan.tours()[chosen.vehicle], chosen.position, chosen_stop));
  }
}

bool reverse_stretches(Plan& plan) {
  bool improved = false;
  for (std::size_t k = 0; k < plan.tours().size(); ++k)
    for (std::size_t i = 0; i + 1 < plan.tours()[k].size(); ++i)
      for (std::size_t j = i + 1; j < plan.tours()[k].size(); ++j) {
        Tour turned = plan.tours()[k];
        std::reverse(turned.begin() + static_cast<std::ptrdiff_t>(i),
                     turned.begin() + static_cast<std::ptrdiff_t>(j) + 1);
        if (plan.cost_with(k, turned) < plan.cost() - 1e-6) {
          plan.set(k, std::move(turned));
          improved = true;
        }
      }
  return improved;
}

bool move_one(Plan& plan, std::size_t k, std::size_t i) {
  const std::size_t stop = plan.tours()[k][i];
  Tour shorter = plan.tours()[k];
  shorter.erase(shorter.begin() + static_cast<std::ptrdiff_t>(i));
  Insertion best{plan.cost() - 1e-6, 0, 0};
  bool found = false;
  for (std::size_t l = 0; l < plan.tours().size(); ++l) {
    const Tour& base = l == k ? shorter : plan.tours()[l];
    for (std::size_t j = 0; j <= base.size(); ++j) {
      const Tour longer = with(base, j, stop);
      const double cost = l == k ? plan.cost_with(k, longer) : plan.cost_with(k, shorter, l, longer);
      if (cost >= best.cost) continue;
      best = {cost, l, j};
      found = true;
    }
  }
  if (!found) return false;
  plan.set(k, shorter);
  plan.set(best.vehicle, with(plan.tours()[best.vehicle], best.position, stop));
  return true;
}

bool move_stops(Plan& plan) {
  bool improved = false;
  for (std::size_t k = 0; k < plan.tours().size(); ++k)
    for (std::size_t i = 0; i < plan.tours()[k].size(); ++i) improved = move_one(plan, k, i) || improved;
  return improved;
}

}  // namespace

double tour_cost(const TourProblem& problem, const std::vector<std::vector<std::size_t>>& tours) {
  Plan plan(problem);
  for (std::size_t k = 0; k < tours.size(); ++k) plan.set(k, tours[k]);
  return plan.cost();
}

std::vector<std::vector<std::size_t>> plan_tours(const TourProblem& problem) {
  if (problem.start_s.empty()) return {};
  Plan plan(problem);
  insert_all(problem, plan);
  for (int round = 0; round < kRounds; ++round) {
    const bool turned = reverse_stretches(plan);
    const bool moved = move_stops(plan);
    if (!turned && !moved) break;
  }
  return plan.tours();
}

}  // namespace stairwell::coverage3d
