#include "apps/commands.hpp"
#include "apps/known_map.hpp"
#include "apps/map_files.hpp"
#include "apps/option_values.hpp"
#include "apps/render.hpp"
#include "core/errors.hpp"
#include "mapping/octomap_io.hpp"

#include <octomap/OcTree.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>
#include <memory>
#include <ostream>

namespace stairwell::apps {

namespace {

struct MapWords {
  std::string first, second, view = "iso", size = "1200x900", output;
  sim3d::WorldOptions world_options;
  double resolution_m = std::numeric_limits<double>::quiet_NaN();
  bool json = false;
};

/// `key: value` lines for people.
void print(const nlohmann::ordered_json& values, bool json, std::ostream& out) {
  if (json) {
    out << values.dump(2) << "\n";
    return;
  }
  for (const auto& [key, value] : values.items()) {
    out << key << ": " << (value.is_string() ? value.get<std::string>() : value.dump()) << "\n";
  }
}

/// An OctoMap as it is, unknown space included; of a world what is solid.
void render(const MapWords& words) {
  RenderOptions options;
  parse_view(words.view, options);
  std::tie(options.width, options.height) = parse_size(words.size);
  if (is_octomap_file(words.first) && std::isnan(words.resolution_m)) {
    const auto tree = mapping::load_octree(words.first);
    render_map_png(mapping::map_from_octree(*tree), options, words.output);
    return;
  }
  KnownMapOptions known;
  known.world = words.world_options;
  known.resolution_m = words.resolution_m;
  render_map_png(load_known_map(words.first, known).map(), options, words.output);
}

void add_info(CLI::App& map, CommandContext& context) {
  CLI::App* command = map.add_subcommand("info", "Size, volumes and bounds of a map");
  auto words = std::make_shared<MapWords>();
  command->add_option("FILE", words->first, ".bt or .ot file")->required();
  command->add_flag("--json", words->json, "For machines");
  command->footer("Example:\n  stairwell map info runs/duplex-volume-1/map.bt --json");
  command->callback([words, &context] { print(map_info(words->first), words->json, context.out); });
}

void add_compare(CLI::App& map, CommandContext& context) {
  CLI::App* command = map.add_subcommand("compare", "Right, wrong and missing voxels of a map");
  auto words = std::make_shared<MapWords>();
  command->add_option("MAP", words->first, ".bt or .ot file")->required();
  command->add_option("REFERENCE", words->second, "Another map (.bt .ot) or a world file")->required();
  add_world_options(*command, words->world_options);
  command->add_flag("--json", words->json, "For machines");
  command->footer("Example:\n  stairwell map compare runs/duplex-volume-1/map.bt worlds/duplex.sdf --json");
  command->callback([words, &context] {
    print(to_json(compare_with(words->first, words->second, words->world_options)), words->json, context.out);
  });
}

void add_convert(CLI::App& map) {
  CLI::App* command = map.add_subcommand("convert", "Write a map in another format");
  auto words = std::make_shared<MapWords>();
  command->add_option("IN", words->first, ".bt or .ot file")->required();
  command->add_option("OUT", words->second, ".bt, .ot, or .pcd/.ply (centres of the occupied voxels)")->required();
  command->footer("Example:\n  stairwell map convert map.ot map.pcd");
  command->callback([words] { convert_map(words->first, words->second); });
}

void add_render(CLI::App& map) {
  CLI::App* command = map.add_subcommand("render", "Draw a map or a world as a PNG");
  auto words = std::make_shared<MapWords>();
  command->add_option("MAP", words->first, ".bt or .ot file, or a world file")->required();
  command->add_option("--view", words->view, "iso, top, slice:Z at the height Z in metres, or storey:K, counted from 1")
      ->capture_default_str();
  command->add_option("--size", words->size, "Width x height in pixels")->capture_default_str();
  command->add_option("--resolution", words->resolution_m, "Edge of a world's voxels; the default is 0.1");
  add_world_options(*command, words->world_options);
  command->add_option("-o,--output", words->output, "PNG file")->required();
  command->footer(
      "Examples:\n"
      "  stairwell map render map.bt --view slice:1.2 --size 800x600 -o slice.png\n"
      "  stairwell map render worlds/duplex.sdf --view storey:2 -o upstairs.png");
  command->callback([words] { render(*words); });
}

}  // namespace

void add_map_commands(CLI::App& app, CommandContext& context) {
  CLI::App* map = app.add_subcommand("map", "Look at, compare, convert and draw OctoMap files");
  map->require_subcommand(1);
  map->footer("Example:\n  stairwell map info map.bt");
  add_info(*map, context);
  add_compare(*map, context);
  add_convert(*map);
  add_render(*map);
}

}  // namespace stairwell::apps
