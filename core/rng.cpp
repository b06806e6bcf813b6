#include "core/rng.hpp"

#include "core/units.hpp"

#include <bit>
#include <cmath>

namespace stairwell {

namespace {

std::uint64_t splitmix64(std::uint64_t& state) {  // Steele, Lea & Flood 2014
  state += 0x9E3779B97F4A7C15ULL;
  std::uint64_t z = state;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

}  // namespace

Rng::Rng(std::uint64_t seed) {
  for (auto& word : state_) word = splitmix64(seed);
}

Rng::result_type Rng::operator()() {
  const std::uint64_t result = std::rotl(state_[1] * 5, 7) * 9;
  const std::uint64_t shifted = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= shifted;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double Rng::uniform() { return static_cast<double>((*this)() >> 11) * 0x1.0p-53; }

int Rng::uniform_int(int lo, int hi) {
  const double span = static_cast<double>(hi) - static_cast<double>(lo) + 1.0;
  return lo + static_cast<int>(uniform() * span);
}

double Rng::normal(double mean, double sigma) {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return mean + sigma * radius * std::cos(2.0 * kPi * uniform());
}

Rng make_rng(std::uint64_t seed, std::string_view stream) {
  std::uint64_t hash = 0xCBF29CE484222325ULL;  // FNV-1a
  for (const char c : stream) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001B3ULL;
  }
  return Rng(seed ^ std::rotl(hash, 32));
}

}  // namespace stairwell
