#include "coverage3d/strategy.hpp"

#include "core/errors.hpp"
#include "coverage3d/agent_strategy.hpp"
#include "coverage3d/frontier_strategy.hpp"
#include "coverage3d/hybrid_strategy.hpp"
#include "coverage3d/kmeans_strategy.hpp"
#include "coverage3d/layer_strategy.hpp"
#include "coverage3d/pick_strategy.hpp"

namespace stairwell::coverage3d {

std::vector<std::string_view> strategy_names() {
  return {"frontiers", "layers", "kmeans", "hybrid", "agent", "nearest", "greedy", "lawnmower", "random"};
}

std::unique_ptr<CoverageStrategy> make_strategy(std::string_view name, const CoverageConfig& config) {
  if (name == "frontiers") return std::make_unique<FrontierStrategy>(config);
  if (name == "layers") return std::make_unique<LayerStrategy>(config);
  if (name == "kmeans") return std::make_unique<KMeansStrategy>(config);
  if (name == "agent") return std::make_unique<AgentStrategy>(config, load_coverage_agent(config.models_dir));
  if (name == "nearest") return std::make_unique<NearestStrategy>(config);
  if (name == "greedy") return std::make_unique<GreedyStrategy>(config);
  if (name == "lawnmower") return std::make_unique<LawnmowerStrategy>(config);
  if (name == "random") return std::make_unique<RandomStrategy>(config);
  if (name == "hybrid" && config.hybrid_first != "hybrid")
    return std::make_unique<HybridStrategy>(make_strategy(config.hybrid_first, config),
                                            std::make_unique<KMeansStrategy>(config), config.box, config.hybrid_switch);
  if (name == "hybrid") throw InputError("hybrid_first: a strategy other than hybrid itself must come first");
  std::string known;
  for (const std::string_view one : strategy_names()) known += (known.empty() ? "" : ", ") + std::string(one);
  throw InputError("unknown coverage strategy '" + std::string(name) + "' (known: " + known + ")");
}

}  // namespace stairwell::coverage3d
