#include "coverage3d/frontier_patches.hpp"
#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <vector>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;

using Key = std::tuple<int, int, int>;

std::set<Key> voxels_of(const BlockBits& bits, const VoxelIndex& block = {}) {
  std::set<Key> found;
  for_each_voxel(bits, [&](const VoxelIndex& v) {
    found.insert({8 * block.x + v.x, 8 * block.y + v.y, 8 * block.z + v.z});
  });
  return found;
}

bool touch(const Key& a, const Key& b) {
  return std::abs(std::get<0>(a) - std::get<0>(b)) <= 1 && std::abs(std::get<1>(a) - std::get<1>(b)) <= 1 &&
         std::abs(std::get<2>(a) - std::get<2>(b)) <= 1;
}

bool touch(const std::set<Key>& a, const std::set<Key>& b) {
  return std::any_of(a.begin(), a.end(), [&](const Key& one) {
    return std::any_of(b.begin(), b.end(), [&](const Key& other) { return touch(one, other); });
  });
}

/// Parts that connect over faces, edges and corners, found voxel by voxel.
std::set<std::set<Key>> flooded(std::set<Key> left) {
  std::set<std::set<Key>> parts;
  while (!left.empty()) {
    std::vector<Key> open{*left.begin()};
    left.erase(left.begin());
    for (std::size_t i = 0; i < open.size(); ++i) {
      for (auto v = left.begin(); v != left.end();) {
        if (touch(open[i], *v)) {
          open.push_back(*v);
          v = left.erase(v);
        } else {
          ++v;
        }
      }
    }
    parts.emplace(open.begin(), open.end());
  }
  return parts;
}

BlockBits random_bits(Rng& rng, double density) {
  BlockBits bits{};
  for (std::uint64_t& word : bits)
    for (int i = 0; i < 64; ++i) word |= std::uint64_t{rng.uniform() < density} << i;
  return bits;
}

}  // namespace

TEST_CASE("parts of a block are those that a flood fill finds") {
  Rng rng = make_rng(3, "frontier parts");
  for (int round = 0; round < 300; ++round) {
    const BlockBits bits = random_bits(rng, rng.uniform(0.0, 0.2));
    std::set<std::set<Key>> found;
    for (const BlockBits& part : connected_parts(bits, 8)) found.insert(voxels_of(part));
    REQUIRE(found == flooded(voxels_of(bits)));
    REQUIRE(count(bits) == static_cast<int>(voxels_of(bits).size()));
  }
}

TEST_CASE("long parts are cut, and nothing is lost") {
  Rng rng = make_rng(4, "frontier cuts");
  for (int longest = 1; longest <= 8; ++longest) {
    for (int round = 0; round < 30; ++round) {
      const BlockBits bits = random_bits(rng, rng.uniform(0.05, 0.9));
      std::set<Key> together;
      std::size_t voxels = 0;
      for (const BlockBits& part : connected_parts(bits, longest)) {
        const std::set<Key> mine = voxels_of(part);
        VoxelIndex lo{8, 8, 8};
        VoxelIndex hi{0, 0, 0};
        for (const auto& [x, y, z] : mine) {
          lo = {std::min(lo.x, x), std::min(lo.y, y), std::min(lo.z, z)};
          hi = {std::max(hi.x, x), std::max(hi.y, y), std::max(hi.z, z)};
        }
        REQUIRE(std::max({hi.x - lo.x, hi.y - lo.y, hi.z - lo.z}) < longest);
        voxels += mine.size();
        together.insert(mine.begin(), mine.end());
      }
      REQUIRE(together == voxels_of(bits));
      REQUIRE(voxels == together.size());
    }
  }
}

TEST_CASE("neighbours are the patches that touch, in all blocks, whatever was replaced before") {
  Rng rng = make_rng(5, "frontier neighbours");
  FrontierPatches patches({30, 22, 17}, 8);  // 4 x 3 x 3 blocks
  std::map<Key, BlockBits> now;
  for (int round = 0; round < 120; ++round) {
    const VoxelIndex block{rng.uniform_int(0, 3), rng.uniform_int(0, 2), rng.uniform_int(0, 2)};
    const BlockBits bits = rng.uniform() < 0.2 ? BlockBits{} : random_bits(rng, rng.uniform(0.0, 0.08));
    FrontierPatches::Replaced replaced;
    patches.replace(block, bits, replaced);
    now[{block.x, block.y, block.z}] = bits;
    std::set<Key> all;
    for (const auto& [at, there] : now) {
      const auto [x, y, z] = at;
      all.merge(voxels_of(there, {x, y, z}));
    }
    REQUIRE(patches.voxel_count() == all.size());
    for (const auto& [x, y, z] : all) REQUIRE(patches.contains({x, y, z}));
    for (const std::uint32_t id : replaced.added) {
      const std::set<Key> mine = voxels_of(patches[id].bits, patches[id].block);
      std::vector<std::uint32_t> beside;
      patches.neighbours(id, beside);
      std::set<Key> touching;
      for (const std::uint32_t other : beside) touching.merge(voxels_of(patches[other].bits, patches[other].block));
      std::set<Key> rest;
      std::set_difference(all.begin(), all.end(), mine.begin(), mine.end(), std::inserter(rest, rest.end()));
      for (const Key& v : rest)
        if (touch(mine, {v})) REQUIRE(touching.contains(v));
      for (const std::uint32_t other : beside) {
        REQUIRE(other != id);
        REQUIRE(touch(mine, voxels_of(patches[other].bits, patches[other].block)));
      }
    }
  }
}

TEST_CASE("a block that stays as it is keeps its patches, and a cluster hears of those that go") {
  FrontierPatches patches({16, 16, 16}, 8);
  BlockBits two{};
  two[0] = 1U | 1U << 5;  // two voxels far apart
  FrontierPatches::Replaced first;
  patches.replace({1, 0, 1}, two, first);
  REQUIRE(first.added.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) patches[first.added[i]].cluster = static_cast<std::uint32_t>(7 + i);
  FrontierPatches::Replaced same;
  patches.replace({1, 0, 1}, two, same);
  CHECK(same.added.empty());
  CHECK(same.bereaved.empty());
  BlockBits one = two;
  one[0] = 1U << 5;
  FrontierPatches::Replaced second;
  patches.replace({1, 0, 1}, one, second);
  CHECK(second.added.empty());
  CHECK(second.bereaved == std::vector<std::uint32_t>{7});
  CHECK(patches.contains({13, 0, 8}));
  CHECK(!patches.contains({8, 0, 8}));
}
