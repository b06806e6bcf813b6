/// The way back (`--return`, `--battery-min`) and UAVs that are lost (`--lose`).
#include "explore/fleet_impl.hpp"
#include "planning3d/travel_costs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stairwell::explore {

namespace {

constexpr double kHome_m = 0.3;
constexpr int kMostReturns = 20;  // plans in a row that failed, before a UAV lands where it is
constexpr double kRetry_s = 0.5;
constexpr double kCruiseShare = 0.5;  // of the largest speed, on the way home and down
constexpr double kReserve_s = 15.0;
constexpr double kWayHomePeriod_s = 3.0;

}  // namespace

/// In the air above the start.
double Fleet::Impl::lift_to_m(const Uav& uav) const {
  return std::min(uav.vehicle->state().position_m.z() + config.takeoff_height_m,
                  config.task_box.max_m.z() - config.robot.clearance_m());
}

void Fleet::Impl::lose_uavs() {
  for (const Loss& loss : config.losses) {
    if (loss.uav >= uavs.size() || uavs[loss.uav].lost_s || now_s() < loss.at_s) continue;
    Uav& uav = uavs[loss.uav];
    uav.lost_s = now_s();
    ++stats.lost;
    command(uav, pilot.brake(uav, now_s()));
    log.on_event(now_s(), uav.id, "lost", "not_heard_of");
  }
}

/// Not heard of for so long that its task is free for others.
bool Fleet::Impl::forgotten(const Uav& uav) const { return uav.lost_s && now_s() - *uav.lost_s >= config.lost_after_s; }

/// Seconds to be back and down from where it is, without the reserve.
double Fleet::Impl::time_back_s(const Uav& uav) const {
  const double speed_mps = kCruiseShare * config.limits.speed_mps;
  const Eigen::Vector3d at_m = uav.vehicle->state().position_m;
  const double ramps_s = 2.0 * config.limits.speed_mps / config.limits.acceleration_mps2;
  double way_m = at_m.z() - config.task_box.min_m.z();
  if (config.return_to == ReturnTo::kHome) {
    planning3d::TravelCosts costs;
    costs.compute(uav.belief->space(), uav.home_m, uav.belief->strategy->motion_rule(),
                  std::numeric_limits<double>::infinity(), &uav.belief->passable);
    const auto there_m = static_cast<double>(costs.distance_m(at_m));
    way_m = uav.home_m.z() - config.task_box.min_m.z();
    way_m += std::isfinite(there_m) ? there_m : 2.0 * (uav.home_m - at_m).norm();
  }
  return way_m / speed_mps + ramps_s;
}

/// Goes back while what is left of its flying time suffices.
void Fleet::Impl::watch_battery(Uav& uav) {
  if (config.battery_s <= 0.0 || uav.retired() || uav.phase == Phase::kGrounded) return;
  if (now_s() >= uav.way_home_due_s) {
    uav.way_home_s = time_back_s(uav) + kReserve_s;
    uav.way_home_due_s = now_s() + kWayHomePeriod_s;
  }
  const double left_s = config.battery_s - (now_s() - uav.flying_since_s);
  if (left_s > uav.way_home_s + kWayHomePeriod_s) return;
  uav.out_of_battery = true;
  ++stats.out_of_battery;
  log.on_event(now_s(), uav.id, "returns", "battery");
  retire(uav);
}

/// Its exploring is over: its task is free for others.
void Fleet::Impl::retire(Uav& uav) {
  uav.goal.reset();
  uav.idle = true;
  if (config.return_to == ReturnTo::kHome) {
    enter(uav, Phase::kReturn);
    fly_home(uav);
  } else if (config.return_to == ReturnTo::kStay && !uav.out_of_battery) {
    enter(uav, Phase::kDone);
  } else if (uav.at_rest(now_s())) {
    land(uav);
  } else {
    enter(uav, Phase::kReturn);
    command(uav, pilot.brake(uav, now_s()));
  }
}

/// Plans the way home, from flight or at rest; at home, or where no plan comes about, it lands.
void Fleet::Impl::fly_home(Uav& uav) {
  const bool at_rest = uav.at_rest(now_s());
  const bool there = (uav.vehicle->state().position_m - uav.home_m).norm() < kHome_m;
  const bool wanted = config.return_to == ReturnTo::kHome && uav.failed_returns < kMostReturns;
  if (at_rest && (there || !wanted)) return land(uav);
  if (!wanted || now_s() < uav.next_decision_s) return;
  FlightResult flight = pilot.fly_to(uav.belief->space(), uav, uav.home_m, uav.vehicle->state().yaw_rad,
                                     uav.belief->strategy->motion_rule(), fellows_of(uav), depart_time(uav));
  if (flight.outcome == FlightOutcome::kFlying && command(uav, *flight.trajectory)) {
    uav.failed_returns = 0;
    uav.avoiding = uav.on_segment = false;
    avoider.remember_path(uav, std::move(flight.path_m));
    return;
  }
  ++uav.failed_returns;
  if (flight.outcome == FlightOutcome::kFellowInTheWay) make_way(uav, flight.wanted_path_m);
  uav.next_decision_s = now_s() + kRetry_s;
}

/// Where a UAV may come down to without coming too near to fellows below, where they are and where they will be.
double Fleet::Impl::above_fellows_m(const Uav& uav) const {
  const Eigen::Vector3d at_m = uav.vehicle->state().position_m;
  double lowest_m = -std::numeric_limits<double>::infinity();
  for (const Uav& fellow : uavs) {
    if (fellow.id == uav.id) continue;
    const Trajectory& way = fellow.commanded();
    for (const Eigen::Vector3d& there_m : {fellow.vehicle->state().position_m, way.sample(way.end_time_s()).position_m}) {
      const bool aside = (there_m - at_m).head<2>().norm() >= config.fellow_clearance_m;
      if (!aside && there_m.z() < at_m.z()) lowest_m = std::max(lowest_m, there_m.z() + config.fellow_clearance_m);
    }
  }
  return lowest_m;
}

/// Down as far as the map shows free space and no fellow is below. UAVs that started in the air stay there, unless the battery is empty.
void Fleet::Impl::land(Uav& uav) {
  const bool lands = uav.took_off || uav.out_of_battery;
  const Eigen::Vector3d at_m = uav.vehicle->state().position_m;
  const planning3d::FreeSpace free = uav.belief->space();
  VoxelIndex v = free.grid().index_of(at_m);
  double to_z_m = at_m.z();
  const double lowest_m = above_fellows_m(uav);
  while (lands && free.traversable(v - VoxelIndex{0, 0, 1})) {
    if (free.grid().center_of(v - VoxelIndex{0, 0, 1}).z() < lowest_m) break;
    v = v - VoxelIndex{0, 0, 1};
    to_z_m = free.grid().center_of(v).z();
  }
  const auto descent = pilot.vertical(free, uav, to_z_m, now_s(), true);
  const bool moving = lands && at_m.z() - to_z_m > 0.05 && descent && command(uav, *descent);
  enter(uav, moving ? Phase::kLand : Phase::kDone);
}

}  // namespace stairwell::explore
