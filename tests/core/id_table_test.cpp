#include "core/id_table.hpp"
#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <map>
#include <utility>

namespace stairwell {
namespace {

void check_same(const IdTable<int>& table, const std::map<std::uint32_t, int>& expected) {
  REQUIRE(table.size() == expected.size());
  REQUIRE(table.empty() == expected.empty());
  auto next = expected.begin();
  for (const auto& [id, value] : table) {
    REQUIRE(id == next->first);
    REQUIRE(value == next->second);
    ++next;
  }
  REQUIRE(next == expected.end());
}

/// Mostly larger than all before.
std::uint32_t some_id(Rng& rng, std::uint32_t& next) {
  if (rng.uniform() < 0.7) return ++next;
  return static_cast<std::uint32_t>(rng.uniform() * (next + 3));
}

TEST_CASE("a table by id holds what a map would") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Rng rng(seed);
    IdTable<int> table;
    std::map<std::uint32_t, int> expected;
    std::uint32_t next = 0;
    for (int step = 0; step < 400; ++step) {
      const std::uint32_t id = some_id(rng, next);
      const double what = rng.uniform();
      if (what < 0.5) {
        table[id] = step;
        expected[id] = step;
      } else if (what < 0.97) {
        table.erase(id / 2);
        expected.erase(id / 2);
      } else {
        const auto goes = [](std::uint32_t some, int value) {
          return (some + static_cast<std::uint32_t>(value)) % 3 == 0;
        };
        table.erase_if(goes);
        std::erase_if(expected, [&](const auto& entry) { return goes(entry.first, entry.second); });
      }
      check_same(table, expected);
      const std::uint32_t asked = some_id(rng, next);
      const int* const found = std::as_const(table).find(asked);
      REQUIRE((found != nullptr) == expected.contains(asked));
      if (found != nullptr) REQUIRE(*found == expected.at(asked));
    }
    CHECK(!expected.empty());
    table.clear();
    check_same(table, {});
  }
}

TEST_CASE("values of a table by id stay where they are") {
  IdTable<int> table;
  const int* const first = &(table[5] = 50);
  for (std::uint32_t id = 0; id < 1000; ++id) table[id] = static_cast<int>(id);
  for (std::uint32_t id = 6; id < 1000; ++id) table.erase(id);
  CHECK(table.find(5) == first);
  CHECK(table.size() == 6);
}

TEST_CASE("copies of a table by id stand for themselves, what was moved from is empty") {
  IdTable<int> table;
  for (std::uint32_t id = 1; id <= 9; ++id) table[id] = static_cast<int>(10 * id);
  table.erase(4);
  IdTable<int> copy = table;
  copy[2] = 7;
  copy.erase(9);
  check_same(table, {{1, 10}, {2, 20}, {3, 30}, {5, 50}, {6, 60}, {7, 70}, {8, 80}, {9, 90}});
  check_same(copy, {{1, 10}, {2, 7}, {3, 30}, {5, 50}, {6, 60}, {7, 70}, {8, 80}});
  const IdTable<int> moved = std::move(table);
  CHECK(moved.size() == 8);
  check_same(table, {});  // NOLINT(bugprone-use-after-move)
  table = copy;
  check_same(table, {{1, 10}, {2, 7}, {3, 30}, {5, 50}, {6, 60}, {7, 70}, {8, 80}});
}

}  // namespace
}  // namespace stairwell
