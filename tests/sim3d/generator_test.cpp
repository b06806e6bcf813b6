// Connectivity of generated buildings and of worlds/*.sdf, on their primitives (boxes, cylinders, spheres).
#include "sim3d/generator.hpp"
#include "core/errors.hpp"

#include <catch2/catch.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

using stairwell::sim3d::generate_building;
using stairwell::sim3d::GeneratorConfig;

struct Primitive {
  std::string name;
  enum class Kind { kBox, kCylinder, kSphere } kind = Kind::kBox;
  Eigen::Isometry3d T_world_shape = Eigen::Isometry3d::Identity();
  Eigen::Vector3d half_m = Eigen::Vector3d::Zero();  ///< cylinder: radius, radius, half length

  /// Distance of a point from the solid, 0 inside.
  double distance_m(const Eigen::Vector3d& point_m) const {
    const Eigen::Vector3d p = T_world_shape.inverse() * point_m;
    if (kind == Kind::kSphere) {
      return std::max(0.0, p.norm() - half_m.x());
    }
    if (kind == Kind::kCylinder) {
      const double side = std::max(0.0, p.head<2>().norm() - half_m.x());
      return std::hypot(side, std::max(0.0, std::abs(p.z()) - half_m.z()));
    }
    return (p.cwiseAbs() - half_m).cwiseMax(0.0).norm();
  }
};

std::vector<double> numbers_in(const std::string& text) {
  std::istringstream in(text);
  std::vector<double> values;
  for (double value = 0.0; in >> value;) {
    values.push_back(value);
  }
  return values;
}

std::vector<Primitive> primitives_of(const std::string& sdf) {
  static const std::regex shape(
      "<collision name=\"([^\"]*)\"><pose>([^<]*)</pose><geometry>"
      "(?:<box><size>([^<]*)</size></box>|<cylinder><radius>([^<]*)</radius><length>([^<]*)</length></cylinder>|"
      "<sphere><radius>([^<]*)</radius></sphere>)</geometry></collision>");
  std::vector<Primitive> found;
  for (std::sregex_iterator it(sdf.begin(), sdf.end(), shape), end; it != end; ++it) {
    const std::vector<double> pose = numbers_in((*it)[2]);
    REQUIRE(pose.size() == 6);
    Primitive primitive;
    primitive.name = (*it)[1];
    primitive.T_world_shape.translation() = Eigen::Vector3d(pose[0], pose[1], pose[2]);
    primitive.T_world_shape.linear() =
        (Eigen::AngleAxisd(pose[5], Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pose[4], Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(pose[3], Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    if ((*it)[3].matched) {
      const std::vector<double> size = numbers_in((*it)[3]);
      REQUIRE(size.size() == 3);
      primitive.half_m = 0.5 * Eigen::Vector3d(size[0], size[1], size[2]);
    } else if ((*it)[4].matched) {
      primitive.kind = Primitive::Kind::kCylinder;
      const double radius = std::stod((*it)[4]);
      primitive.half_m = {radius, radius, 0.5 * std::stod((*it)[5])};
    } else {
      primitive.kind = Primitive::Kind::kSphere;
      primitive.half_m.setConstant(std::stod((*it)[6]));
    }
    REQUIRE(primitive.half_m.minCoeff() > 0.0);
    found.push_back(primitive);
  }
  return found;
}

/// Lattice of positions that a sphere of `radius_m` may take, and the part reached from one of them.
class FreeLattice {
 public:
  FreeLattice(const std::vector<Primitive>& primitives, double step_m, double radius_m) : step_m_(step_m) {
    lo_m_.setConstant(1e9);
    Eigen::Vector3d hi_m = Eigen::Vector3d::Constant(-1e9);
    for (const Primitive& p : primitives) {
      const Eigen::Vector3d extent = p.T_world_shape.linear().cwiseAbs() * p.half_m;
      lo_m_ = lo_m_.cwiseMin(p.T_world_shape.translation() - extent);
      hi_m = hi_m.cwiseMax(p.T_world_shape.translation() + extent);
    }
    for (int i = 0; i < 3; ++i) {
      size_[i] = static_cast<int>(std::ceil((hi_m[i] - lo_m_[i]) / step_m)) + 1;
    }
    state_.assign(
        static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]),
        kFree);
    for (const Primitive& p : primitives) {
      block(p, radius_m);
    }
  }

  bool flood(const Eigen::Vector3d& start_m) {
    std::array<int, 3> start{};
    for (int i = 0; i < 3; ++i) {
      start[static_cast<std::size_t>(i)] = static_cast<int>(std::lround((start_m[i] - lo_m_[i]) / step_m_));
    }
    if (outside(start) || at(start) != kFree) {
      return false;
    }
    std::vector<std::array<int, 3>> open{start};
    at(start) = kReached;
    while (!open.empty()) {
      const std::array<int, 3> cell = open.back();
      open.pop_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const int by : {-1, 1}) {
          std::array<int, 3> next = cell;
          next[axis] += by;
          if (outside(next)) {
            leaked_ = true;
          } else if (at(next) == kFree) {
            at(next) = kReached;
            open.push_back(next);
          }
        }
      }
    }
    return true;
  }

  bool leaked() const { return leaked_; }
  std::size_t reached() const { return static_cast<std::size_t>(std::count(state_.begin(), state_.end(), kReached)); }
  std::size_t missed() const { return static_cast<std::size_t>(std::count(state_.begin(), state_.end(), kFree)); }
  Eigen::Vector3d first_missed_m() const {
    const auto index = std::find(state_.begin(), state_.end(), kFree) - state_.begin();
    return lo_m_ + step_m_ * Eigen::Vector3d(static_cast<double>(index % size_[0]),
                                             static_cast<double>(index / size_[0] % size_[1]),
                                             static_cast<double>(index / size_[0] / size_[1]));
  }
  double highest_reached_m() const {
    const auto last = std::find(state_.rbegin(), state_.rend(), kReached);
    return lo_m_.z() + step_m_ * static_cast<double>((state_.rend() - last - 1) / size_[0] / size_[1]);
  }

 private:
  static constexpr std::uint8_t kFree = 0, kBlocked = 1, kReached = 2;

  bool outside(const std::array<int, 3>& c) const {
    return c[0] < 0 || c[1] < 0 || c[2] < 0 || c[0] >= size_[0] || c[1] >= size_[1] || c[2] >= size_[2];
  }
  std::uint8_t& at(const std::array<int, 3>& c) {
    return state_[(static_cast<std::size_t>(c[2]) * static_cast<std::size_t>(size_[1]) +
                   static_cast<std::size_t>(c[1])) *
                      static_cast<std::size_t>(size_[0]) +
                  static_cast<std::size_t>(c[0])];
  }
  void block(const Primitive& p, double radius_m) {
    const Eigen::Vector3d extent = p.T_world_shape.linear().cwiseAbs() * p.half_m + Eigen::Vector3d::Constant(radius_m);
    std::array<int, 3> lo{}, hi{};
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double center = p.T_world_shape.translation()[i] - lo_m_[i];
      lo[k] = std::max(0, static_cast<int>(std::floor((center - extent[i]) / step_m_)));
      hi[k] = std::min(size_[i] - 1, static_cast<int>(std::ceil((center + extent[i]) / step_m_)));
    }
    for (int z = lo[2]; z <= hi[2]; ++z) {
      for (int y = lo[1]; y <= hi[1]; ++y) {
        for (int x = lo[0]; x <= hi[0]; ++x) {
          if (p.distance_m(lo_m_ + step_m_ * Eigen::Vector3d(x, y, z)) < radius_m) {
            at({x, y, z}) = kBlocked;
          }
        }
      }
    }
  }

  double step_m_;
  Eigen::Vector3d lo_m_;
  Eigen::Vector3i size_;
  std::vector<std::uint8_t> state_;
  bool leaked_ = false;
};

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Start positions named in a world's comment.
std::vector<Eigen::Vector3d> starts_in(const std::string& sdf) {
  const std::string key = "Start positions: ";
  const std::size_t begin = sdf.find(key);
  REQUIRE(begin != std::string::npos);
  std::string line = sdf.substr(begin + key.size(), sdf.find('\n', begin) - begin - key.size());
  std::replace(line.begin(), line.end(), ',', ' ');
  const std::vector<double> values = numbers_in(line);
  REQUIRE(values.size() % 3 == 0);
  std::vector<Eigen::Vector3d> starts;
  for (std::size_t i = 0; i < values.size(); i += 3) {
    starts.emplace_back(values[i], values[i + 1], values[i + 2]);
  }
  return starts;
}

// On a lattice of 0.1 m, a step between two positions with 0.35 m of clearance keeps 0.3 m on its way.
constexpr double kStep_m = 0.1;
constexpr double kClearance_m = 0.35;

void check_connected(const GeneratorConfig& config) {
  CAPTURE(config.seed, config.storeys, config.width_m, config.depth_m, config.storey_height_m);
  FreeLattice lattice(primitives_of(generate_building(config)), kStep_m, kClearance_m);
  REQUIRE(lattice.flood({0.0, 0.0, 0.95}));
  CHECK_FALSE(lattice.leaked());
  INFO("first missed " << lattice.first_missed_m().transpose());
  CHECK(lattice.missed() == 0);
  CHECK(lattice.highest_reached_m() > (config.storeys - 1) * config.storey_height_m + 1.0);
}

}  // namespace

TEST_CASE("generated buildings are closed and connected for a robot of 0.3 m radius") {
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    GeneratorConfig config;
    config.seed = seed;
    config.storeys = 1 + static_cast<int>(seed % 6);
    config.width_m = 9.0 + static_cast<double>(seed % 5) * 2.7;
    config.depth_m = 8.0 + static_cast<double>(seed % 4) * 1.9;
    config.storey_height_m = 2.4 + 0.2 * static_cast<double>(seed % 7);
    check_connected(config);
  }
}

TEST_CASE("so are buildings with several corridors, whose rooms are no deeper than others") {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    GeneratorConfig config;
    config.seed = seed;
    config.storeys = 2;
    config.width_m = seed % 2 == 0 ? 9.0 : 81.0;
    config.depth_m = 28.2 + static_cast<double>(seed % 3) * 14.0;
    check_connected(config);
    Eigen::Vector3d largest_m = Eigen::Vector3d::Zero();
    for (const Primitive& p : primitives_of(generate_building(config))) {
      if (p.name.starts_with("wall")) largest_m = largest_m.cwiseMax(2.0 * p.half_m);
    }
    CHECK(largest_m.y() < 20.0);  // two rows, of rooms of less than 10 m
  }
}

TEST_CASE("the same generator config gives the same text, another seed another one") {
  GeneratorConfig config;
  const std::string text = generate_building(config);
  CHECK(text == generate_building(config));
  config.seed = 2;
  CHECK(text != generate_building(config));
  CHECK(primitives_of(text).size() > 60);
}

TEST_CASE("shape names of a generated building are unique") {
  const std::string text = generate_building({});
  static const std::regex name("<(collision|visual) name=\"([^\"]*)\"");
  std::set<std::string> seen;
  for (std::sregex_iterator it(text.begin(), text.end(), name), end; it != end; ++it) {
    CHECK(seen.insert((*it)[2]).second);
  }
  CHECK(seen.size() == 2 * primitives_of(text).size());
}

TEST_CASE("generator configs are validated") {
  CHECK(GeneratorConfig{}.problems().empty());
  GeneratorConfig config;
  config.storeys = 0;
  config.width_m = std::numeric_limits<double>::quiet_NaN();
  config.depth_m = 1.0;
  config.storey_height_m = 1e9;
  CHECK(config.problems().size() == 4);
  CHECK_THROWS_AS(generate_building(config), stairwell::InputError);
  config = {};
  config.storeys = 51;
  CHECK(config.problems().size() == 1);
  config.storeys = 50;
  CHECK(config.problems().empty());
  CHECK_FALSE(generate_building(config).empty());
}

TEST_CASE("the worlds of the repository are closed, and every part is reachable from every start") {
  const std::filesystem::path folder = std::filesystem::path(STAIRWELL_SOURCE_DIR) / "worlds";
  for (const char* name : {"office_tower", "duplex", "parking_garage", "warehouse", "atrium", "collapsed"}) {
    CAPTURE(name);
    const std::string sdf = text_of(folder / (std::string(name) + ".sdf"));
    const std::vector<Primitive> primitives = primitives_of(sdf);
    REQUIRE(primitives.size() > 20);
    FreeLattice lattice(primitives, kStep_m, kClearance_m);
    const std::vector<Eigen::Vector3d> starts = starts_in(sdf);
    REQUIRE(starts.size() >= 4);
    REQUIRE(lattice.flood(starts.front()));
    CHECK_FALSE(lattice.leaked());
    INFO("missed " << lattice.missed() << " of " << lattice.reached() << ", first "
                   << lattice.first_missed_m().transpose());
    // Pockets between rubble that only a smaller robot could enter do not count as parts.
    CHECK(static_cast<double>(lattice.missed()) <= 0.002 * static_cast<double>(lattice.reached()));
    for (const Eigen::Vector3d& start_m : starts) {
      for (const Primitive& p : primitives) {
        CHECK(p.distance_m(start_m) >= 0.45);
      }
    }
  }
}
