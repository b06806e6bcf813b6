#include "mapping/potential_window.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::mapping {

namespace {

/// Between which two cells of an axis a coordinate lies: where their rows begin in the storage, and how far along.
struct Between {
  std::size_t lo = 0;
  std::size_t hi = 0;
  float fraction = 0.0F;
};

/// One axis of the stored window: coordinates in cells from the centre of its lowest cell.
class Axis {
 public:
  Axis(int origin, int size, std::size_t stride) : last_(size - 1), first_(wrapped(origin, size)), stride_(stride) {}

  Between at(double cells) const {
    const double along = std::clamp(cells, 0.0, static_cast<double>(last_));
    const int lo = std::min(static_cast<int>(along), std::max(last_ - 1, 0));
    const int hi = std::min(lo + 1, last_);
    return {stored(lo) * stride_, stored(hi) * stride_, static_cast<float>(along - lo)};
  }

 private:
  std::size_t stored(int cell) const {
    const int at = first_ + cell;
    return static_cast<std::size_t>(at > last_ ? at - last_ - 1 : at);
  }

  int last_;
  int first_;
  std::size_t stride_;
};

float mixed(float a, float b, float fraction) { return a + fraction * (b - a); }

struct Sampler {
  explicit Sampler(const PotentialLayers& layers)
      : total(layers.total().data()),
        x(layers.window().lo.x, layers.window_cells()[0], 1),
        y(layers.window().lo.y, layers.window_cells()[1], static_cast<std::size_t>(layers.window_cells()[0])),
        z(layers.window().lo.z, layers.window_cells()[2],
          static_cast<std::size_t>(layers.window_cells()[0]) * static_cast<std::size_t>(layers.window_cells()[1])) {}

  float at(const Between& along_x, const Between& along_y, const Between& along_z) const {
    const auto row = [&](std::size_t from) {
      return mixed(total[from + along_x.lo], total[from + along_x.hi], along_x.fraction);
    };
    const auto plane = [&](std::size_t from) {
      return mixed(row(from + along_y.lo), row(from + along_y.hi), along_y.fraction);
    };
    if (along_z.fraction == 0.0F) return plane(along_z.lo);
    return mixed(plane(along_z.lo), plane(along_z.hi), along_z.fraction);
  }
  float at(const Eigen::Vector3d& cells) const { return at(x.at(cells.x()), y.at(cells.y()), z.at(cells.z())); }

  const float* total;
  Axis x, y, z;
};

void require(const WindowShape& shape, const Eigen::Vector3d& center_m, double yaw_rad, std::span<float> out) {
  const std::vector<std::string> problems = shape.problems();
  if (!problems.empty()) throw InputError("unusable potential window: " + problems.front());
  if (out.size() != shape.size()) {
    throw InputError("potential window: " + std::to_string(shape.size()) + " samples do not fit into " +
                     std::to_string(out.size()));
  }
  if (!center_m.allFinite() || !std::isfinite(yaw_rad)) throw InputError("potential window: the pose is not finite");
}

}  // namespace

std::size_t WindowShape::size() const {
  return static_cast<std::size_t>(samples[0]) * static_cast<std::size_t>(samples[1]) *
         static_cast<std::size_t>(samples[2]);
}

std::vector<std::string> WindowShape::problems() const {
  std::vector<std::string> found;
  for (const int count : samples) {
    if (count < 1) found.push_back("samples must be at least 1 along every axis, got " + std::to_string(count));
  }
  if (!(spacing_m > 0.0) || !std::isfinite(spacing_m)) {
    found.push_back("spacing_m must be positive, got " + std::to_string(spacing_m));
  }
  if (!(full_scale > 0.0) || !std::isfinite(full_scale)) {
    found.push_back("full_scale must be positive, got " + std::to_string(full_scale));
  }
  return found;
}

void sample_window(const PotentialLayers& layers, const WindowShape& shape, const WindowPose& pose,
                   std::span<float> out) {
  require(shape, pose.center_m, pose.yaw_rad, out);
  const Sampler sampler(layers);
  const GridSpec& lattice = layers.lattice();
  const Eigen::Vector3d center =
      (pose.center_m - lattice.center_of(layers.window().lo)) / lattice.resolution_m();  // in cells
  const double spacing = shape.spacing_m / lattice.resolution_m();
  const Eigen::Vector2d along_i = spacing * Eigen::Vector2d(std::cos(pose.yaw_rad), std::sin(pose.yaw_rad));
  const Eigen::Vector2d along_j(-along_i.y(), along_i.x());
  const auto [nx, ny, nz] = shape.samples;
  const float offset = sampler.at(center);
  const auto scale = static_cast<float>(1.0 / shape.full_scale);
  float* to = out.data();
  for (int k = 0; k < nz; ++k) {
    const Between z = sampler.z.at(center.z() + spacing * (k - 0.5 * (nz - 1)));
    for (int j = 0; j < ny; ++j) {
      const Eigen::Vector2d row = center.head<2>() + (j - 0.5 * (ny - 1)) * along_j;
      for (int i = 0; i < nx; ++i) {
        const Eigen::Vector2d at = row + (i - 0.5 * (nx - 1)) * along_i;
        const float above = sampler.at(sampler.x.at(at.x()), sampler.y.at(at.y()), z) - offset;
        *to++ = std::clamp(above * scale, -1.0F, 1.0F);
      }
    }
  }
}

PotentialSlice::PotentialSlice(const PotentialLayers& layers, double height_m) : layers_(&layers) {
  if (!std::isfinite(height_m)) throw InputError("potential slice: the height is not finite");
  const GridSpec& lattice = layers.lattice();
  const double cell = std::floor((height_m - lattice.box().min_m.z()) / lattice.resolution_m());
  z_ = static_cast<int>(std::clamp(cell, 0.0, lattice.size()[2] - 1.0));
}

int PotentialSlice::z() const {
  const VoxelBox window = layers_->window();
  return std::clamp(z_, window.lo.z, window.hi.z);
}

double PotentialSlice::at(int x, int y, PotentialLayer layer) const {
  const VoxelBox window = layers_->window();
  return layers_->at(layer, {std::clamp(x, window.lo.x, window.hi.x), std::clamp(y, window.lo.y, window.hi.y), z()});
}

void PotentialSlice::sample(const WindowShape& shape, const Eigen::Vector2d& center_m, double yaw_rad,
                            std::span<float> out) const {
  if (shape.samples[2] != 1) throw InputError("potential slice: a window in a slice has one sample along z");
  const double height_m = layers_->lattice().center_of({0, 0, z()}).z();
  sample_window(*layers_, shape, {{center_m.x(), center_m.y(), height_m}, yaw_rad}, out);
}

}  // namespace stairwell::mapping
