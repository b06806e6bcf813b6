#include "sim3d/generator.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::sim3d {
namespace {

struct Span {
  double lo = 0.0;
  double hi = 0.0;
  double size() const { return hi - lo; }
  double mid() const { return 0.5 * (lo + hi); }
};

struct Rectangle {
  Span u;
  Span v;
};

constexpr double kSlab_m = 0.2;
constexpr double kWall_m = 0.1;
constexpr double kOuterWall_m = 0.2;
constexpr double kCorridorHalf_m = 1.05;
constexpr double kStairWidth_m = 3.1;
constexpr double kStairLanding_m = 1.1;  ///< between corridor wall and stair opening
constexpr double kMinRoom_m = 2.6;
constexpr double kRoomDepth_m = 6.0;       ///< of rooms in buildings so deep that they have several corridors, about
constexpr double kCrossCorridor_m = 40.0;  ///< one in about so much width, in those buildings
constexpr double kFloorOffset_m = -0.05;   ///< floors lie inside the voxels of a 0.1 m map, not on their faces
// A gap is either closed or at least this wide, so that clutter, inflated by a robot of 0.3 m and some spare, never
// joins with anything else: rooms stay connected by construction.
constexpr double kMinGap_m = 0.85;
constexpr double kSame_m = 1e-3;  ///< coordinates nearer than this are one

void append_number(std::string& text, double value) {
  std::array<char, 64> buffer{};
  const double rounded = std::round(value * 1e4) / 1e4 + 0.0;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), rounded, std::chars_format::fixed, 4);
  text.append(buffer.data(), end.ptr);
}

/// Collects boxes of one static model.
class SceneWriter {
 public:
  void block(std::string_view label, Span x, Span y, Span z) {
    std::string shape = "<pose>";
    for (const double value : {x.mid(), y.mid(), z.mid()}) {
      append_number(shape, value);
      shape += ' ';
    }
    shape += "0 0 0</pose><geometry><box><size>";
    for (const double value : {x.size(), y.size(), z.size()}) {
      append_number(shape, value);
      shape += ' ';
    }
    shape.back() = '<';
    shape += "/size></box></geometry>";
    const std::string name = std::string(label) + '_' + std::to_string(count_++);
    for (const std::string_view kind : {"collision", "visual"}) {
      body_.append("        <").append(kind).append(" name=\"").append(name).append("_").append(kind).append("\">");
      body_.append(shape).append("</").append(kind).append(">\n");
    }
  }

  std::string finish(std::string_view comment) const {
    std::string text = "<?xml version=\"1.0\"?>\n<!-- ";
    text.append(comment).append(" -->\n<sdf version=\"1.9\">\n  <world name=\"generated\">\n");
    text.append("    <model name=\"building\">\n      <static>true</static>\n      <link name=\"structure\">\n");
    text.append(body_).append("      </link>\n    </model>\n  </world>\n</sdf>\n");
    return text;
  }

 private:
  std::string body_;
  int count_ = 0;
};

std::vector<double> cuts(Span span, const std::vector<Rectangle>& holes, Span Rectangle::*side) {
  std::vector<double> values{span.lo, span.hi};
  for (const Rectangle& hole : holes) {
    values.push_back(std::clamp((hole.*side).lo, span.lo, span.hi));
    values.push_back(std::clamp((hole.*side).hi, span.lo, span.hi));
  }
  std::sort(values.begin(), values.end());
  const auto same = [](double a, double b) { return b - a < kSame_m; };
  values.erase(std::unique(values.begin(), values.end(), same), values.end());
  return values;
}

/// The plate minus its holes as disjoint rectangles.
std::vector<Rectangle> minus_holes(Rectangle plate, const std::vector<Rectangle>& holes) {
  const std::vector<double> us = cuts(plate.u, holes, &Rectangle::u);
  const std::vector<double> vs = cuts(plate.v, holes, &Rectangle::v);
  const auto open = [&holes](Span u, Span v) {
    return std::any_of(holes.begin(), holes.end(), [&](const Rectangle& h) {
      return h.u.lo <= u.mid() && u.mid() <= h.u.hi && h.v.lo <= v.mid() && v.mid() <= h.v.hi;
    });
  };
  std::vector<Rectangle> pieces;
  for (std::size_t j = 0; j + 1 < vs.size(); ++j) {
    const Span v{vs[j], vs[j + 1]};
    bool extend = false;
    for (std::size_t i = 0; i + 1 < us.size(); ++i) {
      const Span u{us[i], us[i + 1]};
      if (open(u, v)) {
        extend = false;
      } else if (extend) {
        pieces.back().u.hi = u.hi;
      } else {
        pieces.push_back({u, v});
        extend = true;
      }
    }
  }
  return pieces;
}

void wall_along_x(SceneWriter& scene, Span x, double y, Span z, const std::vector<Rectangle>& openings) {
  for (const Rectangle& piece : minus_holes({x, z}, openings)) {
    scene.block("wall", piece.u, {y - 0.5 * kWall_m, y + 0.5 * kWall_m}, piece.v);
  }
}

void wall_along_y(SceneWriter& scene, double x, Span y, Span z, const std::vector<Rectangle>& openings) {
  for (const Rectangle& piece : minus_holes({y, z}, openings)) {
    scene.block("wall", {x - 0.5 * kWall_m, x + 0.5 * kWall_m}, piece.u, piece.v);
  }
}

/// What all storeys share.
struct Plan {
  static constexpr double kBetweenRows_m = 2.0 * kCorridorHalf_m + 3.0 * kWall_m;  ///< a corridor and walls of two rows

  Span x;  ///< interior
  Span y;
  bool stairs_east = true;
  bool stairs_north = true;
  Span stair_x;    ///< stair room, against an outer wall
  Span opening_y;  ///< stair opening through the slabs
  bool flights = true;
  int storeys = 1;
  double height_m = 3.0;
  int more_corridors = 0;       ///< parallel to the first one, on each side of it
  std::vector<Span> crossings;  ///< corridors along y that join them

  double floor_z(int storey) const { return storey * height_m + kFloorOffset_m; }
  Span room_z(int storey) const { return {floor_z(storey), floor_z(storey) + height_m - kSlab_m}; }
  Span side_y(bool north) const {
    const double inner = kCorridorHalf_m + 0.5 * kWall_m;
    return north ? Span{inner, y.hi} : Span{y.lo, -inner};
  }
  /// Depth of the rows of rooms: one next to the first corridor, two between any two corridors.
  double row_m() const { return (side_y(true).size() - more_corridors * kBetweenRows_m) / (2 * more_corridors + 1); }
  /// Along y, of what lies `from` to `to` metres beyond the first corridor.
  Span away_y(bool north, double from, double to) const {
    const Span side = side_y(north);
    return north ? Span{side.lo + from, side.lo + to} : Span{side.hi - to, side.hi - from};
  }
};

Plan make_plan(const GeneratorConfig& config) {
  Rng rng = make_rng(config.seed, "generator/plan");
  const auto half = [](double size_m) { return std::round(5.0 * size_m) / 10.0 + 0.05; };
  Plan plan;
  plan.storeys = config.storeys;
  plan.height_m = config.storey_height_m;
  plan.x = {-half(config.width_m), half(config.width_m)};
  plan.y = {-half(config.depth_m), half(config.depth_m)};
  plan.stairs_east = rng.uniform() < 0.5;
  plan.stairs_north = rng.uniform() < 0.5;
  plan.stair_x =
      plan.stairs_east ? Span{plan.x.hi - kStairWidth_m, plan.x.hi} : Span{plan.x.lo, plan.x.lo + kStairWidth_m};
  const double side_m = plan.side_y(true).size();
  plan.more_corridors =
      static_cast<int>(std::round((side_m - kRoomDepth_m) / (2.0 * (kRoomDepth_m + kCorridorHalf_m))));
  const int crossings = plan.more_corridors == 0 ? 0 : std::max(1, static_cast<int>(plan.x.size() / kCrossCorridor_m));
  for (int i = 0; i < crossings; ++i) {  // the first at the end without stairs
    const double lo = plan.x.size() / crossings * i;
    const double hi = lo + 2.0 * kCorridorHalf_m;
    plan.crossings.push_back(plan.stairs_east ? Span{plan.x.lo + lo, plan.x.lo + hi}
                                              : Span{plan.x.hi - hi, plan.x.hi - lo});
  }
  std::sort(plan.crossings.begin(), plan.crossings.end(), [](Span a, Span b) { return a.lo < b.lo; });
  const Span side = plan.away_y(plan.stairs_north, 0.0, plan.row_m());
  const double length = std::min(4.0, side.size() - kStairLanding_m);
  plan.opening_y = plan.stairs_north ? Span{side.lo + kStairLanding_m, side.lo + kStairLanding_m + length}
                                     : Span{side.hi - kStairLanding_m - length, side.hi - kStairLanding_m};
  plan.flights = length >= 3.4;
  return plan;
}

/// Half-turn stairs with an open eye of 1.1 m between the flights: the first flight leads away from the corridor.
void write_flights(SceneWriter& scene, const Plan& plan, int storey) {
  constexpr int kSteps = 8;
  constexpr double kFlight_m = 1.0;
  constexpr double kTurn_m = 1.1;
  constexpr double kThickness_m = 0.3;
  const double floor = plan.floor_z(storey);
  const double rise = 0.5 * plan.height_m / kSteps;
  const double run = (plan.opening_y.size() - kTurn_m) / kSteps;
  const double near = plan.stairs_north ? plan.opening_y.lo : plan.opening_y.hi;
  const double away = plan.stairs_north ? 1.0 : -1.0;
  const auto tread = [&](int i) {
    const double a = near + away * run * i;
    const double b = near + away * run * (i + 1);
    return Span{std::min(a, b), std::max(a, b)};
  };
  for (int i = 0; i < kSteps; ++i) {
    const double top = floor + rise * (i + 1);
    scene.block("step", {plan.stair_x.lo, plan.stair_x.lo + kFlight_m}, tread(i),
                {std::max(floor, top - kThickness_m), top});
    const double upper = floor + 0.5 * plan.height_m + rise * (i + 1);
    scene.block("step", {plan.stair_x.hi - kFlight_m, plan.stair_x.hi}, tread(kSteps - 1 - i),
                {upper - kThickness_m, upper});
  }
  const double turn = near + away * run * kSteps;
  const double far = near + away * plan.opening_y.size();
  const double half = floor + 0.5 * plan.height_m;
  scene.block("landing", plan.stair_x, {std::min(turn, far), std::max(turn, far)}, {half - kSlab_m, half});
}

struct Box2 {
  Span x;
  Span y;
};

double gap(Span a, Span b) { return std::max(b.lo - a.hi, a.lo - b.hi); }

/// Places boxes that touch walls or keep kMinGap_m from them, from each other and from the doors.
void write_clutter(SceneWriter& scene, Rng& rng, const Box2& room, const std::vector<Box2>& doors, Span z) {
  std::vector<Box2> placed = doors;
  const int wanted = rng.uniform_int(0, 2 + static_cast<int>(room.x.size() * room.y.size() / 8.0));
  // One coordinate: against the low wall, against the high wall, or anywhere with a gap to both.
  const auto place = [&rng](Span side, double size) {
    const double choice = rng.uniform();
    const double where = rng.uniform();
    const double spare = side.size() - size - 2.0 * kMinGap_m;
    if (choice < 0.3 || spare < 0.0) {
      return choice < 0.15 || (spare < 0.0 && choice < 0.5) ? Span{side.lo, side.lo + size}
                                                            : Span{side.hi - size, side.hi};
    }
    const double lo = side.lo + kMinGap_m + where * spare;
    return Span{lo, lo + size};
  };
  for (int i = 0; i < wanted; ++i) {
    const double largest_x = std::min(1.8, room.x.size() - kMinGap_m);
    const double largest_y = std::min(1.8, room.y.size() - kMinGap_m);
    const double size_x = std::min(largest_x, rng.uniform(0.3, 1.8));
    const double size_y = std::min(largest_y, rng.uniform(0.3, 1.8));
    const double height = rng.uniform(0.4, std::min(1.9, z.size() - 0.6));
    const Box2 item{place(room.x, size_x), place(room.y, size_y)};
    const bool clear = std::all_of(placed.begin(), placed.end(), [&](const Box2& other) {
      return std::max(gap(item.x, other.x), gap(item.y, other.y)) >= kMinGap_m;
    });
    if (clear) {
      placed.push_back(item);
      scene.block("clutter", item.x, item.y, {z.lo, z.lo + height});
    }
  }
}

Rectangle door_in(Rng& rng, Span side, Span z) {
  const double width = rng.uniform(0.9, 1.3);
  const double spare = side.size() - width - 0.4;
  const double lo = side.lo + 0.2 + rng.uniform() * std::max(0.0, spare);
  return {{lo, lo + width}, {z.lo, z.lo + std::min(2.1, z.size() - 0.1)}};
}

/// A row of rooms on one storey, north or south of a corridor, with doors to the corridor and some between the rooms.
std::vector<Rectangle> write_rooms(SceneWriter& scene, Rng& rng, Span x, Span y, Span z, bool north) {
  std::vector<double> borders{x.lo};
  while (x.hi - borders.back() > 2.0 * kMinRoom_m) {
    const double widest = std::min(7.0, x.hi - borders.back() - kMinRoom_m);
    borders.push_back(borders.back() + rng.uniform(kMinRoom_m, widest));
  }
  borders.push_back(x.hi);

  std::vector<Rectangle> corridor_doors;
  std::vector<std::vector<Box2>> keep_clear(borders.size() - 1);
  for (std::size_t i = 0; i + 1 < borders.size(); ++i) {
    const double left = i == 0 ? x.lo : borders[i] + 0.5 * kWall_m;
    const double right = i + 2 == borders.size() ? x.hi : borders[i + 1] - 0.5 * kWall_m;
    const Rectangle door = door_in(rng, {left, right}, z);
    corridor_doors.push_back(door);
    const double line = north ? y.lo : y.hi;
    keep_clear[i].push_back({door.u, {line, line}});
    if (i + 2 == borders.size()) {
      continue;
    }
    std::vector<Rectangle> between;
    if (rng.uniform() < 0.3) {
      between.push_back(door_in(rng, y, z));
      keep_clear[i].push_back({{borders[i + 1], borders[i + 1]}, between.back().u});
      keep_clear[i + 1].push_back(keep_clear[i].back());
    }
    wall_along_y(scene, borders[i + 1], y, z, between);
  }
  for (std::size_t i = 0; i + 1 < borders.size(); ++i) {
    const double left = i == 0 ? x.lo : borders[i] + 0.5 * kWall_m;
    const double right = i + 2 == borders.size() ? x.hi : borders[i + 1] - 0.5 * kWall_m;
    write_clutter(scene, rng, {{left, right}, y}, keep_clear[i], z);
  }
  return corridor_doors;
}

/// A row of rooms with the wall to their corridor, which is north or south of them; rooms end where stairs begin.
void write_row(SceneWriter& scene, Rng& rng, const Plan& plan, Span x, Span y, Span z, bool north, bool stairs) {
  Span rooms = x;
  std::vector<Rectangle> doors;
  if (stairs) {
    const double wall = plan.stairs_east ? plan.stair_x.lo - 0.5 * kWall_m : plan.stair_x.hi + 0.5 * kWall_m;
    wall_along_y(scene, wall, y, z, {});
    (plan.stairs_east ? rooms.hi : rooms.lo) = wall + (plan.stairs_east ? -0.5 : 0.5) * kWall_m;
    doors.push_back(
        {{plan.stair_x.mid() - 0.6, plan.stair_x.mid() + 0.6}, {z.lo, z.lo + std::min(2.1, z.size() - 0.1)}});
  }
  const std::vector<Rectangle> room_doors = write_rooms(scene, rng, rooms, y, z, north);
  doors.insert(doors.end(), room_doors.begin(), room_doors.end());
  wall_along_x(scene, x, north ? y.lo - 0.5 * kWall_m : y.hi + 0.5 * kWall_m, z, doors);
}

/// The rows of rooms on one side of the first corridor on one storey, between two crossings or outer walls.
void write_block(SceneWriter& scene, Rng& rng, const Plan& plan, Span x, bool north, Span z) {
  const double row = plan.row_m();
  const bool stairs = north == plan.stairs_north && x.lo <= plan.stair_x.lo && plan.stair_x.hi <= x.hi;
  for (int i = 0; i <= plan.more_corridors; ++i) {
    const double near = i * (2.0 * row + Plan::kBetweenRows_m);
    double far = near + row;
    write_row(scene, rng, plan, x, plan.away_y(north, near, far), z, north, stairs && i == 0);
    if (i < plan.more_corridors) {
      wall_along_x(scene, x, plan.away_y(north, far, far + kWall_m).mid(), z, {});
      write_row(scene, rng, plan, x, plan.away_y(north, far + kWall_m, far + kWall_m + row), z, !north, false);
      far += kWall_m + row;
    }
    const Span ends = plan.away_y(north, near - kWall_m, i < plan.more_corridors ? far + kWall_m : far);
    if (x.lo > plan.x.lo) wall_along_y(scene, x.lo - 0.5 * kWall_m, ends, z, {});
    if (x.hi < plan.x.hi) wall_along_y(scene, x.hi + 0.5 * kWall_m, ends, z, {});
  }
}

/// One side of the first corridor on one storey.
void write_side(SceneWriter& scene, Rng& rng, const Plan& plan, bool north, Span z) {
  double from = plan.x.lo;
  for (const Span crossing : plan.crossings) {
    if (crossing.lo > from) write_block(scene, rng, plan, {from, crossing.lo - kWall_m}, north, z);
    from = crossing.hi + kWall_m;
  }
  if (from < plan.x.hi) write_block(scene, rng, plan, {from, plan.x.hi}, north, z);
}

void write_storey(SceneWriter& scene, const Plan& plan, const GeneratorConfig& config, int storey) {
  Rng rng = make_rng(config.seed, "generator/storey" + std::to_string(storey));
  const Span z = plan.room_z(storey);
  if (storey > 0) {
    std::vector<Rectangle> holes{{plan.stair_x, plan.opening_y}};
    if (rng.uniform() < 0.35) {  // a hatch at the corridor's other end
      const double x = plan.stairs_east ? plan.x.lo + 1.2 : plan.x.hi - 1.2;
      holes.push_back({{x - 0.5, x + 0.5}, {-0.5, 0.5}});
    }
    for (const Rectangle& piece : minus_holes({plan.x, plan.y}, holes)) {
      scene.block("slab", piece.u, piece.v, {z.lo - kSlab_m, z.lo});
    }
  }
  if (plan.flights && storey + 1 < plan.storeys) {
    write_flights(scene, plan, storey);
  }
  for (const bool north : {false, true}) write_side(scene, rng, plan, north, z);
}

void write_shell(SceneWriter& scene, const Plan& plan) {
  const Span x = plan.x;
  const Span y = plan.y;
  const Span z{plan.floor_z(0), plan.room_z(plan.storeys - 1).hi};
  const Span outer_x{x.lo - kOuterWall_m, x.hi + kOuterWall_m};
  const Span outer_y{y.lo - kOuterWall_m, y.hi + kOuterWall_m};
  scene.block("ground", outer_x, outer_y, {z.lo - kSlab_m, z.lo});
  scene.block("roof", outer_x, outer_y, {z.hi, z.hi + kSlab_m});
  scene.block("outer_wall", outer_x, {outer_y.lo, y.lo}, z);
  scene.block("outer_wall", outer_x, {y.hi, outer_y.hi}, z);
  scene.block("outer_wall", {outer_x.lo, x.lo}, y, z);
  scene.block("outer_wall", {x.hi, outer_x.hi}, y, z);
}

std::string describe(const GeneratorConfig& config) {
  std::string text = "Generated building: " + std::to_string(config.storeys) + " storeys of ";
  append_number(text, config.storey_height_m);
  text += " m, ";
  append_number(text, config.width_m);
  text += " x ";
  append_number(text, config.depth_m);
  text += " m, seed " + std::to_string(config.seed) + ". Starts: along the corridor, 0,0,0.95 and 1.5 m apart in x.";
  return text;
}

}  // namespace

std::vector<std::string> GeneratorConfig::problems() const {
  std::vector<std::string> found;
  const auto check = [&found](std::string_view name, double value, double lo, double hi) {
    if (!(value >= lo && value <= hi)) {  // also catches NaN
      std::string line = std::string(name) + " must be between ";
      append_number(line, lo);
      line += " and ";
      append_number(line, hi);
      line += ", not " + std::to_string(value);
      found.push_back(std::move(line));
    }
  };
  if (storeys < 1 || storeys > 50) {
    found.push_back("storeys must be between 1 and 50, not " + std::to_string(storeys));
  }
  check("width_m", width_m, 9.0, 200.0);
  check("depth_m", depth_m, 8.0, 200.0);
  check("storey_height_m", storey_height_m, 2.4, 10.0);
  return found;
}

std::string generate_building(const GeneratorConfig& config) {
  const std::vector<std::string> found = config.problems();
  if (!found.empty()) {
    std::string message = "generate_building: " + found.front();
    for (std::size_t i = 1; i < found.size(); ++i) {
      message += "; " + found[i];
    }
    throw InputError(message);
  }
  SceneWriter scene;
  const Plan plan = make_plan(config);
  write_shell(scene, plan);
  for (int storey = 0; storey < config.storeys; ++storey) {
    write_storey(scene, plan, config, storey);
  }
  return scene.finish(describe(config));
}

}  // namespace stairwell::sim3d
