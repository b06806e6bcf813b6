#include "learning/train/training_checkpoint.hpp"

#include "core/errors.hpp"

#include <cstring>
#include <sstream>

namespace stairwell::train {

namespace {
constexpr const char* kFirstLine = "stairwell-training 1";
}

std::string checkpoint_bytes(const ImitationState& state, const std::string& settings) {
  std::string payload(state.parameters.size() * sizeof(float), '\0');
  std::memcpy(payload.data(), state.parameters.data(), payload.size());
  payload += state.optimiser;
  std::ostringstream out;
  out << kFirstLine << "\n"
      << settings << "\n"
      << state.round << ' ' << state.steps << ' ' << state.parameters.size() << ' ' << state.optimiser.size() << ' '
      << nn::fnv1a64(payload) << "\n";
  return out.str() + payload;
}

ImitationState parse_checkpoint(std::string_view bytes, const std::string& settings) {
  std::istringstream in{std::string(bytes)};
  std::string first, mine, numbers;
  if (!std::getline(in, first) || first != kFirstLine) throw InputError("no checkpoint of a training");
  if (!std::getline(in, mine) || !std::getline(in, numbers)) throw InputError("truncated");
  if (mine != settings) throw InputError("of another training: '" + mine + "' where '" + settings + "' is to go on");
  ImitationState state;
  std::size_t parameters = 0, optimiser = 0;
  std::uint64_t hash = 0;
  std::istringstream words(numbers);
  if (!(words >> state.round >> state.steps >> parameters >> optimiser >> hash)) throw InputError("damaged");
  const std::string_view payload = bytes.substr(first.size() + mine.size() + numbers.size() + 3);
  if (payload.size() / sizeof(float) < parameters || payload.size() != parameters * sizeof(float) + optimiser) {
    throw InputError("truncated");
  }
  if (nn::fnv1a64(payload) != hash) throw InputError("damaged");
  state.parameters.resize(parameters);
  std::memcpy(state.parameters.data(), payload.data(), parameters * sizeof(float));
  state.optimiser = std::string(payload.substr(parameters * sizeof(float)));
  return state;
}

}  // namespace stairwell::train
