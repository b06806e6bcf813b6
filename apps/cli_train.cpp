#include "apps/atomic_file.hpp"
#include "apps/commands.hpp"
#include "core/errors.hpp"
#ifdef STAIRWELL_WITH_TORCH
#include "learning/train/imitation.hpp"
#include "learning/train/training_checkpoint.hpp"
#endif

#include <unistd.h>

#include <CLI/CLI.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <ostream>
#include <sstream>

namespace stairwell::apps {

namespace {

namespace fs = std::filesystem;

constexpr const char* kFooter =
    "Examples:\n"
    "  stairwell train path2d --algo dagger --steps 20000 --seed 1 --out training/path2d\n"
    "  stairwell train path2d --algo dagger --steps 20000 --seed 1 --out training/path2d --resume\n"
    "The folder gets AGENT.model, curves.csv and checkpoint. A training that was interrupted or killed goes on with\n"
    "--resume. Exit codes: 0 trained, 1 interrupted, 2 bad input.";

struct TrainWords {
  std::string agent, algorithm = "dagger", head = "unit_vector", attraction = "geodesic", device = "cpu", out;
  std::uint64_t steps = 20'000, seed = 1;
  int scales = 2;
  bool resume = false, quiet = false;
};

#ifdef STAIRWELL_WITH_TORCH

constexpr const char* kBuiltFrom = sizeof(STAIRWELL_COMMIT) > 1 ? STAIRWELL_COMMIT : "unknown";
constexpr double kSecondsBetweenLines = 30.0;

train::ImitationConfig config_of(const TrainWords& words) {
  using Config = train::ImitationConfig;
  Config config = words.agent == "path2d" ? Config::slice() : Config::volume();
  config.algorithm = words.algorithm == "bc" ? Config::Algorithm::kBc : Config::Algorithm::kDagger;
  config.head = words.head == "angles" ? nn::Head::kAngles : nn::Head::kUnitVector;
  if (words.attraction == "cone") config.input.attraction = planning3d::AgentInput::Attraction::kCone;
  if (words.scales == 1) config.input.spacings_m.resize(1);
  config.steps = words.steps;
  config.seed = words.seed;
  config.device = words.device;
  return config;
}

std::string command_of(const TrainWords& words) {
  std::ostringstream text;
  text << "stairwell train " << words.agent << " --algo " << words.algorithm << " --steps " << words.steps << " --seed "
       << words.seed;
  if (words.head != "unit_vector") text << " --head " << words.head;
  if (words.attraction != "geodesic") text << " --attraction " << words.attraction;
  if (words.scales != 2) text << " --scales " << words.scales;
  if (words.device != "cpu") text << " --device " << words.device;
  return text.str();
}

std::string file_bytes(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file.string() + ": cannot be read; nothing to resume");
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The rows of a curve up to the step from which training goes on.
std::string curve_until(const fs::path& file, std::uint64_t steps) {
  std::istringstream in(file_bytes(file));
  std::string kept, line;
  for (bool header = true; std::getline(in, line); header = false) {
    if (header || std::strtoull(line.c_str() + line.find(',') + 1, nullptr, 10) <= steps) kept += line + "\n";
  }
  return kept;
}

class TrainingShow {
 public:
  explicit TrainingShow(bool quiet) : quiet_(quiet), terminal_(::isatty(STDERR_FILENO) != 0) {}

  void show(const train::RoundReport& report, std::uint64_t steps, double wall_s) {
    if (quiet_ || (!terminal_ && wall_s < next_s_ && report.steps < steps)) return;
    next_s_ = wall_s + kSecondsBetweenLines;
    constexpr int kWidth = 24;
    const int full = static_cast<int>(kWidth * report.steps / steps);
    const std::string bar =
        std::string(static_cast<std::size_t>(full), '#') + std::string(static_cast<std::size_t>(kWidth - full), '-');
    std::fprintf(stderr, "%s[%s] step %llu/%llu  loss %.4f  success %.1f %%  %.0f s%s", terminal_ ? "\r" : "",
                 bar.c_str(), static_cast<unsigned long long>(report.steps), static_cast<unsigned long long>(steps),
                 report.loss, 100.0 * report.student_success, wall_s, terminal_ ? "\033[K" : "\n");
    if (terminal_ && report.steps >= steps) std::fputc('\n', stderr);
  }

 private:
  bool quiet_, terminal_;
  double next_s_ = 0.0;
};

std::string curve_row(const train::RoundReport& report, double wall_s) {
  std::ostringstream row;
  row << report.round << ',' << report.steps << ',' << report.looks << ',' << report.loss << ',';
  if (!std::isnan(report.student_success)) row << report.student_success;
  row << ',' << wall_s << "\n";
  return row.str();
}

void train_agent(const TrainWords& words, CommandContext& context) {
  constexpr double kCheckpointEvery_s = 20.0;
  const train::ImitationConfig config = config_of(words);
  const std::string command = command_of(words);
  const fs::path out(words.out), checkpoint = out / "checkpoint", curves = out / "curves.csv";
  std::error_code error;
  fs::create_directories(out, error);
  if (error) throw RunError(words.out + ": the folder cannot be made: " + error.message());
  std::string curve = "round,step,looks,loss,student_success,wall_s\n";
  train::ImitationState resumed;
  if (words.resume) {
    try {
      resumed = train::parse_checkpoint(file_bytes(checkpoint), command);
    } catch (const InputError& problem) {
      throw InputError(checkpoint.string() + ": " + problem.what());
    }
    curve = curve_until(curves, resumed.steps);
  } else if (fs::exists(checkpoint)) {
    throw InputError(words.out + ": holds a training already: --resume it, or choose another folder");
  }
  train::Imitation imitation(config, words.resume ? &resumed : nullptr);
  TrainingShow show(words.quiet);
  const auto begin = std::chrono::steady_clock::now();
  const auto wall_s = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  double saved_s = 0.0;
  const auto save = [&] {
    write_file_atomically(curves, curve);
    write_file_atomically(out / (words.agent + ".model"), nn::model_bytes(imitation.model(command, kBuiltFrom)));
    write_file_atomically(checkpoint, train::checkpoint_bytes(imitation.state(), command));
    saved_s = wall_s();
  };
  while (!imitation.finished() && context.interrupted == 0) {
    const train::RoundReport report = imitation.round();
    curve += curve_row(report, wall_s());
    show.show(report, config.steps, wall_s());
    if (wall_s() - saved_s > kCheckpointEvery_s) save();
  }
  save();
  context.out << (out / (words.agent + ".model")).string() << "\n";
  if (!imitation.finished()) context.exit_code = 1;
}

#else

void train_agent(const TrainWords&, CommandContext&) {
  throw InputError(
      "this program was built without LibTorch, so it cannot train (install libtorch-dev and build again)");
}

#endif

}  // namespace

void add_train_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("train", "Train a learned agent");
  auto words = std::make_shared<TrainWords>();
  command->add_option("AGENT", words->agent, "path2d (slices) or path3d (volumes)")
      ->required()
      ->check(CLI::IsMember({"path2d", "path3d"}));
  command->add_option("--algo", words->algorithm, "bc (behaviour cloning) or dagger")
      ->check(CLI::IsMember({"bc", "dagger"}))
      ->capture_default_str();
  command->add_option("--steps", words->steps, "Steps of gradient descent")->capture_default_str();
  command->add_option("--seed", words->seed, "Of worlds, flights and weights")->capture_default_str();
  command->add_option("--head", words->head, "What the network puts out: unit_vector or angles")
      ->check(CLI::IsMember({"unit_vector", "angles"}))
      ->capture_default_str();
  command->add_option("--attraction", words->attraction, "What it is shown of the goal: geodesic or cone")
      ->check(CLI::IsMember({"geodesic", "cone"}))
      ->capture_default_str();
  command->add_option("--scales", words->scales, "Windows: 2 (fine and coarse) or 1 (fine)")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  command->add_option("--device", words->device, "cpu or cuda")
      ->check(CLI::IsMember({"cpu", "cuda"}))
      ->capture_default_str();
  command->add_option("--out", words->out, "Folder for model, curves and checkpoint")->required()->type_name("DIR");
  command->add_flag("--resume", words->resume, "Go on from the folder's checkpoint");
  command->add_flag("--quiet", words->quiet, "No progress on standard error");
  command->footer(kFooter);
  command->callback([words, &context] { train_agent(*words, context); });
}

}  // namespace stairwell::apps
