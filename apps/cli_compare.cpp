#include "apps/commands.hpp"
#include "apps/comparison.hpp"
#include "apps/explore_options.hpp"
#include "apps/option_values.hpp"
#include "apps/sweep.hpp"
#include "core/errors.hpp"

#include <CLI/CLI.hpp>

#include <memory>
#include <ostream>

namespace stairwell::apps {

namespace {

constexpr const char* kFooter =
    "Every run is a process of its own with a run folder in DIR/runs. A sweep that was cut short goes on when the "
    "same\n"
    "command is given again; more seeds, worlds or strategies may be added. Other options are those of explore.\n"
    "Examples:\n"
    "  stairwell compare worlds/duplex.sdf --coverage frontiers,nearest --seeds 1..10 --out sweeps/nearest\n"
    "  stairwell compare worlds/*.sdf --modes slice,volume --uavs 4 --seeds 1..3 --jobs 2 --out sweeps/modes\n"
    "  stairwell compare worlds/office_tower.sdf --uavs 1,2,4,8 --seeds 1,2 --charge-planning off --out sweeps/fleet\n"
    "  stairwell compare worlds/duplex.sdf --vary gain=volume,entropy --uavs 2 --out sweeps/gain\n"
    "Exit code 1: some runs failed (they are named; the others are compared), or the sweep was interrupted.";

struct CompareWords {
  std::vector<std::string> worlds;
  std::vector<std::string> varied;
  std::string modes, planners, coverages, uavs = "1", seeds = "1..10", jobs = "1", out, bound = "on";
  ExploreOptions options;
  bool json = false, quiet = false;
};

/// What an option's text means; complaints name the option.
template <typename Parse>
auto parsed(const char* option, const std::string& text, const Parse& parse) {
  try {
    return parse(text);
  } catch (const InputError& error) {
    throw InputError(std::string(option) + ": " + error.what());
  }
}

SweepConfig config_of(const CompareWords& words) {
  const auto list = [](const char* option, const std::string& text) {
    return text.empty() ? std::vector<std::string>{} : parsed(option, text, parse_words);
  };
  SweepConfig config;
  config.worlds = words.worlds;
  config.modes = list("--modes", words.modes);
  config.planners = list("--planners", words.planners);
  config.coverages = list("--coverage", words.coverages);
  config.uavs = parsed("--uavs", words.uavs, parse_counts);
  config.seeds = parsed("--seeds", words.seeds, parse_counts);
  config.jobs = parsed("--jobs", words.jobs, parse_count);
  config.bound = parsed("--bound", words.bound, parse_switch);
  for (const std::string& one : words.varied) config.varied.push_back(parsed("--vary", one, parse_varied));
  config.base = words.options.settings();
  config.out = words.out;
  config.program = "/proc/self/exe";
  return config;
}

void compare(const CompareWords& words, CommandContext& context) {
  const SweepConfig config = config_of(words);
  const std::vector<SweepRun> runs = plan_sweep(config);
  const Progress::Style style = Progress::style_for(words.quiet);
  const SweepResult result = run_sweep(config, runs, style, context.interrupted);
  const Comparison comparison = read_comparison(runs);
  write_comparison(comparison, config.out);
  context.out << (words.json ? comparison_json(comparison) : comparison_markdown(comparison));
  if (result.interrupted) {
    context.exit_code = 1;
    Progress(style).note("interrupted: give the same command again to go on");
  }
  if (result.failed.empty()) return;
  std::string all = std::to_string(result.failed.size()) + " failed:";
  for (const std::string& one : result.failed) all += " " + one + ";";
  all.pop_back();
  throw RunError(all);
}

}  // namespace

void add_compare_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("compare", "Explore many times and say which way is better");
  auto words = std::make_shared<CompareWords>();
  command->add_option("WORLD", words->worlds, "World files, as of explore")->required();
  command->add_option("--modes", words->modes, "slice,volume (default: volume)");
  command->add_option("--planners", words->planners, "Planners, with commas between");
  command->add_option("--coverage", words->coverages, "Coverage strategies, with commas between (default: by mode)");
  command->add_option("--vary", words->varied, "Any key of config.yaml and its values; repeat for more keys")
      ->type_name("KEY=A,B..")
      ->allow_extra_args(false);
  command->add_option("--uavs", words->uavs, "Numbers of UAVs, as 1,2,4 (default: 1)");
  command->add_option("--seeds", words->seeds, "Seeds, as 1..10 or 1,5,7 (default: 1..10)");
  command->add_option("--jobs", words->jobs, "Runs side by side (default: 1; more disturb planning times)");
  command->add_option("--bound", words->bound, "on|off: compare with `stairwell bound` (default: on)");
  words->options.add_to(*command, {"--mode", "--planner", "--coverage", "--uavs", "--seed"});
  command->add_option("--out", words->out, "Folder of the sweep")->type_name("DIR")->required();
  command->add_flag("--json", words->json, "Print comparison.json on standard output and nothing else");
  command->add_flag("--quiet", words->quiet, "No progress on standard error");
  command->footer(kFooter);
  command->callback([words, &context] { compare(*words, context); });
}

}  // namespace stairwell::apps
