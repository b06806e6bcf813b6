#include "mapping/potential_layers.hpp"

#include "core/errors.hpp"
#include "mapping/potential_segments.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::mapping {

namespace {

constexpr double kFarthestGoal_m = 1e6;
constexpr std::size_t kMaxMobile = 64;

bool same(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return a == b || (a.array().isNaN().any() && b.array().isNaN().any());
}

bool same(const PotentialBump& a, const PotentialBump& b) {
  return a.center_m == b.center_m && a.gain == b.gain && a.sigma_m == b.sigma_m && a.reach_m == b.reach_m;
}

double volume(const VoxelBox& box) {
  return static_cast<double>(box.hi.x - box.lo.x + 1) * (box.hi.y - box.lo.y + 1) * (box.hi.z - box.lo.z + 1);
}

VoxelBox united(const VoxelBox& a, const VoxelBox& b) {
  return {{std::min(a.lo.x, b.lo.x), std::min(a.lo.y, b.lo.y), std::min(a.lo.z, b.lo.z)},
          {std::max(a.hi.x, b.hi.x), std::max(a.hi.y, b.hi.y), std::max(a.hi.z, b.hi.z)}};
}

const PotentialConfig& usable(const PotentialConfig& config) {
  const std::vector<std::string> problems = config.problems();
  if (!problems.empty()) throw InputError("unusable potential: " + problems.front());
  return config;
}

std::array<int, 3> cut(const std::array<int, 3>& wanted, const std::array<int, 3>& lattice) {
  std::array<int, 3> size{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (wanted[axis] < 1) {
      throw InputError("potential: a window of " + std::to_string(wanted[axis]) + " cells along axis " + "xyz"[axis]);
    }
    size[axis] = std::min(wanted[axis], lattice[axis]);
  }
  return size;
}

}  // namespace

VoxelBox intersection(const VoxelBox& a, const VoxelBox& b) {
  return {{std::max(a.lo.x, b.lo.x), std::max(a.lo.y, b.lo.y), std::max(a.lo.z, b.lo.z)},
          {std::min(a.hi.x, b.hi.x), std::min(a.hi.y, b.hi.y), std::min(a.hi.z, b.hi.z)}};
}

bool is_empty(const VoxelBox& box) { return box.lo.x > box.hi.x || box.lo.y > box.hi.y || box.lo.z > box.hi.z; }

PotentialLayers::PotentialLayers(const GridSpec& lattice, const std::array<int, 3>& window_cells, RepulsionForm form,
                                 const PotentialConfig& config)
    : lattice_(lattice),
      size_(cut(window_cells, lattice.size())),
      form_(form),
      config_(usable(config)),
      kernel_(config, lattice.resolution_m()),
      spreader_(kernel_),
      goal_m_(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())) {
  const auto nx = static_cast<std::size_t>(size_[0]);
  const auto ny = static_cast<std::size_t>(size_[1]);
  const auto nz = static_cast<std::size_t>(size_[2]);
  repulsive_.assign(nx * ny * nz, 0);
  for (std::vector<float>* layer : {&attractive_, &experience_layer_, &mobile_layer_, &total_}) {
    layer->assign(nx * ny * nz, 0.0F);
  }
  touched_.assign(ny * nz, {});
  std::size_t slab = 0, rows = 0;
  for (std::size_t across = 0; across < 3; ++across) {
    std::array<std::size_t, 3> cells{nx, ny, nz};
    cells[across] = std::min<std::size_t>(cells[across], kSlab_cells);
    slab = std::max(slab, cells[0] * cells[1] * cells[2]);
    for (std::size_t& count : cells) count += static_cast<std::size_t>(2 * kernel_.reach_cells());
    const std::size_t a = cells[across], b = cells[(across + 1) % 3], c = cells[(across + 2) % 3];
    rows = std::max({rows, a * b * ((c + 63) / 64), a * c * ((b + 63) / 64)});
  }
  row_sums_.assign(slab, 0);
  column_sums_.assign(slab, 0);
  rows_.assign(rows, 0);
  columns_.assign(rows, 0);
  for (std::size_t axis = 0; axis < 3; ++axis) line_[axis].assign(static_cast<std::size_t>(size_[axis]), 0.0F);
  singles_.reserve(kMaxSingles);
  mobile_.reserve(kMaxMobile);
  last_mobile_.reserve(kMaxMobile);
}

VoxelBox PotentialLayers::window() const {
  return {origin_, origin_ + VoxelIndex{size_[0] - 1, size_[1] - 1, size_[2] - 1}};
}

std::size_t PotentialLayers::memory_bytes() const {
  return repulsive_.size() * (sizeof(std::int32_t) + 4 * sizeof(float)) + touched_.size() * sizeof(CellRange) +
         2 * (row_sums_.size() * sizeof(std::int32_t) + rows_.size() * sizeof(std::uint64_t));
}

void PotentialLayers::add_experience(const PotentialBump& bump) {
  const bool usable = bump.center_m.allFinite() && std::isfinite(bump.gain) && std::isfinite(bump.sigma_m) &&
                      std::isfinite(bump.reach_m) && bump.sigma_m > 0.0 && bump.reach_m > 0.0;
  if (usable) experience_.push_back(bump);
}

void PotentialLayers::clear_experience() {
  cleared_.insert(cleared_.end(), experience_.begin(), experience_.begin() + static_cast<std::ptrdiff_t>(applied_));
  experience_.clear();
  applied_ = 0;
}

void PotentialLayers::require(const Inputs& inputs) const {
  if (!(inputs.obstacles.grid() == lattice_)) {
    throw InputError("potential: the obstacles lie on another lattice than the layers");
  }
  if (form_ == RepulsionForm::kSummed) return;
  if (inputs.distances == nullptr || !(inputs.distances->grid() == lattice_)) {
    throw InputError("potential: the nearest obstacle needs a distance field on the layers' lattice");
  }
  if (inputs.distances->squared_cells({-1, -1, -1}) == 0) {
    throw InputError("potential: the distance field must not count unknown space as obstacle");
  }
  if (inputs.distances->truncation_cells() <= kernel_.reach_cells()) {
    throw InputError("potential: reach_m " + std::to_string(config_.reach_m) + " is beyond the distance field's " +
                     std::to_string(inputs.distances->truncation_m()) + " m");
  }
}

/// The window is shifted inwards at the lattice's border.
PotentialLayers::Move PotentialLayers::move_window(const Eigen::Vector3d& center_m) {
  const VoxelBox before = window();
  if (center_m.allFinite()) {
    const Eigen::Vector3d at = (center_m - lattice_.box().min_m) / lattice_.resolution_m();
    const auto first = [&](std::size_t axis) {
      const double cells = lattice_.size()[axis];
      const int cell = static_cast<int>(std::clamp(std::floor(at[static_cast<Eigen::Index>(axis)]), 0.0, cells - 1.0));
      return std::clamp(cell - size_[axis] / 2, 0, lattice_.size()[axis] - size_[axis]);
    };
    origin_ = {first(0), first(1), first(2)};
  }
  Move move{intersection(before, window()), {window(), window(), window()}};
  if (is_empty(move.kept)) {
    move.entering[1] = move.entering[2] = {{0, 0, 0}, {-1, -1, -1}};
    return move;
  }
  const auto beside = [](int& lo, int& hi, int kept_lo, int kept_hi) {  // both boxes are equally long
    if (lo < kept_lo) {
      hi = kept_lo - 1;
    } else {
      lo = kept_hi + 1;
    }
  };
  auto& [x, y, z] = move.entering;
  const VoxelBox& kept = move.kept;
  beside(x.lo.x, x.hi.x, kept.lo.x, kept.hi.x);
  y.lo.x = z.lo.x = kept.lo.x;
  y.hi.x = z.hi.x = kept.hi.x;
  beside(y.lo.y, y.hi.y, kept.lo.y, kept.hi.y);
  z.lo.y = kept.lo.y;
  z.hi.y = kept.hi.y;
  beside(z.lo.z, z.hi.z, kept.lo.z, kept.hi.z);
  return move;
}

void PotentialLayers::take_mobile(std::span<const Eigen::Vector3d> mobile_m) {
  std::swap(mobile_, last_mobile_);
  mobile_.clear();
  for (const Eigen::Vector3d& at_m : mobile_m) {
    if (at_m.allFinite() && mobile_.size() < kMaxMobile) {
      mobile_.push_back({at_m, config_.k_mobile, config_.sigma_mobile_m, config_.reach_mobile_m});
    }
  }
}

void PotentialLayers::update(const Inputs& inputs, const PotentialStep& step) {
  require(inputs);
  Eigen::Vector3d goal_m = step.goal_m;
  if (!goal_m.allFinite() || goal_m.cwiseAbs().maxCoeff() > kFarthestGoal_m) {
    goal_m.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  const bool goal_moved = !same(goal_m, goal_m_);
  goal_m_ = goal_m;
  take_mobile(step.mobile_m);
  Move move = move_window(step.center_m);

  const std::uint64_t revision = inputs.obstacles.revision();
  const bool followed =
      revision == seen_revision_ || (revision == seen_revision_ + 1 && !inputs.obstacles.too_many_changes());
  if (fresh_ || !followed) move = {{{0, 0, 0}, {-1, -1, -1}}, {window(), {{}, {-1, 0, 0}}, {{}, {-1, 0, 0}}}};
  if (!is_empty(move.kept)) {
    update_kept(inputs, move.kept, goal_moved);
  }
  applied_ = experience_.size();
  cleared_.clear();
  for (const VoxelBox& box : move.entering) {
    if (!is_empty(box)) fill(inputs, box);
  }
  sum_touched();
  seen_revision_ = revision;
  fresh_ = false;
}

/// Alg. 4.1 on the cells that stay in the window.
void PotentialLayers::update_kept(const Inputs& inputs, const VoxelBox& kept, bool goal_moved) {
  if (inputs.obstacles.revision() != seen_revision_) {
    if (form_ == RepulsionForm::kSummed) {
      spread_changes(inputs.obstacles, kept);
    } else {
      touch_changes(inputs.obstacles, kept);
      const VoxelBox all = window();
      for (int z = all.lo.z; z <= all.hi.z; ++z) {
        for (int y = all.lo.y; y <= all.hi.y; ++y) {
          const CellRange row = touched_[touched_row(y, z, size_)];
          if (!row.empty()) read_nearest(*inputs.distances, {{row.lo, y, z}, {row.hi, y, z}});
        }
      }
    }
  }
  update_experience(inputs, kept);
  if (goal_moved) {
    fill_attractive(kept);
    touch(kept);
  }
  const auto rebuild = [&](const VoxelBox& reach) {
    const VoxelBox box = intersection(reach, kept);
    if (!is_empty(box)) fill_mobile(box);
  };
  for (std::size_t i = 0; i < std::max(mobile_.size(), last_mobile_.size()); ++i) {
    const bool before = i < last_mobile_.size();
    const bool after = i < mobile_.size();
    if (before && after) {
      if (same(last_mobile_[i], mobile_[i])) continue;
      touch(last_mobile_[i], kept);
      touch(mobile_[i], kept);
      const VoxelBox from = reach_of(last_mobile_[i]);
      const VoxelBox to = reach_of(mobile_[i]);
      const VoxelBox both = united(from, to);
      if (volume(both) <= volume(from) + volume(to)) {
        rebuild(both);
      } else {
        rebuild(from);
        rebuild(to);
      }
    } else {
      const PotentialBump& bump = before ? last_mobile_[i] : mobile_[i];
      touch(bump, kept);
      rebuild(reach_of(bump));
    }
  }
}

void PotentialLayers::update_experience(const Inputs& inputs, const VoxelBox& kept) {
  for (; applied_ < experience_.size(); ++applied_) {
    const VoxelBox box = intersection(reach_of(experience_[applied_]), kept);
    if (is_empty(box)) continue;
    add_bump(experience_[applied_], box, experience_layer_);
    touch(box);
  }
  const auto rebuild = [&](const VoxelBox& reach) {
    const VoxelBox box = intersection(reach, kept);
    if (is_empty(box)) return;
    fill_experience(inputs.map, box);
    touch(box);
  };
  for (const PotentialBump& bump : cleared_) rebuild(reach_of(bump));
  if (!(config_.k_exp > 0.0) || inputs.obstacles.revision() == seen_revision_) return;
  if (inputs.too_many_blocks) {
    rebuild(kept);
    return;
  }
  const GridSpec& grid = inputs.map.grid();
  for (const VoxelBox& block : inputs.changed_blocks) {
    rebuild({lattice_.index_of(grid.center_of(block.lo)), lattice_.index_of(grid.center_of(block.hi))});
  }
}

/// In thin pieces, so that what is summed is still in the cache.
void PotentialLayers::fill(const Inputs& inputs, const VoxelBox& box) {
  constexpr int kPiece_cells = 4;
  fill_repulsive(inputs, box);
  VoxelBox piece = box;
  for (piece.lo.z = box.lo.z; piece.lo.z <= box.hi.z; piece.lo.z += kPiece_cells) {
    piece.hi.z = std::min(piece.lo.z + kPiece_cells - 1, box.hi.z);
    fill_attractive(piece);
    fill_experience(inputs.map, piece);
    fill_mobile(piece);
    sum_total(piece);
  }
}

void PotentialLayers::touch(const VoxelBox& box) {
  for (int z = box.lo.z; z <= box.hi.z; ++z) {
    for (int y = box.lo.y; y <= box.hi.y; ++y) {
      CellRange& row = touched_[touched_row(y, z, size_)];
      row = row.empty() ? CellRange{box.lo.x, box.hi.x}
                        : CellRange{std::min(row.lo, box.lo.x), std::max(row.hi, box.hi.x)};
    }
  }
}

double PotentialLayers::stored(PotentialLayer layer, std::size_t index) const {
  switch (layer) {
    case PotentialLayer::kAttractive:
      return static_cast<double>(attractive_[index]);
    case PotentialLayer::kRepulsive:
      return kernel_.unit() * repulsive_[index];
    case PotentialLayer::kExperience:
      return static_cast<double>(experience_layer_[index]);
    case PotentialLayer::kMobile:
      return static_cast<double>(mobile_layer_[index]);
    case PotentialLayer::kTotal:
      break;
  }
  return static_cast<double>(total_[index]);
}

std::size_t PotentialLayers::storage(const VoxelIndex& v) const {
  return touched_row(v.y, v.z, size_) * static_cast<std::size_t>(size_[0]) +
         static_cast<std::size_t>(wrapped(v.x, size_[0]));
}

double PotentialLayers::at(PotentialLayer layer, const VoxelIndex& v) const { return stored(layer, storage(v)); }

double PotentialLayers::value(const Eigen::Vector3d& point_m, PotentialLayer layer) const {
  const Eigen::Vector3d cells = (point_m - lattice_.center_of(origin_)) / lattice_.resolution_m();
  std::array<int, 3> lo{};
  std::array<int, 3> hi{};
  std::array<double, 3> fraction{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int last = size_[axis] - 1;
    const double along = std::clamp(cells[static_cast<Eigen::Index>(axis)], 0.0, static_cast<double>(last));
    lo[axis] = std::min(static_cast<int>(along), std::max(last - 1, 0));
    hi[axis] = std::min(lo[axis] + 1, last);
    fraction[axis] = along - lo[axis];
  }
  double sum = 0.0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      weight *= ((corner >> axis) & 1U) != 0 ? fraction[axis] : 1.0 - fraction[axis];
    }
    const VoxelIndex v{(corner & 1U) != 0 ? hi[0] : lo[0], (corner & 2U) != 0 ? hi[1] : lo[1],
                       (corner & 4U) != 0 ? hi[2] : lo[2]};
    sum += weight * at(layer, origin_ + v);
  }
  return sum;
}

}  // namespace stairwell::mapping
