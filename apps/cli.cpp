#include "apps/cli.hpp"

#include "apps/commands.hpp"
#include "apps/completion_script.hpp"
#include "apps/film.hpp"
#include "apps/man_page.hpp"
#include "apps/option_values.hpp"
#include "apps/report.hpp"
#include "core/errors.hpp"
#include "core/version.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <ostream>
#include <tuple>

namespace stairwell::apps {

namespace {

std::string one_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  std::ranges::replace(text, '\n', ' ');
  std::ranges::replace(text, '\r', ' ');
  return text;
}

void describe(CLI::App& app) {
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("stairwell ") + kVersion);
  app.set_help_all_flag("--help-all", "Help of every command");
  app.footer(
      "Examples:\n"
      "  stairwell explore worlds/office_tower.sdf --uavs 4\n"
      "  stairwell map info runs/office_tower-volume-1/map.bt\n"
      "  stairwell explore --help\n"
      "Exit codes: 0 done, 1 the run failed or was interrupted, 2 bad usage or input.");
}

/// CLI11 says only that a subcommand is missing.
void require_known_command(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty() || words[0].starts_with("-")) return;
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  if (std::ranges::any_of(commands, [&](const CLI::App* command) { return command->get_name() == words[0]; })) return;
  throw InputError("unknown command '" + words[0] + "' (see --help)");
}

struct FilmWords {
  std::string file, size = "960x540";
  FilmOptions options;
};

void add_film_options(CLI::App& command, FilmWords& words) {
  command.add_option("--film", words.file, "Make a film (.mp4 or .gif) instead; by ffmpeg if that is installed");
  command.add_option("--view", words.options.view, "Of the film: as in `map render`")->capture_default_str();
  command.add_option("--size", words.size, "Of the film: width x height in pixels")->capture_default_str();
}

void write_film(const std::string& folder, FilmWords& words, std::ostream& out) {
  std::tie(words.options.width, words.options.height) = parse_size(words.size);
  const Film film = make_film(folder, words.file, words.options);
  if (film.file.empty()) {
    out << "ffmpeg is not installed: no film, but " << film.frames << " frames in " << film.frames_dir.string() << "\n";
  } else {
    out << film.file.string() << "\n";
  }
}

}  // namespace

void add_report_command(CLI::App& app, CommandContext& context) {
  CLI::App* command =
      app.add_subcommand("report", "Write report.html of a run folder again, or of two side by side, or make a film");
  auto folders = std::make_shared<std::vector<std::string>>();
  auto file = std::make_shared<std::string>();
  auto film = std::make_shared<FilmWords>();
  command->add_option("DIR", *folders, "Run folder, or two of them")->required()->expected(1, 2);
  command->add_option("-o,--out", *file, "File to write (default: report.html in the folder; comparison.html for two)")
      ->type_name("FILE.html");
  add_film_options(*command, *film);
  command->footer(
      "Examples:\n"
      "  stairwell report runs/office_tower-volume-1\n"
      "  stairwell report runs/duplex-slice-1 runs/duplex-volume-1 -o duplex.html\n"
      "  stairwell report runs/office_tower-volume-1 --film tower.mp4");
  command->callback([folders, file, film, &context] {
    if (!film->file.empty()) {
      if (folders->size() > 1) throw InputError("report: a film is made of one run folder");
      return write_film(folders->front(), *film, context.out);
    }
    const std::vector<std::filesystem::path> run_dirs(folders->begin(), folders->end());
    std::filesystem::path target = run_dirs.size() == 1 ? run_dirs[0] / "report.html" : "comparison.html";
    if (!file->empty()) target = *file;
    write_report(run_dirs, target);
    context.out << target.string() << "\n";
  });
}

void add_completion_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("completion", "Print the completion script for bash or zsh");
  auto shell = std::make_shared<std::string>("bash");
  command->add_option("--shell", *shell, "bash or zsh")->capture_default_str()->check(CLI::IsMember({"bash", "zsh"}));
  command->footer(
      "Examples:\n  stairwell completion > ~/.local/share/bash-completion/completions/stairwell\n"
      "  stairwell completion --shell zsh > ~/.zsh/functions/_stairwell");
  command->callback([shell, &context] {
    // zsh runs bash's script.
    if (*shell == "zsh") context.out << "#compdef stairwell\nautoload -U +X bashcompinit && bashcompinit\n";
    context.out << kCompletionScript;
    // Autoloaded at the first completion, it has to answer that one, too.
    if (*shell == "zsh") context.out << "if (( ${+compstate} )); then _bash_complete -o filenames -F _stairwell; fi\n";
  });
}

void add_man_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("man", "Print the manual page");
  command->footer("Example:\n  stairwell man | man -l -");
  command->callback([&app, &context] { context.out << man_page(app); });
}

int run_program(const std::vector<std::string>& words, std::ostream& out, std::ostream& err,
                const volatile std::sig_atomic_t& interrupted) {
  CLI::App app("Explores unknown multi-storey 3D worlds with fleets of simulated UAVs", "stairwell");
  CommandContext context{out, interrupted};
  describe(app);
  add_explore_command(app, context);
  add_bound_command(app, context);
  add_compare_command(app, context);
  add_plan_command(app, context);
  add_train_command(app, context);
  add_evaluate_command(app, context);
  add_world_commands(app, context);
  add_map_commands(app, context);
  add_report_command(app, context);
  add_completion_command(app, context);
  add_man_command(app, context);
  try {
    require_known_command(app, words);
    std::vector<std::string> reversed = join_minus_values(words);
    std::ranges::reverse(reversed);  // CLI11 takes them from the back
    app.parse(reversed);
    out.flush();
    if (!out) throw RunError("standard output cannot be written");
    return context.exit_code;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // help and version
      app.exit(error, out, err);
      return kExitDone;
    }
    err << "stairwell: " << one_line(error.what()) << " (see --help)\n";
    return kExitBadInput;
  } catch (const InputError& error) {
    err << "stairwell: " << one_line(error.what()) << "\n";
    return kExitBadInput;
  } catch (const std::exception& error) {
    err << "stairwell: " << one_line(error.what()) << "\n";
    return kExitRunFailed;
  }
}

}  // namespace stairwell::apps
