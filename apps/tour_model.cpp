#include "apps/tour_model.hpp"

#include "apps/tour_flight.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace stairwell::apps {

namespace {

constexpr double kLook_m = 0.5;          // what is seen on the way is looked at every so far
constexpr int kLookYaws = 2;             // and every so many steps of the yaw
constexpr double kMostRound_m = 1.5;     // so far before and behind a corner its rounding reaches, as in tour_flight
constexpr double kRound = 0.5;           // radius of the rounding of a right angle, of that
constexpr double kSharp = -0.3;          // cosine from which on the UAV stops at a corner, as in tour_flight
constexpr std::size_t kLegs = 1u << 13;  // kept

constexpr int kTurnParts = 32;  // times in a turn whose headings are known

}  // namespace

TourModel::TourModel(const TrueViews& views, const KnownRoads& roads, const MotionLimits& limits,
                     const std::vector<double>& start_yaws_rad)
    : views_(views),
      roads_(roads),
      limits_(limits),
      legs_(kLegs),
      leg_sights_(kLegs * views.words()),
      trusted_(views.words(), ~std::uint64_t{0}) {
  for (const double yaw_rad : start_yaws_rad) start_yaws_.push_back(views.yaw_step(yaw_rad));
  for (int step = 0; step < views.yaws(); ++step) {
    const auto turn = tour_turn(limits, 0.0, TrueViews::yaw_rad(step));
    turn_s_.push_back(turn.duration_s());
    for (int part = 0; part <= kTurnParts; ++part)
      turned_.push_back(static_cast<float>(turn.at(turn.duration_s() * part / kTurnParts).turned_rad));
  }
}

double TourModel::turn_s(int from_yaw, int to_yaw) const {
  return turn_s_[static_cast<std::size_t>((to_yaw - from_yaw + views_.yaws()) % views_.yaws())];
}

/// What slowing down for a corner and speeding up behind it costs.
double TourModel::corner_s(const Eigen::Vector3f& before_m, const Eigen::Vector3f& after_m) const {
  const double before_norm_m = static_cast<double>(before_m.norm());
  const double after_norm_m = static_cast<double>(after_m.norm());
  const double round_m = kRound * std::min({kMostRound_m, 0.5 * before_norm_m, 0.5 * after_norm_m});
  const double v = limits_.speed_mps;
  const double a = limits_.acceleration_mps2;
  const double cosine = static_cast<double>(before_m.dot(after_m)) / (before_norm_m * after_norm_m);
  double through_mps = 0.0;
  if (cosine > kSharp) {
    const double tangent = std::sqrt(std::max(0.0, 1.0 - cosine) / (1.0 + cosine));  // of half the turn
    through_mps = tangent > 1e-6 ? std::min(v, std::sqrt(a * round_m / tangent)) : v;
  }
  return (v - through_mps) * (v - through_mps) / (v * a);
}

std::size_t TourModel::leg(const TrueViews::Pose& from, const TrueViews::Pose& to) {
  const auto yaws = static_cast<std::uint64_t>(views_.yaws());
  const std::uint64_t first = from.place * yaws + static_cast<std::uint64_t>(from.yaw);
  const std::uint64_t second = to.place * yaws + static_cast<std::uint64_t>(to.yaw);
  const std::uint64_t key = first << 32 | second;
  const std::size_t slot = (key * 0x9e3779b97f4a7c15ULL >> 40) % kLegs;
  Leg& leg = legs_[slot];
  if (leg.key != key) {
    leg.key = key;
    leg.looked = false;
    measure(from, to, leg);
  }
  return slot;
}

void TourModel::measure(const TrueViews::Pose& from, const TrueViews::Pose& to, Leg& leg) {
  double duration_s = roads_.cruise_s(from.place, to.place);
  leg.first_m = leg.last_m = Eigen::Vector3f::Zero();
  roads_.way(from.place, to.place, way_);
  for (std::size_t i = 1; i < way_.size(); ++i) {
    const Eigen::Vector3f part_m = (roads_.point_m(way_[i]) - roads_.point_m(way_[i - 1])).cast<float>();
    if (i == 1) leg.first_m = part_m;
    if (i > 1) duration_s += corner_s(leg.last_m, part_m);
    leg.last_m = part_m;
  }
  leg.duration_s = static_cast<float>(std::max(duration_s, turn_s(from.yaw, to.yaw)));
}

double TourModel::tour_s(std::size_t uav, const Tour& tour) {
  if (tour.empty()) return 0.0;
  const double start_s = 0.5 * limits_.speed_mps / limits_.acceleration_mps2;  // lost by speeding up, and by braking
  double time_s = 0.0;
  TrueViews::Pose from = start(uav);
  Eigen::Vector3f before_m = Eigen::Vector3f::Zero();
  for (const TrueViews::Pose& to : tour) {
    const Leg& next = legs_[leg(from, to)];
    const bool before_rests = before_m.isZero();
    const bool next_rests = next.first_m.isZero();
    if (before_rests != next_rests) {
      time_s += start_s;
    } else if (!before_rests) {
      time_s += corner_s(before_m, next.first_m);
    }
    time_s += static_cast<double>(next.duration_s);
    before_m = next.last_m;
    from = to;
  }
  return time_s;
}

void TourModel::look(const TrueViews::Pose& from, const TrueViews::Pose& to, std::uint64_t* seen) {
  const int yaws = views_.yaws();
  const int turn = (to.yaw - from.yaw + yaws) % yaws;
  const float* turned_rad = &turned_[static_cast<std::size_t>(turn * (kTurnParts + 1))];
  roads_.way(from.place, to.place, way_);
  double length_m = 0.0;
  for (std::size_t i = 1; i < way_.size(); ++i)
    length_m += (roads_.point_m(way_[i]) - roads_.point_m(way_[i - 1])).norm();
  const double cruise_s = roads_.cruise_s(from.place, to.place);
  const double full_turn_s = turn_s(from.yaw, to.yaw);
  const double ahead = full_turn_s > 0.0 ? std::max(cruise_s, full_turn_s) / full_turn_s : 0.0;
  const int looks =
      std::max({1, static_cast<int>(std::ceil(length_m / kLook_m)), std::min(turn, yaws - turn) / kLookYaws});
  std::size_t part = 1;
  double flown_m = 0.0;
  TrueViews::Around last_around{~std::uint32_t{0}, 0};
  int last_yaw = 0;
  for (int k = 1; k < looks; ++k) {
    const double share = static_cast<double>(k) / looks;
    double part_m = (roads_.point_m(way_[part]) - roads_.point_m(way_[part - 1])).norm();
    while (part + 1 < way_.size() && share * length_m > flown_m + part_m) {
      flown_m += part_m;
      ++part;
      part_m = (roads_.point_m(way_[part]) - roads_.point_m(way_[part - 1])).norm();
    }
    const double along = part_m > 0.0 ? (share * length_m - flown_m) / part_m : 0.0;
    const Eigen::Vector3d at_m =
        roads_.point_m(way_[part - 1]) + along * (roads_.point_m(way_[part]) - roads_.point_m(way_[part - 1]));
    const auto turn_part = static_cast<std::size_t>(std::lround(std::min(1.0, share * ahead) * kTurnParts));
    const int turned = views_.yaw_step(static_cast<double>(turned_rad[turn_part]));
    const TrueViews::Around around = views_.around(at_m);
    const int yaw = (from.yaw + turned) % yaws;
    if (around == last_around && yaw == last_yaw) continue;
    last_around = around;
    last_yaw = yaw;
    const TrueViews::Sight one = views_.sight({around.nearest, yaw});
    const TrueViews::Sight other = views_.sight({around.opposite, yaw});
    for (std::size_t i = std::max(one.begin, other.begin); i < std::min(one.end, other.end); ++i)
      seen[i] |= one.word[i - one.begin] & other.word[i - other.begin];
  }
  for (std::size_t i = 0; i < trusted_.size(); ++i) seen[i] &= trusted_[i];
  views_.sight(to).add_to(seen);
}

void TourModel::see(std::size_t uav, const Tour& tour, std::uint64_t* seen) {
  const std::size_t words = views_.words();
  TrueViews::Pose from = start(uav);
  views_.sight({views_.around(roads_.point_m(from.place)).nearest, from.yaw}).add_to(seen);
  for (const TrueViews::Pose& to : tour) {
    const std::size_t slot = leg(from, to);
    std::uint64_t* sights = &leg_sights_[slot * words];
    if (!legs_[slot].looked) {
      std::fill(sights, sights + words, std::uint64_t{0});
      look(from, to, sights);
      legs_[slot].looked = true;
    }
    for (std::size_t i = 0; i < words; ++i) seen[i] |= sights[i];
    from = to;
  }
}

void TourModel::distrust(const Tours& tours, const std::vector<std::uint64_t>& missed) {
  std::vector<std::uint64_t> seen(trusted_.size(), 0);
  for (std::size_t k = 0; k < tours.size(); ++k) see(k, tours[k], seen.data());
  for (std::size_t i = 0; i < trusted_.size(); ++i) trusted_[i] &= ~(seen[i] & missed[i]);
  for (Leg& leg : legs_) leg.looked = false;
}

std::vector<Eigen::Vector3d> TourModel::way_m(std::size_t uav, const Tour& tour, std::size_t stop) const {
  const TrueViews::Pose from = stop == 0 ? start(uav) : tour[stop - 1];
  std::vector<std::uint32_t> way;
  roads_.way(from.place, tour[stop].place, way);
  std::vector<Eigen::Vector3d> way_m;
  for (const std::uint32_t point : way) way_m.push_back(roads_.point_m(point));
  return way_m;
}

}  // namespace stairwell::apps
