/// Training is a module of its own that is loaded when it is asked for: LibTorch alone takes a third of a second.
#pragma once

#include "apps/commands.hpp"
#include "apps/training_request.hpp"

namespace stairwell::apps {

/// The module's one entry, `stairwell_run_training`.
using RunTraining = void (*)(const TrainingRequest&, CommandContext&);

/// Loads `../lib/stairwell/stairwell_training.so` (beside the program) and trains.
/// @throws InputError where the module is not there, or for what the training refuses; RunError
void run_training(const TrainingRequest& request, CommandContext& context);

}  // namespace stairwell::apps
