/// What the learned path agents are shown, and how their answers become directions (SPEC A5, A17).
#pragma once

#include "learning/nn/network_spec.hpp"
#include "planning3d/arrival_field.hpp"
#include "planning3d/storey_portals.hpp"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::planning3d {

/// The input of a path agent: windows around the UAV in several scales, turned about z so that x points down the way.
struct AgentInput {
  /// kPortals: a cone around the next opening on the way to another storey (StoreyPortals).
  enum class Attraction : std::uint8_t { kCone, kGeodesic, kPortals };
  enum class Channel : std::uint8_t { kClearance, kAttraction, kUnknown, kVisited };

  bool plane = false;                          ///< moves in the layer of the start only
  std::array<int, 3> samples{8, 16, 16};       ///< z, y, x; z = 1 in the plane
  std::vector<double> spacings_m{0.15, 0.45};  ///< fine and coarse
  Attraction attraction = Attraction::kGeodesic;
  std::vector<Channel> channels{Channel::kClearance, Channel::kAttraction, Channel::kUnknown};

  /// @throws InputError for another word than `cone`, `geodesic`, `portals`
  static Attraction attraction_named(std::string_view name);
  static AgentInput slice();   ///< of `path2d`
  static AgentInput volume();  ///< of `path3d`

  /// Numbers beside the windows, all in the turned frame: the way ahead (kPreviews vectors over their arc length), the
  /// goal (vector, 1 from 3 m on), the clearance and its gradient, the way left (1 from 5 m on). With a cone the way
  /// ahead is 0, with kPortals the goal is the opening that comes next.
  static constexpr std::array<double, 4> kPreviews_m{0.3, 0.8, 1.6, 3.0};
  static constexpr int kFeatures = 3 * 4 + 3 + 1 + 3 + 1;

  std::vector<nn::WindowInput> windows() const;
  std::vector<std::string> problems() const;
  /// One line that parse() reads. @throws InputError saying what is wrong.
  std::string text() const;
  static AgentInput parse(std::string_view text);
  friend bool operator==(const AgentInput&, const AgentInput&) = default;
};

/// One look.
struct Observation {
  std::vector<std::uint8_t> windows;
  std::vector<float> features;
  double yaw_rad = 0.0;  ///< world from turned frame
};

/// A unit vector from azimuth and elevation, and back. At the poles the azimuth is 0.
Eigen::Vector3d direction_from_angles(double azimuth_rad, double elevation_rad);
Eigen::Vector2d angles_from_direction(const Eigen::Vector3d& direction);

/// Between a network's outputs and a direction in the turned frame. Of outputs that say nothing: +x.
Eigen::Vector3d direction_of(nn::Head head, bool plane, std::span<const float> outputs);
void outputs_of(nn::Head head, bool plane, const Eigen::Vector3d& direction, std::span<float> outputs);

/// Turns a vector of the turned frame into the world's, or with -yaw the other way round.
Eigen::Vector3d turned(const Eigen::Vector3d& v, double yaw_rad);

/// One UAV's view on its way to one goal. Holds references to the space and the field.
class AgentView {
 public:
  explicit AgentView(const AgentInput& input);

  /// Before the first look of a flight. @param field  computed for the flight's goal, with weight 0
  void begin(const FreeSpace& space, const std::vector<KeepOut>& keep_out, const ArrivalField& field);
  /// Allocates nothing after the first call, except with kPortals.
  void look(const Eigen::Vector3d& at_m, Observation& seen);
  /// Towards where the way leads from the place last looked at, without a network: a unit vector in the world's frame.
  Eigen::Vector3d way_ahead() const;
  double way_left_m() const { return way_left_m_; }
  const AgentInput& input() const { return input_; }

 private:
  void face(const Eigen::Vector3d& at_m, Observation& seen);
  void write_features(const Eigen::Vector3d& at_m, Observation& seen) const;
  /// A vertical line of a window's samples, and the lowest voxel and field cell on it.
  struct Column {
    Eigen::Vector2d at_m;
    std::size_t voxel = 0, cell = 0;
    bool within = false, in_field = false;
  };
  /// A level of a window's samples: what is to be added to its columns' places.
  struct Layer {
    double spacing_m = 0.0, z_m = 0.0;
    std::size_t voxel = 0, cell = 0;
    bool within = false, in_field = false;
  };
  void sample(double spacing_m, const Eigen::Vector3d& at_m, double yaw_rad, std::uint8_t* bytes);
  void find_columns(double spacing_m, const Eigen::Vector3d& at_m, double yaw_rad);
  void sample(const Layer& layer, AgentInput::Channel channel, std::uint8_t* bytes) const;
  void write_cone(const Layer& layer, double span_m, std::uint8_t* bytes) const;
  double clearance_m(const Eigen::Vector3d& at_m) const;

  AgentInput input_;
  const FreeSpace* space_ = nullptr;
  const ArrivalField* field_ = nullptr;
  std::vector<KeepOut> keep_out_;
  std::vector<std::uint8_t> clearance_bytes_;  ///< by squared distance in voxels
  std::vector<std::uint8_t> visited_;          ///< by cell of the field
  std::vector<Column> columns_;                ///< of the window in work
  std::vector<Eigen::Vector3d> way_m_;
  std::array<Eigen::Vector3d, AgentInput::kPreviews_m.size()> previews_;
  double yaw_rad_ = 0.0;
  double way_left_m_ = 0.0;
  StoreyPortals portals_;
  Eigen::Vector3d apex_m_ = Eigen::Vector3d::Zero();  ///< of the cone: the goal or an opening
  double apex_far_m_ = 0.0;                           ///< from the place last looked at
};

}  // namespace stairwell::planning3d
