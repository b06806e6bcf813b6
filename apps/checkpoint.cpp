#include "apps/checkpoint.hpp"

#include "apps/atomic_file.hpp"
#include "core/errors.hpp"
#include "mapping/octomap_io.hpp"
#include "mapping/octree_stream.hpp"

#include <octomap/OcTree.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <vector>

namespace stairwell::apps {

using nlohmann::json;

namespace {

constexpr int kVersion = 2;

std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) throw InputError(file.string() + ": the checkpoint cannot be read");
  return std::move(text).str();
}

constexpr std::uint64_t kDigestOfNothing = 0xCBF29CE484222325ULL;

/// FNV-1a: finds damage, not forgery.
/// @param hash the digest of what comes before the bytes
std::uint64_t digest(std::string_view bytes, std::uint64_t hash = kDigestOfNothing) {
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3ULL;
  return hash;
}

/// Piece by piece: maps are large.
std::uint64_t digest_of_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::vector<char> piece(std::size_t{1} << 16);
  std::uint64_t hash = kDigestOfNothing;
  while (stream) {
    stream.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    hash = digest({piece.data(), static_cast<std::size_t>(stream.gcount())}, hash);
  }
  if (!stream.eof()) throw InputError(file.string() + ": the checkpoint cannot be read");
  return hash;
}

/// The number in `map-<n>-<i>.ot`; 0 for anything else.
std::uint64_t generation_of(const std::string& map_name) {
  std::uint64_t generation = 0;
  std::istringstream(map_name.substr(std::min<std::size_t>(4, map_name.size()))) >> generation;
  return generation;
}

[[noreturn]] void damaged(const std::filesystem::path& file, const std::string& why) {
  throw InputError(file.string() + ": the checkpoint is damaged (" + why +
                   "): remove the checkpoint folder to start the run again");
}

/// The file does not hold the sensor model's parameters: they are the configuration's.
mapping::OccupancyMap read_map(const std::filesystem::path& file, const mapping::OccupancyMap& blank) {
  mapping::OccupancyMap map = blank.clone();
  mapping::read_octomap(read_file(file), file.string(), map);
  return map;
}

}  // namespace

bool CheckpointFolder::exists() const {
  std::error_code ignored;
  return std::filesystem::exists(state_file(), ignored);
}

void CheckpointFolder::save(const Checkpoint& checkpoint, const std::vector<const mapping::OccupancyMap*>& maps) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw RunError(folder_.string() + ": cannot be made: " + error.message());
  std::uint64_t generation = 1;
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    generation = std::max(generation, generation_of(entry.path().filename().string()) + 1);
  }
  std::vector<std::string> names;
  std::vector<std::uint64_t> digests;
  for (const mapping::OccupancyMap* map : maps) {
    names.push_back("map-" + std::to_string(generation) + "-" + std::to_string(names.size()) + ".ot");
    mapping::save_octomap(*map, folder_ / names.back());
    digests.push_back(digest_of_file(folder_ / names.back()));
  }
  const json state = {{"version", kVersion},
                      {"maps", names},
                      {"map_digests", digests},
                      {"fleet", checkpoint.fleet},
                      {"fleet_digest", digest(checkpoint.fleet)},
                      {"flight", checkpoint.flight},
                      {"milestones", checkpoint.milestones},
                      {"finish", checkpoint.finish},
                      {"wall_s", checkpoint.wall_s},
                      {"scans_taken", checkpoint.scans_taken},
                      {"log_bytes", checkpoint.log_bytes}};
  write_file_atomically(state_file(), state.dump());
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    const std::string name = entry.path().filename().string();
    if (std::ranges::find(names, name) == names.end() && name != "state.json")
      std::filesystem::remove(entry.path(), error);
  }
}

Checkpoint CheckpointFolder::load(const mapping::OccupancyMap& blank, std::vector<mapping::OccupancyMap>& maps) const {
  Checkpoint checkpoint;
  std::vector<std::filesystem::path> files;
  try {
    const json state = json::parse(read_file(state_file()));
    if (state.at("version").get<int>() != kVersion) damaged(state_file(), "another version");
    checkpoint.fleet = state.at("fleet").get<std::string>();
    checkpoint.flight = state.at("flight").get<std::string>();
    checkpoint.milestones = state.at("milestones").get<std::string>();
    checkpoint.finish = state.at("finish").get<std::string>();
    checkpoint.wall_s = state.at("wall_s").get<double>();
    checkpoint.scans_taken = state.at("scans_taken").get<std::vector<std::uint64_t>>();
    checkpoint.log_bytes = state.at("log_bytes").get<RunLog::Offsets>();
    if (digest(checkpoint.fleet) != state.at("fleet_digest").get<std::uint64_t>()) damaged(state_file(), "digest");
    for (std::size_t i = 0; i < state.at("maps").size(); ++i) {
      files.push_back(folder_ / std::filesystem::path(state.at("maps").at(i).get<std::string>()).filename());
      std::error_code ignored;
      if (!std::filesystem::exists(files.back(), ignored)) damaged(files.back(), "missing");
      if (digest_of_file(files.back()) != state.at("map_digests").at(i).get<std::uint64_t>()) {
        damaged(files.back(), "digest");
      }
    }
  } catch (const json::exception& error) {
    damaged(state_file(), error.what());
  }
  for (const std::filesystem::path& file : files) maps.push_back(read_map(file, blank));
  return checkpoint;
}

void CheckpointFolder::remove() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace stairwell::apps
