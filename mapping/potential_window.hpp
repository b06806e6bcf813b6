/// What the learned agents see of a potential: windows around the UAV, and two-dimensional slices.
#pragma once

#include "mapping/potential_layers.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <span>

namespace stairwell::mapping {

/// Samples on a box lattice, x fastest, then y, then z (the last three axes of a tensor [z, y, x]). The window's own
/// frame has its origin in the middle of the lattice; with odd numbers a sample lies there.
struct WindowShape {
  std::array<int, 3> samples{75, 75, 1};  ///< SPEC A5: 75 x 75 in 2D; a third number above 1 for 3D
  double spacing_m = 0.1;
  double full_scale = 1000.0;  ///< a potential of this much above the centre is 1

  std::size_t size() const;
  std::vector<std::string> problems() const;
};

/// Where a window is, in the world frame. Its axes are turned about z.
struct WindowPose {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
};

/// out = clamp((U(sample) - U(center)) / full_scale, -1, 1): potentials from [-1000, 1000] mapped to [-1, 1], the
/// centre's offset to 0 (thesis 4.4.2, SPEC A1). U is trilinear between cell centres; beyond the outermost centres that
/// the layers hold it is as at the nearest point between them, so that a window wholly outside is all 0. Allocates
/// nothing.
/// @param out shape.size() values.
/// @throws InputError for an unusable shape, another size of `out`, or a pose that is not finite.
void sample_window(const PotentialLayers& layers, const WindowShape& shape, const WindowPose& pose,
                   std::span<float> out);

/// The potential's cells in one plane z = const: the 2D environment model of thesis chapter 4. A view: it shows what
/// the layers hold now, and lives no longer than they.
class PotentialSlice {
 public:
  /// The plane of cells that holds the height, or the nearest one in the layers' window at the time of asking.
  /// @throws InputError for a height that is not finite.
  PotentialSlice(const PotentialLayers& layers, double height_m);

  /// Lattice layer shown; follows the window when that moves away.
  int z() const;
  /// Cells along x and y.
  std::array<int, 2> size() const { return {layers_->window_cells()[0], layers_->window_cells()[1]}; }
  /// Lattice coordinates of the lowest cell.
  std::array<int, 2> first() const { return {layers_->window().lo.x, layers_->window().lo.y}; }
  /// x and y in lattice coordinates; beyond the window as at its nearest cell.
  double at(int x, int y, PotentialLayer layer = PotentialLayer::kTotal) const;
  /// `sample_window` in this plane: bilinear between the plane's cells.
  /// @throws InputError as there, and for a shape with more than one sample along z.
  void sample(const WindowShape& shape, const Eigen::Vector2d& center_m, double yaw_rad, std::span<float> out) const;

 private:
  const PotentialLayers* layers_;
  int z_ = 0;
};

}  // namespace stairwell::mapping
