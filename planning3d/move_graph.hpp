#pragma once

#include "core/grid_spec.hpp"
#include "planning3d/grid_moves.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::planning3d {

/// Free cells of a lattice and, for each, the moves to the 26 around it without corner cutting: a move is there when
/// every cell of the box it sweeps is free. Made once per map, for searches that ask for shortest paths only.
///
/// `successors` leaves out moves after which a search would only find again what it finds without them: a pair of
/// moves (d, n) is left out where the 27 cells around its middle allow a cheaper way from its one end to the other, or
/// an equally cheap one that is earlier in a fixed order of moves (longer moves first). The path that is first in that
/// order among all shortest ones has no such pair, so that every shortest length is found. (The thought is that of
/// Harabor and Grastien 2011 and of Sturtevant and Rabin's canonical orderings, 2016, with one look-up per local
/// pattern of free cells.)
class MoveGraph {
 public:
  static constexpr std::size_t kStart = kGridMoves.size();  ///< "came by" of a path's first cell
  /// Whole numbers whose ratios are those of 1, sqrt(2) and sqrt(3) to 7e-10.
  static constexpr std::array<std::uint32_t, 4> kCost{0, 326'491, 461'728, 565'499};

  /// @param free a byte per cell, x fastest @throws InputError for a wrong number of bytes or too many cells
  MoveGraph(const std::array<int, 3>& size, const std::vector<std::uint8_t>& free);

  const std::array<int, 3>& size() const { return size_; }
  bool contains(const VoxelIndex& v) const {
    return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < size_[0] && v.y < size_[1] && v.z < size_[2];
  }
  bool free(const VoxelIndex& v) const { return contains(v) && pattern_[cell_of(v)] != kBlocked; }

  /// Cells are numbered with a border of blocked ones, so that a neighbour's number is always within the array.
  std::size_t cell_count() const { return pattern_.size(); }
  std::uint32_t cell_of(const VoxelIndex& v) const {
    return static_cast<std::uint32_t>(
        (static_cast<std::size_t>(v.z + 1) * stride_y_ + static_cast<std::size_t>(v.y + 1)) * stride_x_ +
        static_cast<std::size_t>(v.x + 1));
  }
  VoxelIndex voxel_of(std::uint32_t cell) const;
  const std::array<std::int32_t, kGridMoves.size()>& offsets() const { return offset_; }

  /// A bit for each of kGridMoves: all moves without corner cutting.
  std::uint32_t moves(std::uint32_t cell) const { return successors(cell, kStart); }
  /// Those of them worth making after coming by the move `from` (or kStart).
  std::uint32_t successors(std::uint32_t cell, std::size_t from) const {
    const std::uint32_t pattern = pattern_[cell];
    return (pattern & kLiteral) != 0 ? pattern & ~kLiteral : rows_[pattern][from];
  }
  std::size_t memory_bytes() const;

 private:
  static constexpr std::uint32_t kLiteral = 1U << 31;  ///< the moves themselves: patterns beyond kMostRows
  static constexpr std::uint32_t kBlocked = 0;         ///< its row has no moves
  static constexpr std::size_t kMostRows = 1U << 16;
  using Row = std::array<std::uint32_t, kGridMoves.size() + 1>;

  std::uint32_t around(const std::vector<std::uint8_t>& padded, std::size_t cell) const;

  std::array<int, 3> size_;
  std::size_t stride_x_, stride_y_;  ///< cells along x and y, border included
  std::array<std::int32_t, kGridMoves.size()> offset_{};
  std::vector<std::uint32_t> pattern_;  ///< by cell: row, or moves and kLiteral
  std::vector<Row> rows_;
};

}  // namespace stairwell::planning3d
