/// flown_worlds [WORLDS] [FIRST_SEED]: SPEC A18's property, by default in 10 000 random worlds: no flown state in
/// collision, none in unknown space (tests/planning3d/flown_worlds.hpp; the tests fly the first thousand). Names every
/// world in which something went wrong; the exit status is 1 then.
#include "tests/planning3d/flown_worlds.hpp"

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  const int worlds = argc > 1 ? std::atoi(argv[1]) : 10'000;
  const auto first = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 0);
  stairwell::test::FlownTally sum;
  for (int i = 0; i < worlds; ++i) {
    stairwell::test::FlownTally tally;
    stairwell::test::FlownWorld(first + static_cast<std::uint64_t>(i), tally).fly();
    if (!tally.first_problem.empty()) std::printf("%s\n", tally.first_problem.c_str());
    sum.add(tally);
  }
  std::printf("%s\n", sum.text().c_str());
  return sum.clean() ? 0 : 1;
}
