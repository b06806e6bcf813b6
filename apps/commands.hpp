/// The subcommands. Each adds itself to the parser; its action runs while the words are parsed.
#pragma once

#include <csignal>
#include <iosfwd>

namespace CLI {
class App;
}

namespace stairwell::sim3d {
struct WorldOptions;
}

namespace stairwell::apps {

struct CommandContext {
  std::ostream& out;
  const volatile std::sig_atomic_t& interrupted;
  int exit_code = 0;
};

/// How files that are no complete description of a world are read: the same for all commands that read worlds.
void add_world_options(CLI::App& command, sim3d::WorldOptions& options);

void add_explore_command(CLI::App& app, CommandContext& context);
void add_bound_command(CLI::App& app, CommandContext& context);
void add_compare_command(CLI::App& app, CommandContext& context);
void add_plan_command(CLI::App& app, CommandContext& context);
void add_train_command(CLI::App& app, CommandContext& context);
void add_evaluate_command(CLI::App& app, CommandContext& context);
void add_world_commands(CLI::App& app, CommandContext& context);
void add_map_commands(CLI::App& app, CommandContext& context);
void add_report_command(CLI::App& app, CommandContext& context);
void add_completion_command(CLI::App& app, CommandContext& context);
void add_man_command(CLI::App& app, CommandContext& context);

}  // namespace stairwell::apps
