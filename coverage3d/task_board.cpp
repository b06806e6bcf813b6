#include "coverage3d/task_board.hpp"

#include "core/errors.hpp"
#include "coverage3d/tour.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace stairwell::coverage3d {
namespace {

constexpr double kEdge_m = 5.0;
constexpr std::size_t kMostCells = 64;
constexpr double kLeastHalved_m = 4.0;  // a shorter edge of a cell is not halved

}  // namespace

TaskBoard::TaskBoard(const Aabb& box, double speed_mps) : speed_mps_(speed_mps) {
  coarse_.min_m = box.min_m;
  for (double edge_m = kEdge_m;; edge_m *= 1.1) {
    for (int axis = 0; axis < 3; ++axis) {
      auto& count = coarse_.count[static_cast<std::size_t>(axis)];
      count = static_cast<std::size_t>(std::max(1.0, std::round(box.size_m()[axis] / edge_m)));
      coarse_.edge_m[axis] = box.size_m()[axis] / static_cast<double>(count);
    }
    if (coarse_.size() <= kMostCells) break;
  }
  fine_ = coarse_;
  for (int axis = 0; axis < 3; ++axis) {
    if (coarse_.edge_m[axis] < kLeastHalved_m) continue;
    fine_.count[static_cast<std::size_t>(axis)] *= 2;
    fine_.edge_m[axis] /= 2.0;
  }
  cells_.resize(coarse_.size());
  parts_.assign(fine_.size(), kNobody);
  count_open_parts();
}

std::size_t TaskBoard::Tiling::at(const Eigen::Vector3d& point_m) const {
  std::array<std::size_t, 3> tile{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto most = static_cast<double>(count[static_cast<std::size_t>(axis)]) - 1.0;
    const double place = std::floor((point_m[axis] - min_m[axis]) / edge_m[axis]);
    tile[static_cast<std::size_t>(axis)] = static_cast<std::size_t>(std::clamp(place, 0.0, most));
  }
  return (tile[2] * count[1] + tile[1]) * count[0] + tile[0];
}

Eigen::Vector3d TaskBoard::Tiling::center_m(std::size_t tile) const {
  const Eigen::Vector3d at(static_cast<double>(tile % count[0]), static_cast<double>(tile / count[0] % count[1]),
                           static_cast<double>(tile / (count[0] * count[1])));
  return min_m + (at + Eigen::Vector3d::Constant(0.5)).cwiseProduct(edge_m);
}

void TaskBoard::count_open_parts() {
  for (Cell& cell : cells_) {
    cell.open_parts = 0;
    cell.open_sum_m.setZero();
  }
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    if (!part_open(part)) continue;
    Cell& cell = cells_[cell_of(part)];
    ++cell.open_parts;
    cell.open_sum_m += part_center_m(part);
  }
}

void TaskBoard::close_part(std::size_t part, std::size_t uav) {
  if (!part_open(part)) return;
  parts_[part] = uav;
  Cell& cell = cells_[cell_of(part)];
  --cell.open_parts;
  cell.open_sum_m -= part_center_m(part);
}

void TaskBoard::reopen_part(std::size_t part) {
  if (part_open(part)) return;
  parts_[part] = kNobody;
  Cell& cell = cells_[cell_of(part)];
  ++cell.open_parts;
  cell.open_sum_m += part_center_m(part);
}

void TaskBoard::claim(std::size_t uav, std::vector<bool> parts) { claims_[uav] = std::move(parts); }

bool TaskBoard::claimed_near(std::size_t part, double radius_m) const {
  const Eigen::Vector3d at_m = part_center_m(part);
  for (const auto& [uav, parts] : claims_) {
    for (std::size_t other = 0; other < parts.size(); ++other) {
      if (parts[other] && part_open(other) && (part_center_m(other) - at_m).norm() <= radius_m) return true;
    }
  }
  return false;
}

Eigen::Vector3d TaskBoard::center_m(std::size_t cell) const {
  const Cell& one = cells_[cell];
  if (one.open_parts == 0) return coarse_.center_m(cell);
  return one.open_sum_m / static_cast<double>(one.open_parts);
}

std::vector<std::size_t> TaskBoard::cells_of(std::size_t uav) const {
  std::vector<std::size_t> cells;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (open(i) && cells_[i].owner == uav) cells.push_back(i);
  }
  return cells;
}

std::vector<std::vector<std::size_t>> TaskBoard::tours(const std::vector<Worker>& workers,
                                                       const std::vector<std::size_t>& cells) const {
  TourProblem problem;
  problem.ready_s.assign(workers.size(), 0.0);
  for (const Worker& worker : workers) {
    problem.start_s.emplace_back();
    for (const std::size_t cell : cells)
      problem.start_s.back().push_back((center_m(cell) - worker.at_m).norm() / speed_mps_);
  }
  for (const std::size_t from : cells) {
    problem.between_s.emplace_back();
    for (const std::size_t to : cells)
      problem.between_s.back().push_back((center_m(to) - center_m(from)).norm() / speed_mps_);
  }
  return plan_tours(problem);
}

double TaskBoard::tour_s(const Worker& worker, const std::vector<std::size_t>& cells) const {
  double way_m = 0.0;
  Eigen::Vector3d at_m = worker.at_m;
  const std::vector<std::vector<std::size_t>> plan = tours({worker}, cells);
  for (const std::size_t stop : plan.front()) {
    way_m += (center_m(cells[stop]) - at_m).norm();
    at_m = center_m(cells[stop]);
  }
  return way_m / speed_mps_;
}

void TaskBoard::share(const std::vector<Worker>& workers) {
  std::vector<std::size_t> cells = cells_of(kNobody);
  for (const Worker& worker : workers) {
    const std::vector<std::size_t> own = cells_of(worker.uav);
    cells.insert(cells.end(), own.begin(), own.end());
  }
  std::sort(cells.begin(), cells.end());
  const auto plan = tours(workers, cells);
  for (std::size_t k = 0; k < plan.size(); ++k)
    for (const std::size_t stop : plan[k]) cells_[cells[stop]].owner = workers[k].uav;
}

bool TaskBoard::take_over(const Worker& idle, const std::vector<Worker>& others) {
  const std::vector<std::size_t> orphans = cells_of(kNobody);
  for (const std::size_t cell : orphans) cells_[cell].owner = idle.uav;
  if (!orphans.empty()) return true;
  std::vector<std::pair<double, std::size_t>> busiest;
  std::vector<std::vector<std::size_t>> lists;
  for (std::size_t k = 0; k < others.size(); ++k) {
    lists.push_back(cells_of(others[k].uav));
    busiest.emplace_back(-tour_s(others[k], lists[k]), k);
    std::erase(lists[k], cell_at(others[k].at_m));
  }
  std::sort(busiest.begin(), busiest.end());
  for (const auto& ranked : busiest) {
    const std::vector<std::size_t>& list = lists[ranked.second];
    const auto plan = tours({idle, others[ranked.second]}, list);
    for (const std::size_t stop : plan.front()) cells_[list[stop]].owner = idle.uav;
    if (!plan.front().empty()) return true;
  }
  return false;
}

void TaskBoard::give_up(std::size_t uav) {
  for (Cell& cell : cells_) {
    if (cell.owner == uav) cell.owner = kNobody;
  }
  claims_.erase(uav);
}

nlohmann::json TaskBoard::to_json() const {
  nlohmann::json owners = nlohmann::json::array();
  for (const Cell& cell : cells_) owners.push_back(cell.owner);
  nlohmann::json claims = nlohmann::json::array();
  for (const auto& [uav, parts] : claims_) claims.push_back({{"uav", uav}, {"parts", parts}});
  return {{"owners", owners}, {"closed_by", parts_}, {"claims", claims}};
}

void TaskBoard::from_json(const nlohmann::json& json) {
  const auto closed_by = json.at("closed_by").get<std::vector<std::size_t>>();
  const auto owners = json.at("owners").get<std::vector<std::size_t>>();
  if (owners.size() != cells_.size() || closed_by.size() != parts_.size())
    throw InputError("the saved task list is of another task box");
  std::map<std::size_t, std::vector<bool>> claims;
  for (const nlohmann::json& one : json.value("claims", nlohmann::json::array())) {
    auto parts = one.at("parts").get<std::vector<bool>>();
    if (parts.size() != parts_.size()) throw InputError("the saved task list is of another task box");
    claims[one.at("uav").get<std::size_t>()] = std::move(parts);
  }
  claims_ = std::move(claims);
  parts_ = closed_by;
  for (std::size_t i = 0; i < cells_.size(); ++i) cells_[i].owner = owners[i];
  count_open_parts();
}

}  // namespace stairwell::coverage3d
