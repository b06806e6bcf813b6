#include "apps/training_module.hpp"

#include "core/errors.hpp"

#include <dlfcn.h>

#include <filesystem>

namespace stairwell::apps {

namespace {

std::filesystem::path module_file() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return (program.parent_path() / "../lib/stairwell/stairwell_training.so").lexically_normal();
}

}  // namespace

void run_training(const TrainingRequest& request, CommandContext& context) {
  const std::filesystem::path file = module_file();
  if (!std::filesystem::exists(file)) {
    throw InputError(
        file.string() +
        ": not there, because this program was built without LibTorch; install libtorch-dev and build again");
  }
  void* module = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);  // stays loaded
  if (module == nullptr) throw RunError(file.string() + ": cannot be loaded: " + ::dlerror());
  void* entry = ::dlsym(module, "stairwell_run_training");
  if (entry == nullptr) throw RunError(file.string() + ": not the training module of this program");
  reinterpret_cast<RunTraining>(entry)(request, context);
}

}  // namespace stairwell::apps
