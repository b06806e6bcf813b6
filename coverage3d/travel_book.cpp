#include "coverage3d/travel_book.hpp"

#include "coverage3d/voxel_walk.hpp"
#include "mapping/worker_pool.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::coverage3d {
namespace {

constexpr double kFieldCell_m = 0.4;
constexpr double kFieldReach_m = 15.0;
constexpr double kAnchor_m = 1.2;  // viewpoints in one cell of this size share a field
constexpr double kFieldBytes = 64.0e6;
constexpr double kBytesPerCell = 12.0;
constexpr std::uint64_t kRounds = 40;  // a field is computed again after so many rounds
constexpr double kGuess = 1.6;         // detour factor where nothing better is known

}  // namespace

bool straight_way(const planning3d::FreeSpace& space, const planning3d::MotionRule& rule, const Eigen::Vector3d& a_m,
                  const Eigen::Vector3d& b_m) {
  if (rule.kind == planning3d::MotionRule::Kind::kSlice &&
      std::abs(a_m.z() - b_m.z()) > 0.5 * space.grid().resolution_m())
    return false;
  return walk_voxels(space.grid(), a_m, b_m, [&](const VoxelIndex& v) { return space.traversable(v); });
}

TravelBook::Key TravelBook::key_of(const Eigen::Vector3d& position_m) {
  Key key;
  for (int axis = 0; axis < 3; ++axis)
    key[static_cast<std::size_t>(axis)] = static_cast<int>(std::floor(position_m[axis] / kAnchor_m));
  return key;
}

void TravelBook::begin(const planning3d::FreeSpace& space, const planning3d::MotionRule& rule, int new_fields) {
  if (rule.kind != rule_.kind || rule.layers_m != rule_.layers_m) fields_.clear();
  rule_ = rule;
  ++round_;
  new_fields_left_ = new_fields;
  const int stride = std::max(1, static_cast<int>(std::lround(kFieldCell_m / space.grid().resolution_m())));
  if (stride != stride_) lattice_ = planning3d::PassableLattice(stride);
  stride_ = stride;
  const double cells = std::min(static_cast<double>(space.grid().voxel_count()) / std::pow(stride_, 3),
                                std::pow(2.0 * kFieldReach_m / kFieldCell_m, 3));
  most_fields_ = static_cast<std::size_t>(std::clamp(kFieldBytes / (cells * kBytesPerCell), 4.0, 48.0));
  std::erase_if(fields_, [&](const auto& entry) { return round_ - entry.second.made > kRounds; });
}

/// Which fields there are never depends on what is in them: they can be computed later, and several at once.
const TravelBook::Field* TravelBook::field_near(const Eigen::Vector3d& position_m, bool may_compute) {
  const Key key = key_of(position_m);
  const auto found = fields_.find(key);
  if (found != fields_.end()) return &found->second;
  if (!may_compute || new_fields_left_ <= 0) return nullptr;
  --new_fields_left_;
  if (fields_.size() >= most_fields_)
    replaced_.push_back(fields_.extract(std::min_element(
        fields_.begin(), fields_.end(), [](const auto& a, const auto& b) { return a.second.made < b.second.made; })));
  Field& field = fields_.emplace(key, Field{planning3d::TravelCosts(stride_), position_m, round_}).first->second;
  new_.push_back(&field);
  return &field;
}

TravelBook::Source TravelBook::source_for(const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m) {
  if (const Field* field = field_near(a_m, false)) return {field, &b_m};
  if (const Field* field = field_near(b_m, false)) return {field, &a_m};
  return {field_near(a_m, (a_m - b_m).norm() < kFieldReach_m), &b_m};
}

void TravelBook::compute_new(const planning3d::FreeSpace& space, mapping::WorkerPool* workers) {
  if (new_.empty()) return;
  lattice_.update(space, rule_);
  mapping::for_each_index(workers, new_.size(), [&](std::size_t i) {
    new_[i]->costs.compute(space, new_[i]->source_m, rule_, kFieldReach_m, &lattice_);
  });
  new_.clear();
}

double TravelBook::answer_m(const Source& source, double straight_m) {
  if (source.field == nullptr) return kGuess * straight_m + 1.0;
  const double way_m = static_cast<double>(source.field->costs.distance_m(*source.far_m));
  if (!std::isfinite(way_m)) return std::max(kGuess * straight_m, kFieldReach_m);
  return std::max(way_m, straight_m);
}

double TravelBook::distance_m(const planning3d::FreeSpace& space, const Eigen::Vector3d& a_m,
                              const Eigen::Vector3d& b_m) {
  const double straight_m = (a_m - b_m).norm();
  if (straight_way(space, rule_, a_m, b_m)) return straight_m;
  const Source source = source_for(a_m, b_m);
  compute_new(space, nullptr);
  const double way_m = answer_m(source, straight_m);
  replaced_.clear();
  return way_m;
}

std::vector<double> TravelBook::distances_m(const planning3d::FreeSpace& space, const std::vector<Pair>& pairs,
                                            mapping::WorkerPool* workers) {
  std::vector<char> straight(pairs.size(), 0);  // not bits: threads write side by side
  mapping::for_each_index_in_parts(workers, pairs.size(), [&](std::size_t i) {
    straight[i] = straight_way(space, rule_, pairs[i].first, pairs[i].second) ? 1 : 0;
  });
  std::vector<Source> sources(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (straight[i] == 0) sources[i] = source_for(pairs[i].first, pairs[i].second);
  compute_new(space, workers);
  std::vector<double> distances_m;
  distances_m.reserve(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double straight_m = (pairs[i].first - pairs[i].second).norm();
    distances_m.push_back(straight[i] != 0 ? straight_m : answer_m(sources[i], straight_m));
  }
  replaced_.clear();
  return distances_m;
}

}  // namespace stairwell::coverage3d
