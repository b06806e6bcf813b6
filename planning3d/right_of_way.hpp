/// Who goes first through what only one UAV fits through at a time, seen from positions and velocities alone.
#pragma once

#include "planning3d/free_space.hpp"
#include "planning3d/orca.hpp"
#include "planning3d/path_follower.hpp"

#include <utility>
#include <vector>

namespace stairwell::planning3d {

/// A part of a path beside, above or below which a fellow has no room: a door, a hatch, a narrow corridor.
struct NarrowSection {
  double from_m;  ///< along the path
  double to_m;
  std::vector<Eigen::Vector3d> points_m;  ///< along it, both ends included
};

/// @param abreast_m distance between the centres of two UAVs that pass each other
std::vector<NarrowSection> narrow_sections(const FreeSpace& space, const PathFollower& path, double abreast_m);

/// One rule for all: of the UAVs that fly towards a narrow section, the nearest goes first (the lower number where two
/// are as near), and nobody enters towards someone inside. The others wait some way before it, so that who comes out
/// has room. Where two met inside, the one with the higher number goes back; and so does, for a while, one that a
/// fellow with a lower number has stopped anywhere else for seconds.
class RightOfWay {
 public:
  /// @param abreast_m as for the sections; nearer than this to a section's line a UAV is inside it
  RightOfWay(std::vector<NarrowSection> sections, double abreast_m)
      : sections_(std::move(sections)), abreast_m_(abreast_m) {}

  /// How far along the path the UAV may fly at present; infinity when nothing holds it. Call once per period.
  double stop_arc_m(const PathFollower& path, const SeenUav& own, const std::vector<SeenUav>& fellows,
                    const OrcaConfig& config);
  const std::vector<NarrowSection>& sections() const { return sections_; }

 private:
  double section_stop_arc_m(const PathFollower& path, const SeenUav& own, const std::vector<SeenUav>& fellows,
                            const OrcaConfig& config) const;

  std::vector<NarrowSection> sections_;
  double abreast_m_;
  double blocked_s_ = 0.0;   ///< without moving, though nothing holds it
  double back_s_ = 0.0;      ///< left of going back ..
  double back_arc_m_ = 0.0;  ///< .. to here
};

}  // namespace stairwell::planning3d
