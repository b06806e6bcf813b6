#pragma once

#include "core/aabb.hpp"
#include "core/scan.hpp"
#include "coverage3d/gain_rays.hpp"
#include "coverage3d/information_gain.hpp"
#include "mapping/occupancy_map.hpp"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace stairwell::coverage3d {

/// Space that somebody is going to look at, in cells of a few decimetres.
class Foreseen {
 public:
  explicit Foreseen(const GridSpec& grid);
  void mark(const VoxelIndex& v) { cells_[cell_of(v)] = true; }
  bool has(const VoxelIndex& v) const { return cells_[cell_of(v)]; }
  double cell_m() const { return cell_m_; }

 private:
  std::size_t cell_of(const VoxelIndex& v) const {
    return (static_cast<std::size_t>(v.z / step_) * size_[1] + static_cast<std::size_t>(v.y / step_)) * size_[0] +
           static_cast<std::size_t>(v.x / step_);
  }
  int step_;
  double cell_m_;
  std::array<std::size_t, 3> size_;
  std::vector<bool> cells_;
};

/// What a view's gain is computed from.
struct ViewGainConfig {
  SensorModel sensor;
  Aabb box;  ///< only space inside counts
  GainKind kind = GainKind::kVolume;
  mapping::OccupancyParams occupancy;  ///< of the map; for kEntropy
};

/// What a look from a pose is worth (SPEC B4: expected information gain within a range), in m3: rays go through space
/// known to be free up to the first surface and add up the unknown to a limited depth. With kEntropy every known voxel
/// on the way adds as much as it is expected to lose of its entropy, too, an unknown one counting 1.
class ViewGain {
 public:
  static constexpr int kSectors = 24;
  using Panorama = std::array<double, kSectors>;  ///< by azimuth sector, m3

  /// @param one_by_one  rays are followed one by one also where several can be at once; gains are the same
  /// @throws InputError when kEntropy is asked for and the map's sensor model teaches nothing
  explicit ViewGain(const ViewGainConfig& config, bool one_by_one = false);

  /// @param foreseen counts nothing; may be null
  Panorama panorama(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m,
                    const Foreseen* foreseen = nullptr) const;
  /// Of those sectors that the sensor sees at this yaw.
  double in_view_m3(const Panorama& sectors, double yaw_rad) const;
  double gain_m3(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, double yaw_rad,
                 const Foreseen* foreseen = nullptr) const;
  /// Marks what counts in a look from there, with rays so dense that they leave nothing out.
  void foresee(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, double yaw_rad,
               Foreseen& foreseen) const;

 private:
  static constexpr int kRows = 6;  ///< rays of a sector, one above the other

  double sector_m3(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, std::size_t sector,
                   const Foreseen* foreseen) const;
  /// Of the sectors of a panorama, one in so many is looked at: of a sensor that sees all round only the sum is asked
  /// for.
  int stride() const { return config_.sensor.panoramic() ? 2 : 1; }
  /// `each(sector)` for those that the sensor sees at this yaw.
  template <typename Each>
  void for_each_in_view(double yaw_rad, const Each& each) const;
  /// Visits the voxels of a ray that a look counts, `each(voxel, distance_m, is unknown)`.
  template <typename Each>
  void follow(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, const Eigen::Vector3d& direction,
              double step_m, const Each& each) const;
  double step_m(const mapping::OccupancyMap& map) const;
  gain_rays::Steps steps(double step_m) const;

  ViewGainConfig config_;
  bool bundled_;                            ///< rays may be followed several at a time
  std::vector<gain_rays::Bundle> bundles_;  ///< of the sectors of a panorama
  std::optional<InformationGain> information_;
  std::array<std::array<Eigen::Vector3d, kRows>, kSectors> directions_;  ///< of the rays
  double solid_angle_ = 0.0;                                             ///< of one
};

}  // namespace stairwell::coverage3d
