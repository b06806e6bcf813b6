#include "apps/commands.hpp"
#include "apps/explore_options.hpp"
#include "apps/explore_run.hpp"
#include "apps/settings.hpp"
#include "core/errors.hpp"

#include <CLI/CLI.hpp>

#include <memory>
#include <ostream>

namespace stairwell::apps {

namespace {

constexpr const char* kFooter =
    "Examples:\n"
    "  stairwell explore worlds/office_tower.sdf --uavs 4\n"
    "  stairwell explore worlds/duplex.sdf --mode slice --layers auto --seed 3 --out runs/duplex\n"
    "  stairwell explore building.sdf --start -9,0,0 --box -10,-10,0,10,10,4 --vmax 2 --amax 3\n"
    "  stairwell explore cloud.pcd --sensor lidar --fov-deg 360x-7..45 --range 10 --uavs 4\n"
    "  stairwell explore --config runs/duplex/config.yaml --set robot_radius_m=0.25\n"
    "  stairwell explore --resume runs/duplex\n"
    "Later wins: defaults, --config, --set, options. A run that is interrupted (Ctrl-C) is saved and exits with 1;\n"
    "one that reaches its time limit exits with 0.";

struct ExploreWords {
  std::string world, out, resume;
  ExploreOptions options;
  bool json = false, quiet = false;
};

Settings settings_of(const ExploreWords& words) {
  Settings settings = words.options.settings();
  if (!words.world.empty()) settings["world"] = {words.world, "WORLD"};
  return settings;
}

void check_resume_alone(const ExploreWords& words) {
  if (words.resume.empty()) return;
  std::string extra = words.options.given();
  if (!words.world.empty()) extra = words.world;
  if (!words.out.empty()) extra = "--out";
  if (!extra.empty()) {
    throw InputError("--resume takes everything from the run folder: remove " + extra);
  }
}

void explore(const ExploreWords& words, CommandContext& context) {
  check_resume_alone(words);
  ExploreRequest request;
  request.resume = words.resume;
  request.out = words.out;
  request.progress = Progress::style_for(words.quiet);
  if (words.resume.empty()) request.settings = settings_of(words);
  const ExploreResult result = run_explore(request, context.interrupted);
  if (words.json) {
    context.out << result.metrics;
  } else {
    if (result.was_complete) context.out << "the run is complete, nothing to resume\n";
    context.out << summary_text(result);
  }
  if (!result.interrupted) return;
  context.exit_code = 1;
  Progress(request.progress).note("interrupted: go on with  stairwell explore --resume " + result.folder.string());
}

}  // namespace

void add_explore_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("explore", "Explore a world with a fleet of UAVs");
  auto words = std::make_shared<ExploreWords>();
  command->add_option("WORLD", words->world, "World file: .sdf .stl .obj .dae .ply .glb .bt .ot .pcd .yaml .3dmap");
  words->options.add_to(*command);
  command->add_option("--out", words->out, "Run folder (default: runs/<world>-<mode>-<seed>)")->type_name("DIR");
  command->add_option("--resume", words->resume, "Go on with the run in this folder")->type_name("DIR");
  command->add_flag("--json", words->json, "Print metrics.json on standard output and nothing else");
  command->add_flag("--quiet", words->quiet, "No progress on standard error");
  command->footer(kFooter);
  command->callback([words, &context] { explore(*words, context); });
}

}  // namespace stairwell::apps
