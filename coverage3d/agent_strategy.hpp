#pragma once

#include "coverage3d/coverage_options.hpp"
#include "coverage3d/frontier_strategy.hpp"

#include <filesystem>
#include <vector>

namespace stairwell::coverage3d {

/// One UAV after the other chooses among the stops that are near it, the pressing ones and the small remainders, and
/// keeps to its choice until that has been seen. It chooses from a short list. Who chooses is a network with a value
/// for each (learning/rl/double_dqn.hpp), or whoever trains one.
class AgentStrategy final : public FrontierStrategy {
 public:
  AgentStrategy(const CoverageConfig& config, OptionChooser chooser)
      : FrontierStrategy(config), chooser_(std::move(chooser)) {}

  std::string_view name() const override { return "agent"; }
  std::unique_ptr<CoverageStrategy> clone() const override {
    return copy_to(std::make_unique<AgentStrategy>(config(), chooser_));
  }

 protected:
  void share_out(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                 const std::vector<Stop>& stops, Assignment& assignment) override;

 private:
  std::vector<Stop> candidates(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                               const std::vector<Stop>& stops, std::vector<bool>& pressing) const;
  OptionScene scene_of(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                       std::size_t vehicle, const Assignment& assignment) const;
  /// The stops to choose from.
  struct Menu {
    std::vector<bool> pressing;
    std::vector<std::vector<double>> between_s;
  };
  std::size_t choose(const Crew& crew, std::size_t vehicle, const std::vector<Stop>& stops,
                     const std::vector<std::size_t>& left, const Menu& menu, const OptionScene& scene, double time_s);
  CoverageOption option_of(const Crew& crew, std::size_t vehicle, const Stop& stop) const;

  OptionChooser chooser_;
};

/// The network of `coverage.model` in a folder. @throws InputError naming the file where it is missing, damaged or for
/// something else
OptionChooser load_coverage_agent(const std::filesystem::path& models_dir);

}  // namespace stairwell::coverage3d
