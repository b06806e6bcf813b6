#include "learning/train/training_checkpoint.hpp"

#include "learning/nn/sealed_bytes.hpp"

namespace stairwell::train {

namespace {
constexpr const char* kKind = "stairwell-training 2";
}

std::string checkpoint_bytes(const ImitationState& state, const std::string& settings) {
  nn::ByteWriter writer;
  writer.number(state.round);
  writer.number(state.steps);
  writer.list(std::span<const float>(state.parameters));
  writer.text(state.optimiser);
  return nn::seal(kKind, settings, writer.bytes());
}

ImitationState parse_checkpoint(std::string_view bytes, const std::string& settings) {
  nn::ByteReader reader(nn::unseal(bytes, kKind, settings));
  ImitationState state;
  state.round = reader.number<std::uint64_t>();
  state.steps = reader.number<std::uint64_t>();
  state.parameters = reader.list<float>();
  state.optimiser = reader.text();
  reader.finish();
  return state;
}

}  // namespace stairwell::train
