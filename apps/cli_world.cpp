#include "apps/atomic_file.hpp"
#include "apps/commands.hpp"
#include "apps/map_files.hpp"
#include "core/errors.hpp"
#include "mapping/octomap_io.hpp"
#include "sim3d/generator.hpp"
#include "sim3d/world.hpp"
#include "sim3d/world_io.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <memory>
#include <ostream>

namespace stairwell::apps {

namespace {

struct WorldWords {
  std::string first, second;
  double resolution_m = 0.1;
  sim3d::WorldOptions options;
  sim3d::GeneratorConfig generator;
  bool json = false;
};

void info(const WorldWords& words, std::ostream& out) {
  const sim3d::World world = sim3d::load_world(words.first, words.options);
  const sim3d::WorldInfo found = sim3d::world_info(world);
  const Eigen::Vector3d lo = found.bounds.min_m, hi = found.bounds.max_m;
  if (words.json) {
    const nlohmann::ordered_json values = {{"world", world.name},
                                           {"triangles", found.triangles},
                                           {"vertices", found.vertices},
                                           {"dropped_triangles", world.dropped_triangles},
                                           {"area_m2", found.area_m2},
                                           {"min_m", {lo.x(), lo.y(), lo.z()}},
                                           {"max_m", {hi.x(), hi.y(), hi.z()}}};
    out << values.dump(2) << "\n";
    return;
  }
  out << "world      " << world.name << "\ntriangles  " << found.triangles << " (" << world.dropped_triangles
      << " unusable left out)\nvertices   " << found.vertices << "\narea       " << found.area_m2 << " m2\nbounds     ["
      << lo.x() << " " << lo.y() << " " << lo.z() << "] to [" << hi.x() << " " << hi.y() << " " << hi.z() << "] m\n";
}

void convert(const WorldWords& words) {
  const sim3d::World world = sim3d::load_world(words.first, words.options);
  if (is_octomap_file(words.second)) {
    mapping::save_octomap(voxelised(world, words.resolution_m), words.second);
  } else {
    sim3d::save_mesh(world, words.second);
  }
}

void generate(const WorldWords& words, std::ostream& out) {
  const std::string text = sim3d::generate_building(words.generator);
  if (words.second.empty()) {
    out << text;
  } else {
    write_file_atomically(words.second, text);
  }
}

}  // namespace

void add_world_options(CLI::App& command, sim3d::WorldOptions& options) {
  command.add_option("--extrude-height", options.extrude_height_m, "Height of the walls of .pgm maps, metres");
  command.add_option("--point-size", options.point_size_m, "Edge of the voxel that a cloud's point fills");
  command.add_option("--close-gaps", options.close_gaps, "on|off: fill the voxels between two of a cloud's");
  command.add_option("--voxel-size", options.voxel_size_m, "Edge of a cell of a .3dmap");
}

void add_world_commands(CLI::App& app, CommandContext& context) {
  CLI::App* world = app.add_subcommand("world", "Look at, convert and make worlds");
  world->require_subcommand(1);
  world->footer("Example:\n  stairwell world generate --storeys 4 --seed 7 -o four.sdf");

  auto words = std::make_shared<WorldWords>();
  CLI::App* info_command = world->add_subcommand("info", "Size and bounds of a world");
  info_command->add_option("WORLD", words->first, "World file")->required();
  info_command->add_flag("--json", words->json, "For machines");
  add_world_options(*info_command, words->options);
  info_command->footer("Example:\n  stairwell world info worlds/duplex.sdf --json");
  info_command->callback([words, &context] { info(*words, context.out); });

  CLI::App* convert_command = world->add_subcommand("convert", "Write a world as a mesh or an OctoMap");
  convert_command->add_option("IN", words->first, "World file")->required();
  convert_command->add_option("OUT", words->second, ".stl .obj .ply (surface) or .bt .ot (voxels)")->required();
  convert_command->add_option("--resolution", words->resolution_m, "Edge of the voxels, metres");
  add_world_options(*convert_command, words->options);
  convert_command->footer("Example:\n  stairwell world convert worlds/duplex.sdf duplex.bt --resolution 0.1");
  convert_command->callback([words] { convert(*words); });

  CLI::App* generate_command = world->add_subcommand("generate", "Make a random building, always connected");
  generate_command->add_option("--storeys", words->generator.storeys, "Number of storeys")->capture_default_str();
  generate_command->add_option("--seed", words->generator.seed, "Seed")->capture_default_str();
  generate_command->add_option("--width", words->generator.width_m, "Metres along x")->capture_default_str();
  generate_command->add_option("--depth", words->generator.depth_m, "Metres along y")->capture_default_str();
  generate_command->add_option("--storey-height", words->generator.storey_height_m, "Metres")->capture_default_str();
  generate_command->add_option("-o,--output", words->second, "SDFormat file (default: standard output)");
  generate_command->footer("Example:\n  stairwell world generate --storeys 4 --seed 7 -o four.sdf");
  generate_command->callback([words, &context] { generate(*words, context.out); });
}

}  // namespace stairwell::apps
