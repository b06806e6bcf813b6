#include "apps/models_dir.hpp"

namespace stairwell::apps {

std::filesystem::path models_dir() {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  const fs::path installed = folder / "../share/stairwell/models";
  if (!error && fs::is_directory(installed, error)) return installed.lexically_normal();
  for (int up = 0; up < 5 && folder.has_relative_path(); ++up, folder = folder.parent_path()) {
    if (fs::is_directory(folder / "models", error)) return folder / "models";
  }
  return STAIRWELL_INSTALLED_MODELS;
}

}  // namespace stairwell::apps
