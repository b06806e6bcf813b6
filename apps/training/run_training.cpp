#include "apps/atomic_file.hpp"
#include "apps/commit.hpp"
#include "apps/curve_picture.hpp"
#include "apps/training/training_run.hpp"
#include "apps/training_module.hpp"
#include "core/errors.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <ostream>
#include <sstream>

namespace stairwell::apps {

namespace {

namespace fs = std::filesystem;

constexpr double kSecondsBetweenLines = 30.0;
constexpr double kSecondsBetweenModels = 20.0;

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
  TrainingShow(bool quiet, std::uint64_t all) : quiet_(quiet), terminal_(::isatty(STDERR_FILENO) != 0), all_(all) {}

  void show(std::uint64_t steps, const std::string& summary, double wall_s) {
    if (quiet_ || (!terminal_ && wall_s < next_s_ && steps < all_)) return;
    next_s_ = wall_s + kSecondsBetweenLines;
    constexpr std::size_t kWidth = 24;
    const auto full = static_cast<std::size_t>(kWidth * steps / all_);
    const std::string bar = std::string(full, '#') + std::string(kWidth - full, '-');
    std::fprintf(stderr, "%s[%s] step %llu/%llu  %s  %.0f s%s", terminal_ ? "\r" : "", bar.c_str(),
                 static_cast<unsigned long long>(steps), static_cast<unsigned long long>(all_), summary.c_str(), wall_s,
                 terminal_ ? "\033[K" : "\n");
    if (terminal_ && steps >= all_) std::fputc('\n', stderr);
  }

 private:
  bool quiet_, terminal_;
  std::uint64_t all_;
  double next_s_ = 0.0;
};

/// The folder of one training, and its clock.
class TrainingFolder {
 public:
  TrainingFolder(const TrainingRequest& request, TrainingRun& run)
      : run_(&run), command_(command_of(request)), out_(request.out), model_(out_ / (request.agent + ".model")) {
    std::error_code error;
    fs::create_directories(out_, error);
    if (error) throw RunError(request.out + ": the folder cannot be made: " + error.message());
    curve_ = run.columns() + ",wall_s\n";
    const fs::path checkpoint = out_ / "checkpoint";
    if (!request.resume) {
      if (!fs::exists(checkpoint)) return;
      throw InputError(request.out + ": holds a training already: --resume it, or choose another folder");
    }
    try {
      run.resume(file_bytes(checkpoint), command_);
    } catch (const InputError& problem) {
      throw InputError(checkpoint.string() + ": " + problem.what());
    }
    curve_ = curve_until(out_ / "curves.csv", run.steps());
  }

  double wall_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }
  void add_row(const std::string& row) {
    std::ostringstream line;
    line << row << ',' << wall_s() << "\n";
    curve_ += line.str();
  }
  void save_if_due() {
    if (wall_s() - model_saved_s_ > kSecondsBetweenModels) save_model();
    if (wall_s() - checkpoint_saved_s_ > run_->seconds_between_checkpoints()) save_checkpoint();
  }
  void save_all() {
    save_model();
    save_checkpoint();
  }
  const fs::path& model() const { return model_; }

 private:
  void save_model() {
    write_file_atomically(out_ / "curves.csv", curve_);
    write_curve_picture(CsvTable::read(out_ / "curves.csv"), command_, out_ / "curves.png");
    nn::Model model = run_->model();
    model.command = command_;
    model.commit = kBuiltFrom;
    write_file_atomically(model_, nn::model_bytes(model));
    model_saved_s_ = wall_s();
  }
  void save_checkpoint() {
    write_file_atomically(out_ / "checkpoint", run_->checkpoint(command_));
    checkpoint_saved_s_ = wall_s();
  }

  TrainingRun* run_;
  std::string command_;
  fs::path out_, model_;
  std::string curve_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  double model_saved_s_ = 0.0, checkpoint_saved_s_ = 0.0;
};

std::unique_ptr<TrainingRun> make_run(const TrainingRequest& request) {
  if (request.agent == "coverage") return make_coverage_run(request);
  const bool by_example = request.algorithm == "bc" || request.algorithm == "dagger";
  return by_example ? make_imitation_run(request) : make_reinforcement_run(request);
}

void train_agent(const TrainingRequest& request, CommandContext& context) {
  const std::unique_ptr<TrainingRun> run = make_run(request);
  TrainingFolder folder(request, *run);
  TrainingShow show(request.quiet, request.steps);
  while (!run->finished() && context.interrupted == 0) {
    folder.add_row(run->advance());
    show.show(run->steps(), run->summary(), folder.wall_s());
    folder.save_if_due();
  }
  folder.save_all();
  context.out << folder.model().string() << "\n";
  if (!run->finished()) context.exit_code = 1;
}

}  // namespace

planning3d::AgentInput input_of(const TrainingRequest& request) {
  using planning3d::AgentInput;
  AgentInput input = request.agent == "path2d" ? AgentInput::slice() : AgentInput::volume();
  input.attraction = AgentInput::attraction_named(request.attraction);
  if (request.scales == 1) input.spacings_m.resize(1);
  return input;
}

std::string command_of(const TrainingRequest& request) {
  std::ostringstream text;
  text << "stairwell train " << request.agent << " --algo " << request.algorithm << " --steps " << request.steps
       << " --seed " << request.seed;
  if (request.head != "unit_vector") text << " --head " << request.head;
  if (request.attraction != "geodesic") text << " --attraction " << request.attraction;
  if (request.scales != 2) text << " --scales " << request.scales;
  if (request.reward != "progress") text << " --reward " << request.reward;
  if (request.demonstrations) text << " --demonstrations " << *request.demonstrations;
  if (!request.from.empty()) text << " --from " << request.from;
  if (request.device != "cpu") text << " --device " << request.device;
  return text.str();
}

}  // namespace stairwell::apps

/// What the program looks for in this module.
extern "C" void stairwell_run_training(const stairwell::apps::TrainingRequest& request,
                                       stairwell::apps::CommandContext& context) {
  stairwell::apps::train_agent(request, context);
}
