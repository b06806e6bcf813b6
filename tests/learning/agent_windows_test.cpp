/// The agents' windows and the field of arrival beside slow references.
#include "core/rng.hpp"
#include "learning/train/training_world.hpp"
#include "planning3d/agent_view.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace stairwell;
using namespace stairwell::planning3d;

namespace {

using Cell = std::array<int, 3>;

const Eigen::Vector3d kEverywhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

/// A storey of which a few looks have shown a part; its box does not end with a cell of the field.
struct PartlyKnown {
  Rng rng;
  train::VoxelScene scene;
  train::TrainingWorld world;

  explicit PartlyKnown(const std::string& stream)
      : rng(make_rng(3, stream)), scene(make_scene(rng)), world(partly_known(scene, rng)) {}

  static train::VoxelScene make_scene(Rng& rng) {
    train::StoreyWorldConfig config;
    config.least_storeys = config.most_storeys = 2;
    config.least_size_m = config.most_size_m = 6.1;
    return make_storey_scene(config, rng);
  }
  static train::TrainingWorld partly_known(const train::VoxelScene& scene, Rng& rng) {
    const Robot robot{0.2, 0.0};
    const train::TrainingWorld known(scene, robot);
    std::vector<Eigen::Vector3d> places;
    while (places.size() < 4) {
      if (const auto place = train::random_place(known.space(), std::nullopt, rng)) places.push_back(*place);
    }
    const auto seen = seen_from(scene, places, 3.5);
    return {scene, robot, &seen};
  }
};

bool inside(const ArrivalField& field, const Cell& c) {
  return c[0] >= 0 && c[1] >= 0 && c[2] >= 0 && c[0] < field.size()[0] && c[1] < field.size()[1] &&
         c[2] < field.size()[2];
}

float arrival(const ArrivalField& field, const Cell& c) {
  return inside(field, c) ? field.cells()[field.linear(c[0], c[1], c[2])] : ArrivalField::kFar;
}

/// What a sample shows, asked for by its place alone.
std::uint8_t shown(const FreeSpace& space, const ArrivalField& field, const Eigen::Vector3d& place_m, double span_m,
                   double way_left_m, bool plane, AgentInput::Channel channel) {
  const VoxelIndex v = space.grid().index_of(place_m);
  if (channel == AgentInput::Channel::kUnknown) return space.map().at(v) == Occupancy::kUnknown ? 255 : 128;
  if (channel == AgentInput::Channel::kClearance) {
    const double clear_m = space.blocked_distance().distance_m(v) - space.robot().clearance_m();
    return static_cast<std::uint8_t>(128 + std::lround(127.0 * std::clamp(clear_m / 0.8, -1.0, 1.0)));
  }
  Cell c;
  for (int a = 0; a < 3; ++a) {
    c[static_cast<std::size_t>(a)] = static_cast<int>(std::floor((place_m - field.origin_m())[a] / field.cell_m()));
  }
  if (plane) c[2] = 0;
  const double t = space.grid().contains(v) ? static_cast<double>(arrival(field, c)) * field.cell_m() - way_left_m
                                            : std::numeric_limits<double>::infinity();
  return static_cast<std::uint8_t>(128 + std::trunc(127.0 * std::clamp(t / span_m, -1.0, 1.0)));
}

/// The upwind equation solved for one cell of slowness 1, by bisection of sum (T - lower)+^2 = 1.
double solved(const ArrivalField& field, const std::vector<double>& t, const Cell& c) {
  std::array<double, 3> lower{};
  for (std::size_t a = 0; a < 3; ++a) {
    lower[a] = std::numeric_limits<double>::infinity();
    for (const int side : {-1, 1}) {
      Cell n = c;
      n[a] += side;
      if (inside(field, n)) lower[a] = std::min(lower[a], t[field.linear(n[0], n[1], n[2])]);
    }
  }
  double below = *std::ranges::min_element(lower), above = below + 1.0;
  if (!std::isfinite(below)) return below;
  while (above - below > 1e-9) {
    const double middle = 0.5 * (below + above);
    double sum = 0.0;
    for (const double l : lower) sum += std::pow(std::max(0.0, middle - l), 2);
    (sum < 1.0 ? below : above) = middle;
  }
  return above;
}

}  // namespace

TEST_CASE("windows show what their places hold", "[agent]") {
  const PartlyKnown known("windows");
  const FreeSpace space = known.world.space();
  Rng rng = make_rng(4, "windows");
  for (const bool plane : {true, false}) {
    const AgentInput input = plane ? AgentInput::slice() : AgentInput::volume();
    const auto goal = train::random_place(space, std::nullopt, rng);
    REQUIRE(goal);
    ArrivalField field({.plane = plane});
    field.compute(space, SegmentCheck(space, {}, *goal), *goal, kEverywhere);
    AgentView view(input);
    view.begin(space, {}, field);
    std::size_t different = 0, samples = 0;
    for (int look = 0; look < 8; ++look) {
      const auto place = train::random_place(space, plane ? std::optional(goal->z()) : std::nullopt, rng);
      if (!place || field.value_m(*place) == ArrivalField::kFar) continue;
      const Eigen::Vector3d at_m(place->x() + 0.013, place->y() - 0.021, place->z() + (plane ? 0.0 : 0.017));
      Observation seen;
      view.look(at_m, seen);
      const std::uint8_t* byte = seen.windows.data();
      const auto [nz, ny, nx] = input.samples;
      for (const double spacing_m : input.spacings_m) {
        for (const AgentInput::Channel channel : input.channels) {
          for (int i = 0; i < nz * ny * nx; ++i, ++byte, ++samples) {
            const Eigen::Vector3d off(i % nx - 0.5 * (nx - 1), i / nx % ny - 0.5 * (ny - 1),
                                      i / (nx * ny) - 0.5 * (nz - 1));
            const Eigen::Vector3d place_m = at_m + spacing_m * turned(off, seen.yaw_rad);
            const int expected = shown(space, field, place_m, 0.5 * spacing_m * nx, view.way_left_m(), plane, channel);
            if (std::abs(expected - *byte) > 1) ++different;
          }
        }
      }
    }
    CHECK(samples > 10'000);
    CHECK(different < samples / 10'000);  // on the face between two voxels
  }
}

TEST_CASE("the field of arrival solves the upwind equation everywhere", "[agent]") {
  const PartlyKnown known("field");
  const FreeSpace space = known.world.space();
  Rng rng = make_rng(5, "field");
  const auto goal = train::random_place(space, std::nullopt, rng);
  REQUIRE(goal);
  ArrivalField field(ArrivalField::Config{});
  field.compute(space, SegmentCheck(space, {}, *goal), *goal, kEverywhere);
  const std::vector<double> t(field.cells().begin(), field.cells().end());
  int reached = 0, impassable = 0;
  for (int z = 0; z < field.size()[2]; ++z) {
    for (int y = 0; y < field.size()[1]; ++y) {
      for (int x = 0; x < field.size()[0]; ++x) {
        const Cell c{x, y, z};
        const Eigen::Vector3d middle_m = field.origin_m() + field.cell_m() * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        int fits = 0;
        for (int corner = 0; corner < 8; ++corner) {
          const VoxelIndex v{2 * x + (corner & 1), 2 * y + (corner >> 1 & 1), 2 * z + (corner >> 2)};
          fits += space.traversable(v) ? 1 : 0;
        }
        const double here = static_cast<double>(arrival(field, c));
        if (fits < 4) {
          ++impassable;
          CHECK(here == static_cast<double>(ArrivalField::kFar));
        } else if ((middle_m - *goal).norm() > 2.5 * field.cell_m()) {
          const double expected = solved(field, t, c);
          if (std::isfinite(expected)) ++reached;
          CHECK(((here == expected) || std::abs(here - expected) < 1e-3));
        }
      }
    }
  }
  CHECK(reached > 300);
  CHECK(impassable > 500);
}
