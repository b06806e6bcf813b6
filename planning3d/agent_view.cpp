#include "planning3d/agent_view.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace stairwell::planning3d {

namespace {

constexpr double kClearanceScale_m = 0.8;  // clearance beyond the robot's that is 1
constexpr double kGoalScale_m = 3.0;
constexpr double kWayScale_m = 5.0;
constexpr double kLeastLevel = 0.25;  // a way ahead that is steeper gives no yaw
constexpr std::array<std::string_view, 3> kAttractions{"cone", "geodesic", "portals"};
constexpr std::array<std::string_view, 4> kChannels{"clearance", "attraction", "unknown", "visited"};

std::uint8_t byte_of(double value) {
  return static_cast<std::uint8_t>(128 + static_cast<int>(std::lround(127.0 * std::clamp(value, -1.0, 1.0))));
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

double number(const std::string& text) {
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size()) throw InputError("input: '" + text + "' is not a number");
  return value;
}

}  // namespace

AgentInput AgentInput::slice() {
  AgentInput input;
  input.plane = true;
  input.samples = {1, 32, 32};
  input.spacings_m = {0.1, 0.3};
  return input;
}

AgentInput AgentInput::volume() { return {}; }

std::vector<nn::WindowInput> AgentInput::windows() const {
  return std::vector<nn::WindowInput>(spacings_m.size(), {static_cast<int>(channels.size()), samples});
}

std::vector<std::string> AgentInput::problems() const {
  std::vector<std::string> list;
  for (const int n : samples) {
    if (n < 1 || n > 256) list.emplace_back("samples must be 1 to 256 along each axis");
  }
  if (plane && samples[0] != 1) list.emplace_back("a window of the plane has one sample along z");
  for (const double spacing : spacings_m) {
    if (!(spacing > 0.0 && spacing <= 100.0)) list.emplace_back("spacings must be above 0, at most 100 m");
  }
  if (plane && attraction == Attraction::kPortals) list.emplace_back("attraction portals is for volumes");
  if (spacings_m.empty() || channels.empty()) list.emplace_back("there must be a window and a channel");
  return list;
}

std::string AgentInput::text() const {
  std::ostringstream out;
  out << (plane ? "plane" : "volume") << " samples " << samples[0] << 'x' << samples[1] << 'x' << samples[2]
      << " spacings_m ";
  for (std::size_t i = 0; i < spacings_m.size(); ++i) out << (i > 0 ? "," : "") << spacings_m[i];
  out << " attraction " << kAttractions[static_cast<std::size_t>(attraction)] << " channels ";
  for (std::size_t i = 0; i < channels.size(); ++i) {
    out << (i > 0 ? "," : "") << kChannels[static_cast<std::size_t>(channels[i])];
  }
  return out.str();
}

AgentInput::Attraction AgentInput::attraction_named(std::string_view name) {
  const auto found = std::ranges::find(kAttractions, name);
  if (found == kAttractions.end()) throw InputError("input: unknown attraction '" + std::string(name) + "'");
  return static_cast<Attraction>(found - kAttractions.begin());
}

AgentInput AgentInput::parse(std::string_view text) {
  std::istringstream in{std::string(text)};
  std::string kind, key, value;
  in >> kind;
  if (kind != "plane" && kind != "volume") throw InputError("input: '" + kind + "' is neither plane nor volume");
  AgentInput input;
  input.plane = kind == "plane";
  while (in >> key) {
    if (!(in >> value)) throw InputError("input: no value after '" + key + "'");
    if (key == "samples") {
      const auto parts = split(value, 'x');
      if (parts.size() != 3) throw InputError("input: samples '" + value + "' are not ZxYxX");
      for (std::size_t a = 0; a < 3; ++a) input.samples[a] = static_cast<int>(number(parts[a]));
    } else if (key == "spacings_m") {
      input.spacings_m.clear();
      for (const std::string& part : split(value, ',')) input.spacings_m.push_back(number(part));
    } else if (key == "attraction") {
      input.attraction = attraction_named(value);
    } else if (key == "channels") {
      input.channels.clear();
      for (const std::string& part : split(value, ',')) {
        const auto found = std::ranges::find(kChannels, part);
        if (found == kChannels.end()) throw InputError("input: unknown channel '" + part + "'");
        input.channels.push_back(static_cast<Channel>(found - kChannels.begin()));
      }
    } else {
      throw InputError("input: unknown word '" + key + "'");
    }
  }
  if (const auto list = input.problems(); !list.empty()) throw InputError("input: " + list.front());
  return input;
}

Eigen::Vector3d direction_from_angles(double azimuth_rad, double elevation_rad) {
  return {std::cos(azimuth_rad) * std::cos(elevation_rad), std::sin(azimuth_rad) * std::cos(elevation_rad),
          std::sin(elevation_rad)};
}

Eigen::Vector2d angles_from_direction(const Eigen::Vector3d& direction) {
  const double level = direction.head<2>().norm();
  const double azimuth = level > 1e-12 ? std::atan2(direction.y(), direction.x()) : 0.0;
  return {azimuth, std::atan2(direction.z(), level)};
}

Eigen::Vector3d direction_of(nn::Head head, bool plane, std::span<const float> outputs) {
  if (head == nn::Head::kAngles) {
    return direction_from_angles(kPi * static_cast<double>(outputs[0]),
                                 plane ? 0.0 : 0.5 * kPi * static_cast<double>(outputs[1]));
  }
  const Eigen::Vector3d v(outputs[0], outputs[1], plane ? 0.0 : static_cast<double>(outputs[2]));
  return v.allFinite() && v.norm() > 1e-9 ? v.normalized() : Eigen::Vector3d(Eigen::Vector3d::UnitX());
}

void outputs_of(nn::Head head, bool plane, const Eigen::Vector3d& direction, std::span<float> outputs) {
  if (head == nn::Head::kAngles) {
    const Eigen::Vector2d angles = angles_from_direction(direction);
    outputs[0] = static_cast<float>(angles.x() / kPi);
    if (!plane) outputs[1] = static_cast<float>(angles.y() / (0.5 * kPi));
    return;
  }
  for (std::size_t a = 0; a < (plane ? 2U : 3U); ++a) {
    outputs[a] = static_cast<float>(direction[static_cast<Eigen::Index>(a)]);
  }
}

Eigen::Vector3d turned(const Eigen::Vector3d& v, double yaw_rad) {
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z()};
}

AgentView::AgentView(const AgentInput& input) : input_(input) {
  if (const auto list = input.problems(); !list.empty()) throw InputError("input: " + list.front());
}

void AgentView::begin(const FreeSpace& space, const std::vector<KeepOut>& keep_out, const ArrivalField& field) {
  space_ = &space;
  field_ = &field;
  keep_out_ = keep_out;
  const int reach = space.blocked_distance().truncation_cells();
  clearance_bytes_.resize(static_cast<std::size_t>(reach * reach) + 1);
  for (std::size_t i = 0; i < clearance_bytes_.size(); ++i) {
    const double clear_m =
        std::sqrt(static_cast<double>(i)) * space.grid().resolution_m() - space.robot().clearance_m();
    clearance_bytes_[i] = byte_of(clear_m / kClearanceScale_m);
  }
  visited_.clear();
  if (std::ranges::find(input_.channels, AgentInput::Channel::kVisited) != input_.channels.end()) {
    visited_.assign(field.cells().size(), 0);
  }
  if (input_.attraction == AgentInput::Attraction::kPortals) portals_ = StoreyPortals(space);
  yaw_rad_ = 0.0;
  previews_.fill(Eigen::Vector3d::Zero());
}

double AgentView::clearance_m(const Eigen::Vector3d& at_m) const {
  double clear_m = space_->room_m(at_m);
  for (const KeepOut& sphere : keep_out_) {
    clear_m = std::min(clear_m, (at_m - sphere.center_m).norm() - sphere.radius_m);
  }
  return clear_m;
}

/// Turns the frame down the way (geodesic) or towards the goal or opening (cone); straight up or down it stays as it
/// was.
void AgentView::face(const Eigen::Vector3d& at_m, Observation& seen) {
  StoreyPortals::Heading heading{field_->goal_m(), 0.0};
  if (input_.attraction == AgentInput::Attraction::kPortals) heading = portals_.towards(at_m, heading.place_m);
  apex_m_ = heading.place_m;
  const Eigen::Vector3d to_goal = apex_m_ - at_m;
  apex_far_m_ = to_goal.norm();
  previews_.fill(Eigen::Vector3d::Zero());
  Eigen::Vector3d ahead = to_goal;
  if (input_.attraction == AgentInput::Attraction::kGeodesic) {
    field_->descend(at_m, AgentInput::kPreviews_m.back(), way_m_);
    way_left_m_ = static_cast<double>(field_->value_m(at_m));
    double gone_m = 0.0;
    std::size_t next = 0;
    for (std::size_t i = 1; i < way_m_.size() && next < previews_.size(); ++i) {
      gone_m += (way_m_[i] - way_m_[i - 1]).norm();
      while (next < previews_.size() && gone_m >= AgentInput::kPreviews_m[next] - 1e-6)
        previews_[next++] = way_m_[i] - at_m;
    }
    while (next < previews_.size()) previews_[next++] = way_m_.empty() ? to_goal : way_m_.back() - at_m;
    ahead = previews_[1];
  } else {
    way_left_m_ = apex_far_m_ + heading.rest_m;
  }
  if (ahead.head<2>().norm() > std::max(1e-6, kLeastLevel * ahead.norm())) {
    yaw_rad_ = std::atan2(ahead.y(), ahead.x());
  } else if (to_goal.head<2>().norm() > 0.3) {
    yaw_rad_ = std::atan2(to_goal.y(), to_goal.x());
  }
  seen.yaw_rad = yaw_rad_;
}

void AgentView::write_features(const Eigen::Vector3d& at_m, Observation& seen) const {
  seen.features.resize(AgentInput::kFeatures);
  float* out = seen.features.data();
  const auto put = [&](const Eigen::Vector3d& v) {
    const Eigen::Vector3d w = turned(v, -seen.yaw_rad);
    for (Eigen::Index a = 0; a < 3; ++a) *out++ = static_cast<float>(w[a]);
  };
  const bool geodesic = input_.attraction == AgentInput::Attraction::kGeodesic;
  for (std::size_t i = 0; i < previews_.size(); ++i) {
    put(geodesic ? Eigen::Vector3d(previews_[i] / AgentInput::kPreviews_m[i])
                 : Eigen::Vector3d(Eigen::Vector3d::Zero()));
  }
  const Eigen::Vector3d to_goal = apex_m_ - at_m;
  put(to_goal / std::max(kGoalScale_m, to_goal.norm()));
  *out++ = static_cast<float>(std::clamp(clearance_m(at_m) / kClearanceScale_m, -1.0, 1.0));
  const double step_m = space_->grid().resolution_m();
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (Eigen::Index a = 0; a < (input_.plane ? 2 : 3); ++a) {
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    offset[a] = step_m;
    slope[a] = std::clamp((clearance_m(at_m + offset) - clearance_m(at_m - offset)) / (2.0 * step_m), -1.0, 1.0);
  }
  put(slope);
  *out++ = static_cast<float>(std::min(1.0, way_left_m_ / kWayScale_m));
}

/// The frame turns about z only: which voxels and cells a window's columns stand in is found out once for all layers.
void AgentView::find_columns(double spacing_m, const Eigen::Vector3d& at_m, double yaw_rad) {
  const GridSpec& grid = space_->grid();
  const int ny = input_.samples[1], nx = input_.samples[2];
  const Eigen::Vector3d along_x = spacing_m * turned(Eigen::Vector3d::UnitX(), yaw_rad);
  const Eigen::Vector3d along_y = spacing_m * turned(Eigen::Vector3d::UnitY(), yaw_rad);
  const double per_cell = 1.0 / field_->cell_m();
  const Eigen::Vector3d to_cells = -field_->origin_m() * per_cell;
  columns_.resize(static_cast<std::size_t>(ny) * static_cast<std::size_t>(nx));
  std::size_t i = 0;
  for (int y = 0; y < ny; ++y) {
    Eigen::Vector3d p = at_m + (y - 0.5 * (ny - 1)) * along_y - 0.5 * (nx - 1) * along_x;
    for (int x = 0; x < nx; ++x, ++i, p += along_x) {
      const VoxelIndex v = grid.index_of(p);
      const Eigen::Vector3d c = p * per_cell + to_cells;
      const int cx = static_cast<int>(c.x()), cy = static_cast<int>(c.y());
      Column& column = columns_[i];
      column.at_m = p.head<2>();
      column.within = grid.contains(VoxelIndex{v.x, v.y, 0});
      column.in_field = column.within && cx >= 0 && cy >= 0 && cx < field_->size()[0] && cy < field_->size()[1];
      column.voxel = column.within ? grid.linear({v.x, v.y, 0}) : 0;
      column.cell = column.in_field ? field_->linear(cx, cy, 0) : 0;
    }
  }
}

void AgentView::sample(double spacing_m, const Eigen::Vector3d& at_m, double yaw_rad, std::uint8_t* bytes) {
  find_columns(spacing_m, at_m, yaw_rad);
  const GridSpec& grid = space_->grid();
  const int nz = input_.samples[0];
  const std::size_t plane = columns_.size() * static_cast<std::size_t>(nz);
  const double per_cell = 1.0 / field_->cell_m();
  for (int z = 0; z < nz; ++z, bytes += columns_.size()) {
    Layer layer;
    layer.spacing_m = spacing_m;
    layer.z_m = at_m.z() + (z - 0.5 * (nz - 1)) * spacing_m;
    const int voxel_z = grid.index_of({at_m.x(), at_m.y(), layer.z_m}).z;
    layer.within = voxel_z >= 0 && voxel_z < grid.size()[2];
    layer.voxel = layer.within ? grid.linear({0, 0, voxel_z}) : 0;
    const int cell_z = input_.plane ? 0 : static_cast<int>(layer.z_m * per_cell - field_->origin_m().z() * per_cell);
    layer.in_field = layer.within && cell_z >= 0 && cell_z < field_->size()[2];
    layer.cell = layer.in_field ? field_->linear(0, 0, cell_z) - field_->linear(0, 0, 0) : 0;
    for (std::size_t i = 0; i < input_.channels.size(); ++i) sample(layer, input_.channels[i], bytes + i * plane);
  }
}

void AgentView::sample(const Layer& layer, AgentInput::Channel channel, std::uint8_t* bytes) const {
  const std::size_t count = columns_.size();
  const auto write = [&](bool is_inside, bool Column::*column_is_inside, std::uint8_t outside, auto byte) {
    std::fill_n(bytes, count, outside);
    for (const Column *c = columns_.data(), *end = c + count; is_inside && c != end; ++c, ++bytes) {
      if (c->*column_is_inside) *bytes = static_cast<std::uint8_t>(byte(*c));
    }
  };
  switch (channel) {
    case AgentInput::Channel::kClearance:
      return write(
          layer.within, &Column::within, clearance_bytes_[0],
          [table = clearance_bytes_.data(), squared_cells = space_->blocked_distance().data().data() + layer.voxel](
              const Column& c) { return table[squared_cells[c.voxel]]; });
    case AgentInput::Channel::kAttraction: {
      const double span_m = 0.5 * layer.spacing_m * input_.samples[2];
      if (input_.attraction != AgentInput::Attraction::kGeodesic) return write_cone(layer, span_m, bytes);
      return write(
          layer.in_field, &Column::in_field, 255,
          [arrival = field_->cells().data() + layer.cell, scale = static_cast<float>(127.0 * field_->cell_m() / span_m),
           here = static_cast<float>(way_left_m_ * (1.0 / field_->cell_m()))](const Column& c) {
            const float t = (arrival[c.cell] - here) * scale;
            return 128 + static_cast<int>(std::min(127.0F, std::max(-127.0F, t)));
          });
    }
    case AgentInput::Channel::kUnknown:
      return write(layer.within, &Column::within, 255, [&map = space_->map(), first = layer.voxel](const Column& c) {
        return map.at(first + c.voxel) != Occupancy::kUnknown ? 128 : 255;
      });
    case AgentInput::Channel::kVisited:
      return write(layer.in_field, &Column::in_field, 128, [visited = visited_.data() + layer.cell](const Column& c) {
        return visited[c.cell] != 0 ? 255 : 128;
      });
  }
}

void AgentView::write_cone(const Layer& layer, double span_m, std::uint8_t* bytes) const {
  for (const Column& c : columns_) {
    const Eigen::Vector3d p(c.at_m.x(), c.at_m.y(), layer.z_m);
    *bytes++ = byte_of(((p - apex_m_).norm() - apex_far_m_) / span_m);
  }
}

void AgentView::look(const Eigen::Vector3d& at_m, Observation& seen) {
  face(at_m, seen);
  write_features(at_m, seen);
  if (!visited_.empty()) {
    const Eigen::Vector3d c = (at_m - field_->origin_m()) / field_->cell_m();
    const std::array<int, 3> cell{static_cast<int>(c.x()), static_cast<int>(c.y()),
                                  input_.plane ? 0 : static_cast<int>(c.z())};
    const auto& size = field_->size();
    if (c.minCoeff() >= 0.0 && cell[0] < size[0] && cell[1] < size[1] && cell[2] < size[2]) {
      visited_[field_->linear(cell[0], cell[1], cell[2])] = 1;
    }
  }
  const std::size_t one = static_cast<std::size_t>(input_.samples[0]) * static_cast<std::size_t>(input_.samples[1]) *
                          static_cast<std::size_t>(input_.samples[2]) * input_.channels.size();
  seen.windows.resize(one * input_.spacings_m.size());
  for (std::size_t w = 0; w < input_.spacings_m.size(); ++w) {
    sample(input_.spacings_m[w], at_m, seen.yaw_rad, seen.windows.data() + w * one);
  }
}

Eigen::Vector3d AgentView::way_ahead() const {
  Eigen::Vector3d ahead = previews_[0];
  if (ahead.norm() < 1e-9) return turned(Eigen::Vector3d::UnitX(), yaw_rad_);
  if (input_.plane) ahead.z() = 0.0;
  return ahead.normalized();
}

}  // namespace stairwell::planning3d
