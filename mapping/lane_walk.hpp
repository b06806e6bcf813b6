/// Walks many rays of one scan side by side, in integers, and says which of them need OctoMap's own arithmetic.
///
/// OctoMap steps to the nearest voxel border, the borders' distances being sums of doubles. Here the distances are
/// 32-bit integers in units of 2^-29 of the ray's length, good to kRounding + (steps along one axis) of them. As long
/// as the nearest border is nearer than the others by more than that, both walks take the same step; a ray for which
/// this is not so at any step, and any ray outside the window, is reported and left to RayWalker. What was marked until
/// then is right: a walk is marked only where it is certain.
#pragma once

#include "mapping/scan_window.hpp"
#include "mapping/simd.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// The rounds of the loop that follows touch different memory (clang finds out at run time).
#if defined(__clang__)
#define STAIRWELL_INDEPENDENT_ROUNDS
#else
#define STAIRWELL_INDEPENDENT_ROUNDS _Pragma("GCC ivdep")
#endif

namespace stairwell::mapping {

/// What is the same for all rays of a scan. World frame, float32 as OctoMap has it.
struct ScanFrame {
  std::array<float, 9> rotation{};  ///< world <- sensor, row by row
  std::array<float, 3> origin_m{};
  double per_m = 1.0;  ///< 1 / resolution
  float resolution_m = 1.0F;
  float squared_range_m2 = 0.0F;  ///< returns with a greater squared distance are beyond the range
  float range_m = 0.0F;
  std::array<int, 3> origin_key{};
  std::array<float, 3> border_up_m{};    ///< from the origin to the next voxel border, per axis
  std::array<float, 3> border_down_m{};  ///< (not positive)
};

/// Where the rays end, one array per field; index = ray.
struct RayColumns {
  enum Flag : std::int32_t { kOutside = 1, kHit = 2 };  ///< kOutside: of the key space; such a ray is left out

  std::array<std::vector<float>, 3> point_m;  ///< the return; NaN = dropped
  std::array<std::vector<float>, 3> end_m;    ///< cut to the range
  std::array<std::vector<std::int32_t>, 3> key;
  std::vector<std::int32_t> flags;

  std::size_t size() const { return flags.size(); }
  void resize(std::size_t rays);
};

/// The window's numbers that a walk needs.
struct WindowView {
  std::uint8_t* cells = nullptr;
  std::array<std::int32_t, 3> first{};    ///< key of cells[0]
  std::array<std::int32_t, 3> lo{};       ///< lowest key covered
  std::array<std::uint32_t, 3> extent{};  ///< covered keys per axis
  std::array<std::int32_t, 3> stride{};
  std::int32_t origin_cell = 0;
  std::int32_t spare_cell = 0;
};

/// Rays ready to be walked.
struct RayBatch {
  static constexpr std::size_t kRays = 1024;
  static constexpr std::size_t kPadded = kRays + 16;
  template <typename T>
  using Column = std::array<T, kPadded>;

  alignas(64) std::array<Column<std::int32_t>, 3> t;       ///< distance of the next border
  alignas(64) std::array<Column<std::int32_t>, 3> delta;   ///< between borders
  alignas(64) std::array<Column<std::int32_t>, 3> stride;  ///< of one step, in cells
  alignas(64) Column<std::int32_t> end;                    ///< cell to stop at; the origin's: nothing to walk
  alignas(64) Column<std::int32_t> special;                ///< not 0: RayWalker's
};

/// What one update does to a voxel, as octomap::OccupancyOcTreeBase::updateNodeLogOdds has it.
struct UpdateRule {
  float hit = 0.0F;
  float miss = 0.0F;
  float lowest = 0.0F;
  float highest = 0.0F;
  float threshold = 0.0F;  ///< occupied from here on
};

/// What became of 64 voxels, a bit each.
struct WordEffect {
  std::uint64_t stored = 0;          ///< values that are different now
  std::uint64_t unknown_before = 0;  ///< among the updated
  std::uint64_t occupied_before = 0;
  std::uint64_t occupied_after = 0;
};

struct ScanKernels {
  /// Transforms points [first, first + count) of a scan into the same rays. @return points that are not finite
  std::size_t (*transform)(const ScanFrame& frame, const Eigen::Vector3f* points_m, std::size_t first,
                           std::size_t count, RayColumns& rays);
  /// Fills in ends, keys and flags of rays [first, first + count). `reach` grows by the ends inside the key space.
  void (*find_ends)(const ScanFrame& frame, std::size_t first, std::size_t count, RayColumns& rays, LatticeBox& reach);
  /// Rays [first, first + count), count <= RayBatch::kRays. @return voxels on the ways of rays that are not special
  std::size_t (*prepare)(const ScanFrame& frame, const RayColumns& rays, std::size_t first, std::size_t count,
                         const WindowView& window, RayBatch& batch);
  /// Marks the voxels of the rays that are not special; those found uncertain on the way go to `uncertain`.
  void (*walk)(const RayBatch& batch, std::size_t count, const WindowView& window, std::int32_t tolerance,
               std::vector<std::uint32_t>& uncertain);
  /// Adds a miss or a hit (disjoint bits) to 64 log-odds, NaN = unknown.
  WordEffect (*update)(float* log_odds, std::uint64_t miss, std::uint64_t hit, const UpdateRule& rule);
  /// The keys of the points; `key` holds numbers outside of [0, 65535] where there is none.
  /// @return the box of the keys, each axis by itself; lo > hi where there is none
  LatticeBox (*find_keys)(double per_m, RayColumns& rays);
};

namespace lanes {

inline constexpr int kLengthBits = 29;
inline constexpr std::int32_t kLength = 1 << kLengthBits;
inline constexpr std::int32_t kFar = 1 << 30;
/// Float32 arithmetic loses at most 5.1 * 2^-24 of a distance: 164 units at the ray's end, for each of the two
/// compared; and a first border that lies behind the origin by OctoMap's rounding (at most 2^-25 of a voxel) is taken to
/// lie there, which puts the ones after it up to 16 units off.
inline constexpr std::int32_t kRounding = 332 + 2 * 16;
inline constexpr std::int32_t kMaxSteps = 512;  ///< along one axis; longer rays would be uncertain too often

/// @throws InputError when the processor lacks the instructions asked for.
const ScanKernels& kernels(Simd simd);

const ScanKernels& scalar_kernels();
const ScanKernels& avx2_kernels();
const ScanKernels& avx512_kernels();

}  // namespace lanes

}  // namespace stairwell::mapping
