/// Weight files: a text header, then the parameters.
#pragma once

#include "learning/nn/network.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::nn {

/// What a model is and where it comes from.
struct Model {
  std::string agent;  ///< which agent it is for, as `path3d`
  std::string input;  ///< what it must be shown, in that agent's words
  NetworkSpec network;
  std::string command;  ///< that trained it
  std::string commit;   ///< of the program that did
  std::uint64_t seed = 0;
  std::uint64_t steps = 0;  ///< gradient steps
  std::vector<float> parameters;
};

/// File: the line `stairwell-model 1`, lines `key: value` (agent, input, network, command, commit, seed, steps,
/// payload_bytes, payload_fnv1a64 in hexadecimal), the line `end`, then the parameters as little-endian float32.
/// @returns the file's bytes. @throws InputError for an unusable model.
std::string model_bytes(const Model& model);

/// @throws InputError naming the file and what is wrong: missing, foreign, of another version, truncated, damaged, or
/// parameters that do not fit the network. With `agent` not empty, also a model for another agent.
Model read_model(const std::filesystem::path& file, std::string_view agent = {});

/// FNV-1a, 64 bits (Fowler, Noll, Vo).
std::uint64_t fnv1a64(std::string_view bytes);

}  // namespace stairwell::nn
