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
    const std::size_t cell = board.cell_at(at_m);
    REQUIRE(cell < board.size());
    const Eigen::Vector3d off_m = (board.center_m(cell) - at_m).cwiseAbs();
    CHECK((off_m.array() <= 0.5 * board.edge_m().array() + 1e-9).all());
    CHECK(board.cell_at(at_m + Eigen::Vector3d(1e3, -1e3, 1e3)) < board.size());
  }
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
  board.close(cells_of(board, 0).front());
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
      if (i != board.cell_at({-9, 0, 1}) && i != board.cell_at(busy.at_m)) board.close(i);
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
      if (i != board.cell_at(busy.at_m)) board.close(i);
    board.give_up(0);
    board.share({busy});
    CHECK_FALSE(board.take_over({0, busy.at_m}, {busy}));
    CHECK(board.take_over({0, busy.at_m}, {{1, {14, 0, 1}}}));
  }
  SECTION("who has little is left alone") {
    for (const std::size_t cell : cells_of(board, 0))
      if (cell != cells_of(board, 0).front() && cell != cells_of(board, 0).back()) board.close(cell);
    const auto little = cells_of(board, 0);
    REQUIRE(board.take_over({2, board.center_m(little.front())}, {{0, {14, 10, 1}}, busy}));
    CHECK(cells_of(board, 0) == little);
  }
  SECTION("a finished board has nothing to take") {
    for (std::size_t i = 0; i < board.size(); ++i) board.close(i);
    CHECK_FALSE(board.take_over({0, {14, 0, 1}}, {busy}));
  }
}

TEST_CASE("a task board is saved and read back") {
  TaskBoard board(kBox, kSpeed_mps);
  board.share({{0, {-14, 0, 1}}, {1, {-14, 2, 1}}});
  board.close(3);
  board.give_up(1);
  TaskBoard copy(kBox, kSpeed_mps);
  copy.from_json(board.to_json());
  for (std::size_t i = 0; i < board.size(); ++i) {
    CHECK(copy.open(i) == board.open(i));
    CHECK(copy.owner(i) == board.owner(i));
  }
  TaskBoard other(Aabb{{0.0, 0.0, 0.0}, {5.0, 5.0, 3.0}}, kSpeed_mps);
  CHECK_THROWS_AS(other.from_json(board.to_json()), InputError);
}
