/// Films of finished runs: frames drawn on the CPU, joined by ffmpeg where it is installed.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace stairwell::apps {

struct FilmOptions {
  std::string view = "iso";  ///< as parse_view takes it
  int width = 960;           ///< pixels, even
  int height = 540;
  std::size_t frames = 300;  ///< spread evenly over the run
  int frames_per_s = 15;
  std::string encoder = "ffmpeg";  ///< program, looked for on the PATH
};

struct Film {
  std::filesystem::path file;        ///< the film; empty when there is no encoder
  std::filesystem::path frames_dir;  ///< frame_00001.png and so on; empty once they have become the film
  std::size_t frames = 0;
};

/// Draws the run's map with the UAVs and their paths as they grow, and the time and coverage of each frame.
/// Without the encoder the frames stay in a folder beside the film, `<file>.frames`.
/// @param file .mp4 or .gif
/// @throws InputError naming what is missing or damaged in the run folder, or unusable in the options;
///   RunError when a frame cannot be written or the encoder fails (the frames stay).
Film make_film(const std::filesystem::path& run_dir, const std::filesystem::path& file,
               const FilmOptions& options = {});

}  // namespace stairwell::apps
