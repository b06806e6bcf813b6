/// The file from which training goes on.
#pragma once

#include "learning/train/imitation.hpp"

#include <string>
#include <string_view>

namespace stairwell::train {

/// @param settings  one line that says what is trained and how
std::string checkpoint_bytes(const ImitationState& state, const std::string& settings);

/// @throws InputError when the bytes are no checkpoint, damaged, truncated, or of a training with other settings
ImitationState parse_checkpoint(std::string_view bytes, const std::string& settings);

}  // namespace stairwell::train
