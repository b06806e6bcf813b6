#include "coverage3d/task_board.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <vector>

using namespace stairwell;
using coverage3d::TaskBoard;

namespace {

const Aabb kBox{{-15.0, -10.0, 0.0}, {15.0, 15.0, 3.0}};
constexpr double kSpeed_mps = 2.0;

std::vector<std::size_t> cells_of(const TaskBoard& board, std::size_t uav) {
  std::vector<std::size_t> cells;
  for (std::size_t i = 0; i < board.size(); ++i)
    if (board.open(i) && board.owner(i) == uav) cells.push_back(i);
  return cells;
}

std::vector<std::size_t> parts_of(const TaskBoard& board, std::size_t cell) {
  std::vector<std::size_t> parts;
  for (std::size_t part = 0; part < board.parts(); ++part)
    if (board.cell_of(part) == cell) parts.push_back(part);
  return parts;
}

void close(TaskBoard& board, std::size_t cell) {
  for (const std::size_t part : parts_of(board, cell)) board.close_part(part, 0);
}

Eigen::Vector3d anywhere(Rng& rng, const Aabb& box) {
  Eigen::Vector3d at_m;
  for (int axis = 0; axis < 3; ++axis) at_m[axis] = rng.uniform(box.min_m[axis], box.max_m[axis]);
  return at_m;
}

}  // namespace

TEST_CASE("cells of a task board tile the box, and are few however large it is") {
  const Eigen::Vector3d size_m =
      GENERATE(Eigen::Vector3d(30.0, 25.0, 3.0), Eigen::Vector3d(100.0, 100.0, 30.0), Eigen::Vector3d(0.5, 0.5, 0.5));
  const Aabb box{{-15.0, -10.0, 0.0}, Eigen::Vector3d(-15.0, -10.0, 0.0) + size_m};
  const TaskBoard board(box, kSpeed_mps);
  CHECK(board.size() >= 1);
  CHECK(board.size() <= 64);
  Rng rng = make_rng(1, "board");
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d at_m = anywhere(rng, box);
    const std::size_t part = board.part_at(at_m);
    REQUIRE(part < board.parts());
    const Eigen::Vector3d off_m = (board.part_center_m(part) - at_m).cwiseAbs();
    CHECK((off_m.array() <= 0.5 * board.part_edge_m().array() + 1e-9).all());
    CHECK(board.cell_of(part) == board.cell_at(at_m));
    CHECK(board.cell_at(at_m + Eigen::Vector3d(1e3, -1e3, 1e3)) < board.size());
    CHECK(board.part_at(at_m + Eigen::Vector3d(1e3, -1e3, 1e3)) < board.parts());
  }
}

TEST_CASE("a cell is open while a part of it is, and lies where those are") {
  TaskBoard board(kBox, kSpeed_mps);
  REQUIRE(board.parts() == 4 * board.size());
  const std::size_t cell = board.cell_at({0, 0, 1});
  const std::vector<std::size_t> parts = parts_of(board, cell);
  REQUIRE(parts.size() == 4);
  Rng rng = make_rng(2, "parts");
  std::vector<bool> closed(parts.size(), false);
  for (int i = 0; i < 60; ++i) {
    const auto k = static_cast<std::size_t>(rng.uniform_int(0, 3));
    closed[k] = rng.uniform(0.0, 1.0) < 0.7;
    if (closed[k]) board.close_part(parts[k], 7);
    if (!closed[k]) board.reopen_part(parts[k]);
    Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
    int left = 0;
    for (std::size_t j = 0; j < parts.size(); ++j) {
      CHECK(board.part_open(parts[j]) == !closed[j]);
      CHECK(board.closer(parts[j]) == (closed[j] ? 7 : TaskBoard::kNobody));
      if (closed[j]) continue;
      middle_m += board.part_center_m(parts[j]);
      ++left;
    }
    CHECK(board.open(cell) == (left > 0));
    if (left > 0) CHECK((board.center_m(cell) - middle_m / left).norm() < 1e-9);
  }
  CHECK(board.open(board.cell_at({10, 0, 1})));
}

TEST_CASE("work is shared among those who part, and nothing is dropped") {
  TaskBoard board(kBox, kSpeed_mps);
  REQUIRE(board.size() == 30);
  board.share({{0, {-14, 0, 1}}, {1, {-14, 2, 1}}, {2, {14, 12, 1}}});
  std::size_t all = 0;
  for (std::size_t uav = 0; uav < 3; ++uav) {
    const auto cells = cells_of(board, uav);
    CHECK(cells.size() >= 5);
    all += cells.size();
  }
  CHECK(all == board.size());
  const auto of_others = cells_of(board, 2);
  close(board, cells_of(board, 0).front());
  board.share({{0, {-14, 0, 1}}, {1, {10, 2, 1}}});
  CHECK(cells_of(board, 2) == of_others);
  CHECK(cells_of(board, 0).size() + cells_of(board, 1).size() + of_others.size() == board.size() - 1);
}

TEST_CASE("who has nothing left takes from the one that has most, but not where that one is") {
  TaskBoard board(kBox, kSpeed_mps);
  board.share({{1, {-14, 0, 1}}});
  const TaskBoard::Worker busy{1, {-14, 0, 1}};
  REQUIRE(board.take_over({0, {14, 0, 1}}, {busy}));
  CHECK(cells_of(board, 0).size() > 5);
  CHECK(cells_of(board, 1).size() > 5);
  CHECK(board.owner(board.cell_at(busy.at_m)) == 1);

  SECTION("nothing is taken that would not be done sooner") {
    for (std::size_t i = 0; i < board.size(); ++i)
      if (i != board.cell_at({-9, 0, 1}) && i != board.cell_at(busy.at_m)) close(board, i);
    board.give_up(0);
    board.share({busy});
    CHECK_FALSE(board.take_over({0, {14, 0, 1}}, {busy}));
  }
  SECTION("what nobody answers for is taken as it is") {
    board.give_up(0);
    board.give_up(1);
    REQUIRE(board.take_over({2, {0, 0, 1}}, {{0, {14, 0, 1}}}));
    CHECK(cells_of(board, 2).size() == board.size());
    CHECK(cells_of(board, TaskBoard::kNobody).empty());
    CHECK(cells_of(board, 1).empty());
  }
  SECTION("where another is going to be stays its own") {
    for (std::size_t i = 0; i < board.size(); ++i)
      if (i != board.cell_at(busy.at_m)) close(board, i);
    board.give_up(0);
    board.share({busy});
    CHECK_FALSE(board.take_over({0, busy.at_m}, {busy}));
    CHECK(board.take_over({0, busy.at_m}, {{1, {14, 0, 1}}}));
  }
  SECTION("who has little is left alone") {
    for (const std::size_t cell : cells_of(board, 0))
      if (cell != cells_of(board, 0).front() && cell != cells_of(board, 0).back()) close(board, cell);
    const auto little = cells_of(board, 0);
    REQUIRE(board.take_over({2, board.center_m(little.front())}, {{0, {14, 10, 1}}, busy}));
    CHECK(cells_of(board, 0) == little);
  }
  SECTION("a finished board has nothing to take") {
    for (std::size_t i = 0; i < board.size(); ++i) close(board, i);
    CHECK_FALSE(board.take_over({0, {14, 0, 1}}, {busy}));
  }
}

TEST_CASE("a part is near a claim while somebody claims an open part there") {
  TaskBoard board(kBox, kSpeed_mps);
  const auto claims_of = [&board](std::size_t part) {
    std::vector<bool> parts(board.parts(), false);
    parts[part] = true;
    return parts;
  };
  const std::size_t here = board.part_at({0, 0, 1});
  const std::size_t beside = board.part_at({2.5, 0, 1});
  const std::size_t far = board.part_at({14, 14, 1});
  CHECK_FALSE(board.claimed_near(here, 100.0));
  board.claim(0, claims_of(here));
  CHECK(board.claimed_near(here, 0.0));
  CHECK(board.claimed_near(beside, 3.0));
  CHECK_FALSE(board.claimed_near(far, 3.0));
  board.close_part(here, 1);
  CHECK_FALSE(board.claimed_near(here, 100.0));
  board.reopen_part(here);
  board.claim(1, claims_of(far));
  board.claim(0, claims_of(beside));  // and no longer what it claimed before
  CHECK_FALSE(board.claimed_near(here, 0.0));
  CHECK(board.claimed_near(far, 0.0));
  board.give_up(1);
  CHECK_FALSE(board.claimed_near(far, 3.0));
  CHECK(board.claimed_near(beside, 0.0));
}

TEST_CASE("a task board is saved and read back") {
  TaskBoard board(kBox, kSpeed_mps);
  board.share({{0, {-14, 0, 1}}, {1, {-14, 2, 1}}});
  board.close_part(3, 1);
  board.give_up(1);
  std::vector<bool> claims(board.parts(), false);
  claims[5] = true;
  board.claim(2, claims);
  TaskBoard copy(kBox, kSpeed_mps);
  copy.from_json(board.to_json());
  for (std::size_t i = 0; i < board.size(); ++i) {
    CHECK(copy.open(i) == board.open(i));
    CHECK(copy.owner(i) == board.owner(i));
    CHECK(copy.center_m(i) == board.center_m(i));
  }
  for (std::size_t part = 0; part < board.parts(); ++part) {
    CHECK(copy.closer(part) == board.closer(part));
    CHECK(copy.claimed_near(part, 0.0) == (part == 5));
  }
  TaskBoard other(Aabb{{0.0, 0.0, 0.0}, {5.0, 5.0, 3.0}}, kSpeed_mps);
  CHECK_THROWS_AS(other.from_json(board.to_json()), InputError);
}
