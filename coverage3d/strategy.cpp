#include "coverage3d/strategy.hpp"

#include "core/errors.hpp"
#include "coverage3d/frontier_strategy.hpp"
#include "coverage3d/layer_strategy.hpp"

namespace stairwell::coverage3d {

std::vector<std::string_view> strategy_names() { return {"frontiers", "layers"}; }

std::unique_ptr<CoverageStrategy> make_strategy(std::string_view name, const CoverageConfig& config) {
  if (name == "frontiers") return std::make_unique<FrontierStrategy>(config);
  if (name == "layers") return std::make_unique<LayerStrategy>(config);
  std::string known;
  for (const std::string_view one : strategy_names()) known += (known.empty() ? "" : ", ") + std::string(one);
  throw InputError("unknown coverage strategy '" + std::string(name) + "' (known: " + known + ")");
}

}  // namespace stairwell::coverage3d
