#include "apps/atomic_file.hpp"
#include "apps/commands.hpp"
#include "core/errors.hpp"
#include "learning/train/evaluation.hpp"

#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <ostream>

namespace stairwell::apps {

namespace {

using nlohmann::ordered_json;
using train::EvaluationSuite;
using train::PlannerFigures;

constexpr const char* kFooter =
    "Examples:\n"
    "  stairwell evaluate models/path2d.model --suite worlds/suites/slices_thesis.yaml\n"
    "  stairwell evaluate models/path3d.model --suite worlds/suites/storeys_known.yaml --json\n"
    "agent: alone, with no search and no safety check behind it. strict: where a step that the network wants does not\n"
    "fit, it has failed. agent+net: with the safety check and A*. Beside it A*, the field that the agent is shown,\n"
    "followed without a network (way), and the teacher.\n"
    "Times: of the thread's processor clock, median and most; long: of paths of 17 to 23 m.\n"
    "Exit codes: 0 evaluated, 1 interrupted, 2 bad input.";

struct EvaluateWords {
  std::string model, suite;
  int worlds = 0;
  bool widest = false, json = false, quiet = false;
};

void read_range(const YAML::Node& node, double& least, double& most) {
  if (node.IsSequence()) {
    if (node.size() != 2) throw InputError("a range has two numbers");
    least = node[0].as<double>();
    most = node[1].as<double>();
  } else {
    least = most = node.as<double>();
  }
}

void read_key(EvaluationSuite& suite, const std::string& key, const YAML::Node& value) {
  const std::map<std::string, std::function<void()>> readers{
      {"suite", [&] { suite.name = value.as<std::string>(); }},
      {"kind",
       [&] {
         const auto kind = value.as<std::string>();
         if (kind != "slices" && kind != "storeys") throw InputError("kind must be slices or storeys");
         suite.plane = kind == "slices";
       }},
      {"seed", [&] { suite.seed = value.as<std::uint64_t>(); }},
      {"worlds", [&] { suite.worlds = value.as<int>(); }},
      {"tasks_per_world", [&] { suite.tasks_per_world = value.as<int>(); }},
      {"size_m", [&] { read_range(value, suite.least_size_m, suite.most_size_m); }},
      {"resolution_m", [&] { suite.resolution_m = value.as<double>(); }},
      {"obstacles", [&] { read_range(value, suite.least_obstacles, suite.most_obstacles); }},
      {"storeys",
       [&] {
         double least = 0.0, most = 0.0;
         read_range(value, least, most);
         suite.least_storeys = static_cast<int>(least);
         suite.most_storeys = static_cast<int>(most);
       }},
      {"cross_storey", [&] { suite.cross_storey = value.as<bool>(); }},
      {"partial", [&] { suite.partial = value.as<bool>(); }},
      {"robot_radius_m", [&] { suite.robot_radius_m = value.as<double>(); }},
      {"least_way_m", [&] { suite.least_way_m = value.as<double>(); }}};
  const auto reader = readers.find(key);
  if (reader == readers.end()) throw InputError("unknown key '" + key + "'");
  try {
    reader->second();
  } catch (const YAML::Exception&) {
    throw InputError(key + ": not a value of the right kind");
  }
}

EvaluationSuite read_suite(const std::string& file) {
  try {
    const YAML::Node root = YAML::LoadFile(file);
    if (!root.IsMap()) throw InputError("not a map of keys");
    EvaluationSuite suite;
    for (const auto& entry : root) read_key(suite, entry.first.as<std::string>(), entry.second);
    if (suite.name.empty()) throw InputError("the key 'suite' (its name) is missing");
    if (const auto list = suite.problems(); !list.empty()) throw InputError(list.front());
    return suite;
  } catch (const InputError& problem) {
    throw InputError(file + ": " + problem.what());
  } catch (const YAML::Exception& problem) {
    throw InputError(file + ": " + problem.what());
  }
}

std::vector<const PlannerFigures*> rows(const train::EvaluationResult& result) {
  std::vector<const PlannerFigures*> list{&result.raw,   &result.strict, &result.net,
                                          &result.astar, &result.way,    &result.teacher};
  if (result.widest.episodes > 0) list.push_back(&result.widest);
  return list;
}

ordered_json figures_json(const PlannerFigures& f) {
  return {{"success", f.success},
          {"length_over_optimum", f.length_over_optimum},
          {"min_clearance_m", f.min_clearance_m},
          {"least_clearance_m", f.least_clearance_m},
          {"mean_turn_deg", f.mean_turn_deg},
          {"plan_ms", f.plan_ms},
          {"max_plan_ms", f.max_plan_ms},
          {"long_paths", f.long_paths},
          {"long_plan_ms", f.long_plan_ms},
          {"max_long_plan_ms", f.max_long_plan_ms}};
}

ordered_json report_of(const EvaluationSuite& suite, const nn::Model& model, const train::EvaluationResult& result) {
  ordered_json report{
      {"suite", suite.name},
      {"model", {{"agent", model.agent}, {"seed", model.seed}, {"steps", model.steps}, {"command", model.command}}},
      {"episodes", result.raw.episodes},
      {"raw_success", result.raw.success},
      {"net_success", result.net.success},
      {"length_over_optimum", result.raw.length_over_optimum},
      {"min_clearance_m", result.raw.min_clearance_m},
      {"mean_turn_deg", result.raw.mean_turn_deg},
      {"plan_ms", result.raw.plan_ms},
      {"failures", result.failures}};
  for (const PlannerFigures* f : rows(result)) {
    report["planners"][f->planner] = figures_json(*f);
  }
  return report;
}

void print_table(std::ostream& out, const EvaluationSuite& suite, const train::EvaluationResult& result) {
  char line[200];
  std::snprintf(line, sizeof line, "%s: %zu tasks\n%-12s %9s %9s %12s %12s %9s %9s %9s %9s %9s\n", suite.name.c_str(),
                result.raw.episodes, "planner", "success", "length", "clearance m", "(least) m", "turn deg", "ms",
                "max ms", "long ms", "max ms");
  out << line;
  for (const PlannerFigures* f : rows(result)) {
    std::snprintf(line, sizeof line, "%-12s %8.2f%% %9.3f %12.3f %12.3f %9.2f %9.2f %9.2f %9.2f %9.2f\n",
                  f->planner.c_str(), 100.0 * f->success, f->length_over_optimum, f->min_clearance_m,
                  f->least_clearance_m, f->mean_turn_deg, f->plan_ms, f->max_plan_ms, f->long_plan_ms,
                  f->max_long_plan_ms);
    out << line;
  }
  for (const std::string& failure : result.failures) out << "agent failed, " << failure << "\n";
}

void evaluate_model(const EvaluateWords& words, CommandContext& context) {
  EvaluationSuite suite = read_suite(words.suite);
  if (words.worlds > 0) suite.worlds = words.worlds;
  const nn::Model model = nn::read_model(words.model);
  train::EvaluationOptions options;
  options.clock_s = [] {
    timespec now{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  };
  options.widest = words.widest;
  options.interrupted = [&context] { return context.interrupted != 0; };
  if (!words.quiet && ::isatty(STDERR_FILENO) != 0) {
    options.progress = [](std::size_t done, std::size_t all) {
      std::fprintf(stderr, done + 1 >= all ? "\r\033[K" : "\r%zu of %zu tasks\033[K", done + 1, all);
    };
  }
  const train::EvaluationResult result = train::evaluate(suite, model, options);
  if (words.json) {
    context.out << report_of(suite, model, result).dump(2) << "\n";
  } else {
    print_table(context.out, suite, result);
  }
  if (context.interrupted != 0) context.exit_code = 1;
}

}  // namespace

void add_evaluate_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("evaluate", "Measure a learned agent in worlds that it has never seen");
  auto words = std::make_shared<EvaluateWords>();
  command->add_option("MODEL", words->model, "Weight file")->required();
  command->add_option("--suite", words->suite, "Tasks, as in worlds/suites")->required()->type_name("FILE.yaml");
  command->add_option("--worlds", words->worlds, "Only so many worlds of the suite, or more")
      ->check(CLI::PositiveNumber);
  command->add_flag("--widest", words->widest, "Beside them the way that keeps most clearance where it has least");
  command->add_flag("--json", words->json, "For machines");
  command->add_flag("--quiet", words->quiet, "No progress on standard error");
  command->footer(kFooter);
  command->callback([words, &context] { evaluate_model(*words, context); });
}

}  // namespace stairwell::apps
