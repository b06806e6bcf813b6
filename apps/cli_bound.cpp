#include "apps/bound.hpp"
#include "apps/commands.hpp"
#include "apps/explore_options.hpp"
#include "apps/progress.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>
#include <ostream>

namespace stairwell::apps {

namespace {

constexpr const char* kFooter =
    "Takes the options of explore; those that do not change the task (planner, coverage, ..) change nothing.\n"
    "Examples:\n"
    "  stairwell bound worlds/duplex.sdf --uavs 2\n"
    "  stairwell bound worlds/office_tower.sdf --uavs 4 --target-coverage 0.95 --json\n"
    "  stairwell bound building.sdf --start -9,0,0 --rounds 12";

struct BoundWords {
  std::string world;
  ExploreOptions options;
  int rounds = BoundRequest{}.rounds;
  bool json = false, quiet = false;
};

void print_bound(const BoundWords& words, CommandContext& context) {
  Settings settings = words.options.settings();
  if (!words.world.empty()) settings["world"] = {words.world, "WORLD"};
  Progress progress(Progress::style_for(words.quiet));
  BoundRequest request;
  request.settings = std::move(settings);
  request.rounds = words.rounds;
  request.report = [&progress](const std::string& line) { progress.note(line); };
  const Bound bound = find_bound(request, context.interrupted);
  if (words.json) {
    context.out << bound_json(bound);
    return;
  }
  char text[256];
  std::snprintf(text, sizeof text,
                "coverage      %.2f %%\nfinished at   %.1f s\npath          %.1f m, %zu UAVs\nviewpoints    %zu\n",
                100.0 * bound.coverage, bound.finish_s, bound.path_length_m, bound.uavs, bound.viewpoints);
  context.out << text;
}

}  // namespace

void add_bound_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("bound", "How fast a fleet would be that knows the world: a reference");
  auto words = std::make_shared<BoundWords>();
  command->add_option("WORLD", words->world, "World file, as of explore");
  words->options.add_to(*command);
  command->add_flag("--json", words->json, "Print one JSON object on standard output and nothing else");
  command->add_flag("--quiet", words->quiet, "No progress on standard error");
  command->add_option("--rounds", words->rounds, "Rounds of searching and flying (default: 6); more are never worse")
      ->check(CLI::Range(1, 1000));
  command->footer(kFooter);
  command->callback([words, &context] { print_bound(*words, context); });
}

}  // namespace stairwell::apps
