#include "learning/rl/noise.hpp"

#include "core/units.hpp"
#include "learning/rl/actor_critic.hpp"

#include <Eigen/Core>

#include <catch2/catch.hpp>

#include <array>
#include <cmath>

using namespace stairwell;
using namespace stairwell::rl;

namespace {

struct Statistics {
  double mean = 0.0, variance = 0.0, neighbours = 0.0;  ///< correlation of one number with the next
};

Statistics statistics_of(const NoiseConfig& config, int count) {
  Rng rng = make_rng(1, "noise");
  Noise noise(config, 2);
  std::vector<double> values;
  for (int i = 0; i < 200; ++i) noise.next(rng);  // until it has forgotten that it began at 0
  for (int i = 0; i < count; ++i) values.push_back(noise.next(rng)[1]);
  Statistics s;
  for (const double v : values) s.mean += v / count;
  for (const double v : values) s.variance += (v - s.mean) * (v - s.mean) / count;
  for (std::size_t i = 1; i < values.size(); ++i) {
    s.neighbours += (values[i] - s.mean) * (values[i - 1] - s.mean) / s.variance / count;
  }
  return s;
}

}  // namespace

TEST_CASE("noise has the variance and the memory that it should have", "[rl]") {
  const Statistics plain = statistics_of({NoiseConfig::Kind::kGaussian, 0.3, 0.15}, 40'000);
  CHECK(std::abs(plain.mean) < 0.01);
  CHECK(plain.variance == Approx(0.09).epsilon(0.05));
  CHECK(std::abs(plain.neighbours) < 0.02);
  const Statistics drifting = statistics_of({NoiseConfig::Kind::kOrnsteinUhlenbeck, 0.3, 0.15}, 200'000);
  CHECK(std::abs(drifting.mean) < 0.03);
  CHECK(drifting.variance == Approx(0.09 / (1.0 - 0.85 * 0.85)).epsilon(0.05));
  CHECK(drifting.neighbours == Approx(0.85).margin(0.01));
}

TEST_CASE("a disturbed direction is a direction, whichever way it points", "[rl]") {
  Rng rng = make_rng(2, "noise");
  Noise noise({NoiseConfig::Kind::kGaussian, 0.2, 0.0}, 3);
  // At the seam of azimuth, at the poles and between, noise turns as far.
  std::array<double, 4> turned_rad{};
  const std::array<Eigen::Vector3f, 4> directions{Eigen::Vector3f(-1, 0, 0), Eigen::Vector3f(0, 0, 1),
                                                  Eigen::Vector3f(0, 0, -1), Eigen::Vector3f(0.6F, 0.0F, 0.8F)};
  constexpr int kCount = 20'000;
  for (std::size_t d = 0; d < directions.size(); ++d) {
    for (int i = 0; i < kCount; ++i) {
      Eigen::Vector3f action = directions[d];
      perturb(nn::Head::kUnitVector, noise.next(rng), std::span(action.data(), 3));
      REQUIRE(action.norm() == Approx(1.0).margin(1e-5));
      turned_rad[d] += std::acos(std::clamp(static_cast<double>(action.dot(directions[d])), -1.0, 1.0)) / kCount;
    }
    CHECK(turned_rad[d] == Approx(turned_rad[0]).epsilon(0.03));
  }
  std::array<float, 2> numbers{0.95F, -0.95F};
  perturb(nn::Head::kValues, std::array<double, 2>{0.2, -0.2}, numbers);
  CHECK(numbers == std::array<float, 2>{1.0F, -1.0F});
}

TEST_CASE("any action: all directions are as likely", "[rl]") {
  Rng rng = make_rng(3, "noise");
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), square = Eigen::Vector3d::Zero();
  constexpr int kCount = 30'000;
  for (int i = 0; i < kCount; ++i) {
    Eigen::Vector3f action;
    random_action(nn::Head::kUnitVector, rng, std::span(action.data(), 3));
    REQUIRE(action.norm() == Approx(1.0).margin(1e-5));
    mean += action.cast<double>() / kCount;
    square += action.cast<double>().cwiseAbs2() / kCount;
  }
  CHECK(mean.norm() < 0.02);
  for (Eigen::Index a = 0; a < 3; ++a) CHECK(square[a] == Approx(1.0 / 3.0).margin(0.01));
}

TEST_CASE("the density of disturbed directions is one, and theirs", "[rl]") {
  for (const double sigma : {0.1, 0.3, 1.0, 1.8}) {
    double circle = 0.0, sphere = 0.0;
    constexpr int kParts = 1000;
    for (int i = 0; i < kParts; ++i) {
      const double angle = (i + 0.5) * kPi / kParts, wide = kPi / kParts;
      circle += 2.0 * wide * std::exp(log_projected_normal(2, std::cos(angle), sigma));
      sphere += 2.0 * kPi * std::sin(angle) * wide * std::exp(log_projected_normal(3, std::cos(angle), sigma));
    }
    CHECK(circle == Approx(1.0).margin(1e-4));
    CHECK(sphere == Approx(1.0).margin(1e-4));
  }
  Rng rng = make_rng(4, "noise");
  Noise noise({NoiseConfig::Kind::kGaussian, 0.7, 0.0}, 3);
  constexpr int kCount = 40'000;
  int near = 0;
  for (int i = 0; i < kCount; ++i) {
    Eigen::Vector3f action(0, 0, 1);
    perturb(nn::Head::kUnitVector, noise.next(rng), std::span(action.data(), 3));
    near += action.z() > 0.5F ? 1 : 0;
  }
  double expected = 0.0;
  for (int i = 0; i < 500; ++i) {
    const double angle = (i + 0.5) * kPi / 3.0 / 500;
    expected += 2.0 * kPi * std::sin(angle) * kPi / 3.0 / 500 * std::exp(log_projected_normal(3, std::cos(angle), 0.7));
  }
  CHECK(static_cast<double>(near) / kCount == Approx(expected).margin(0.01));
}
