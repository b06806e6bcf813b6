#include "apps/commands.hpp"
#include "apps/training_module.hpp"
#include "core/errors.hpp"

#include <CLI/CLI.hpp>

#include <memory>

namespace stairwell::apps {

namespace {

constexpr const char* kFooter =
    "Examples:\n"
    "  stairwell train path2d --algo dagger --steps 20000 --seed 1 --out training/path2d\n"
    "  stairwell train path2d --algo dagger --steps 20000 --seed 1 --out training/path2d --resume\n"
    "  stairwell train path2d --algo td3bc --steps 4000 --from models/path2d.model --out training/finer\n"
    "  stairwell train path3d --algo sac --reward thesis --demonstrations 0.5 --steps 10000 --out training/sac\n"
    "  stairwell train coverage --steps 12000 --seed 1 --out training/coverage\n"
    "The folder gets AGENT.model, curves.csv, curves.png and checkpoint. A training that was interrupted or killed "
    "goes\n"
    "on with --resume. Exit codes: 0 trained, 1 interrupted, 2 bad input.";

void add_learning_options(CLI::App& command, TrainingRequest& request) {
  command
      .add_option(
          "--algo", request.algorithm,
          "By example: bc (behaviour cloning) or dagger (the default). By trial and error: ddpg, td3, sac, td3bc "
          "(TD3 with cloning of demonstrations). Coverage: dqn (Double DQN)")
      ->check(CLI::IsMember({"bc", "dagger", "ddpg", "td3", "sac", "td3bc", "dqn"}));
  command.add_option("--steps", request.steps, "Steps of gradient descent")->capture_default_str();
  command.add_option("--seed", request.seed, "Of worlds, flights and weights")->capture_default_str();
  command.add_option("--reward", request.reward, "By trial and error: progress, or the thesis's (5.7; coverage: 5.15)")
      ->check(CLI::IsMember({"progress", "thesis"}))
      ->capture_default_str();
  command
      .add_option("--demonstrations", request.demonstrations,
                  "By trial and error: share of the teacher's steps in what is learned from (td3bc 0.5, others 0)")
      ->check(CLI::Range(0.0, 1.0));
  command.add_option("--from", request.from, "By trial and error: trained agent to start from")->type_name("MODEL");
}

/// What is not given follows the agent. @throws InputError for an algorithm that is not for it
void settle_algorithm(TrainingRequest& request) {
  const bool coverage = request.agent == "coverage";
  if (request.algorithm.empty()) request.algorithm = coverage ? "dqn" : "dagger";
  if ((request.algorithm == "dqn") != coverage)
    throw InputError("--algo " + request.algorithm + ": not for " + request.agent +
                     (coverage ? ", which learns by dqn" : ", which learns by bc, dagger, ddpg, td3, sac or td3bc"));
}

}  // namespace

void add_train_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("train", "Train a learned agent");
  auto request = std::make_shared<TrainingRequest>();
  command->add_option("AGENT", request->agent, "path2d (slices), path3d (volumes) or coverage (where to go)")
      ->required()
      ->check(CLI::IsMember({"path2d", "path3d", "coverage"}));
  add_learning_options(*command, *request);
  command->add_option("--head", request->head, "What the network puts out: unit_vector or angles")
      ->check(CLI::IsMember({"unit_vector", "angles"}))
      ->capture_default_str();
  command
      ->add_option(
          "--attraction", request->attraction,
          "What it is shown of the goal: geodesic, cone, or (path3d) portals: a cone around the next opening between "
          "storeys")
      ->check(CLI::IsMember({"geodesic", "cone", "portals"}))
      ->capture_default_str();
  command->add_option("--scales", request->scales, "Windows: 2 (fine and coarse) or 1 (fine)")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  command->add_option("--device", request->device, "cpu or cuda")
      ->check(CLI::IsMember({"cpu", "cuda"}))
      ->capture_default_str();
  command->add_option("--out", request->out, "Folder for model, curves and checkpoint")->required()->type_name("DIR");
  command->add_flag("--resume", request->resume, "Go on from the folder's checkpoint");
  command->add_flag("--quiet", request->quiet, "No progress on standard error");
  command->footer(kFooter);
  command->callback([request, &context] {
    settle_algorithm(*request);
    run_training(*request, context);
  });
}

}  // namespace stairwell::apps
