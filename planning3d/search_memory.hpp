#pragma once

#include "core/grid_spec.hpp"
#include "planning3d/lazy_array.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace stairwell::planning3d {

/// A voxel that waits for its expansion.
struct OpenVoxel {
  float f;  ///< cost so far plus the heuristic
  float g;
  std::uint32_t cell;
};

/// What a best-first search over a grid's voxels writes down, kept between searches: nodes that need no clearing, since
/// each bears the stamp of the search that wrote it, and the queue of open voxels. `Node` is all zero at first and has
/// a `std::uint32_t stamp`.
template <typename Node>
class SearchMemory {
 public:
  /// Begins a search. @throws std::bad_alloc
  void renew(const GridSpec& grid) {
    const bool full = expansions_ > kMostExpansions || stamp_ == std::numeric_limits<std::uint32_t>::max();
    if (!(grid_ == grid) || nodes_.empty() || full) {
      grid_ = grid;
      nodes_ = {};  // first, so that there are never two
      nodes_ = LazyArray<Node>(grid_.voxel_count());
      stamp_ = 0;
      expansions_ = 0;
    }
    ++stamp_;
    open_.clear();
  }
  /// Of the search that ends; after very many the memory is given back.
  void count(std::size_t expansions) { expansions_ += expansions; }

  const GridSpec& grid() const { return grid_; }
  std::uint32_t stamp() const { return stamp_; }
  Node& operator[](std::size_t cell) { return nodes_[cell]; }
  const Node& operator[](std::size_t cell) const { return nodes_[cell]; }
  bool seen(const Node& node) const { return node.stamp == stamp_; }

  bool nothing_open() const { return open_.empty(); }
  void push(const OpenVoxel& voxel) {
    open_.push_back(voxel);
    std::push_heap(open_.begin(), open_.end(), worse);
  }
  OpenVoxel pop_best() {
    const OpenVoxel best = open_.front();
    std::pop_heap(open_.begin(), open_.end(), worse);
    open_.pop_back();
    return best;
  }

 private:
  static constexpr std::size_t kMostExpansions = 20'000'000;

  /// Of equal ones the one that has come farther is expanded first.
  static bool worse(const OpenVoxel& a, const OpenVoxel& b) { return a.f > b.f || (a.f == b.f && a.g < b.g); }

  GridSpec grid_;
  LazyArray<Node> nodes_;
  std::size_t expansions_ = 0;  ///< since nodes_ was made
  std::vector<OpenVoxel> open_;
  std::uint32_t stamp_ = 0;
};

}  // namespace stairwell::planning3d
