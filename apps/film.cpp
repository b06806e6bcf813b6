#include "apps/film.hpp"

#include "apps/csv_table.hpp"
#include "apps/png_writer.hpp"
#include "apps/render.hpp"
#include "core/errors.hpp"
#include "mapping/octomap_io.hpp"

#include <fcntl.h>
#include <octomap/OcTree.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <vector>

extern char** environ;

namespace stairwell::apps {

namespace fs = std::filesystem;

namespace {

constexpr const char* kEncoderLog = "encoder.log";

/// Where every UAV has been, and how much was known, over time.
struct Flight {
  std::vector<std::vector<double>> time_s;  ///< per UAV, ascending
  std::vector<std::vector<Eigen::Vector3d>> track_m;
  std::vector<double> step_s, coverage;
  double end_s = 0.0;

  std::vector<std::vector<Eigen::Vector3d>> until(double now_s) const {
    std::vector<std::vector<Eigen::Vector3d>> parts;
    for (std::size_t i = 0; i < track_m.size(); ++i) {
      const auto past = std::ranges::upper_bound(time_s[i], now_s) - time_s[i].begin();
      parts.emplace_back(track_m[i].begin(), track_m[i].begin() + past);
    }
    return parts;
  }

  std::string caption(double now_s) const {
    const auto past = std::ranges::upper_bound(step_s, now_s) - step_s.begin();
    const double known = past == 0 ? 0.0 : coverage[static_cast<std::size_t>(past - 1)];
    char text[64];
    std::snprintf(text, sizeof text, "%6.1f s   %5.1f %% covered", now_s, 100.0 * known);
    return text;
  }
};

Flight read_flight(const fs::path& run_dir) {
  const fs::path file = run_dir / "trajectories.csv";
  const CsvTable table = CsvTable::read(file);
  const auto time_s = table.numbers("time_s"), uav = table.numbers("uav"), x = table.numbers("x_m"),
             y = table.numbers("y_m"), z = table.numbers("z_m");
  Flight flight;
  for (std::size_t k = 0; k < time_s.size(); ++k) {
    if (!(uav[k] >= 0.0 && uav[k] < 64.0) || !std::isfinite(time_s[k]) || time_s[k] < flight.end_s)
      throw InputError(file.string() + ":" + std::to_string(k + 2) + ": is not a UAV's place, in the order of time");
    const auto i = static_cast<std::size_t>(uav[k]);
    if (i >= flight.track_m.size()) flight.track_m.resize(i + 1), flight.time_s.resize(i + 1);
    flight.time_s[i].push_back(time_s[k]);
    flight.track_m[i].emplace_back(x[k], y[k], z[k]);
    flight.end_s = time_s[k];
  }
  if (flight.track_m.empty()) throw InputError(file.string() + ": holds no flight");
  const CsvTable steps = CsvTable::read(run_dir / "steps.csv");
  flight.step_s = steps.numbers("time_s");
  flight.coverage = steps.numbers("coverage");
  return flight;
}

MapPicture read_map(const fs::path& run_dir, const FilmOptions& options) {
  if (!fs::is_directory(run_dir)) throw InputError(run_dir.string() + ": no such run folder");
  if (!fs::exists(run_dir / "map.bt"))
    throw InputError((run_dir / "map.bt").string() +
                     ": is missing; an unfinished run goes on with `stairwell explore --resume`");
  RenderOptions render;
  parse_view(options.view, render);
  render.width = options.width;
  render.height = options.height;
  const auto tree = mapping::load_octree(run_dir / "map.bt");
  return {mapping::map_from_octree(*tree), render};
}

fs::path frame_name(std::size_t number) {
  char text[32];
  std::snprintf(text, sizeof text, "frame_%05zu.png", number);
  return text;
}

/// Not flushed to the disk as files that stay are: there are many, and they are soon gone.
void write_frame(const Image& image, const fs::path& file) {
  const std::string bytes = encode_png(image);
  std::ofstream stream(file, std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) throw RunError(file.string() + ": cannot be written");
}

/// Words of the encoder's command line; it runs in the folder of the frames, so that no name of the user's is among
/// them.
std::vector<std::string> encoder_words(const FilmOptions& options, const std::string& output) {
  std::vector<std::string> words{options.encoder,
                                 "-hide_banner",
                                 "-loglevel",
                                 "error",
                                 "-nostdin",
                                 "-y",
                                 "-framerate",
                                 std::to_string(options.frames_per_s),
                                 "-i",
                                 "frame_%05d.png"};
  const std::vector<std::string> gif{"-filter_complex",
                                     "split[a][b];[a]palettegen=max_colors=160[p];[b][p]paletteuse=dither=none"};
  const std::vector<std::string> mp4{"-c:v", "libx264", "-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart"};
  const auto& more = output.ends_with(".gif") ? gif : mp4;
  words.insert(words.end(), more.begin(), more.end());
  words.push_back(output);
  return words;
}

/// @returns false when there is no such program. @throws RunError when it fails.
bool run_in(const fs::path& folder, std::vector<std::string> words) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, kEncoderLog, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  pid_t child = 0;
  const int error = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error == ENOENT) return false;
  if (error != 0) throw RunError(words[0] + ": cannot be started: " + std::strerror(error));
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return true;
  std::ifstream log(folder / kEncoderLog);
  std::string why;
  std::getline(log, why);
  throw RunError(words[0] + " failed (" + (why.empty() ? "it says nothing" : why) + "); the frames are in " +
                 folder.string());
}

void require_usable(const fs::path& file, const FilmOptions& options) {
  if (file.extension() != ".mp4" && file.extension() != ".gif")
    throw InputError(file.string() + ": a film is .mp4 or .gif");
  if (options.width % 2 != 0 || options.height % 2 != 0) throw InputError("a film's width and height must be even");
  if (options.frames < 1 || options.frames > 99999 || options.frames_per_s < 1)
    throw InputError("a film has 1 to 99999 frames, at least one a second");
}

}  // namespace

Film make_film(const fs::path& run_dir, const fs::path& file, const FilmOptions& options) {
  require_usable(file, options);
  const Flight flight = read_flight(run_dir);
  const MapPicture map = read_map(run_dir, options);
  Film film;
  film.frames_dir = file.string() + ".frames";
  std::error_code error;
  fs::remove_all(film.frames_dir, error);
  fs::create_directories(film.frames_dir, error);
  if (error) throw RunError(film.frames_dir.string() + ": cannot be made: " + error.message());
  for (; film.frames < options.frames; ++film.frames) {
    const double part =
        options.frames == 1 ? 1.0 : static_cast<double>(film.frames) / static_cast<double>(options.frames - 1);
    const double now_s = part * flight.end_s;
    write_frame(map.with(flight.until(now_s), flight.caption(now_s)), film.frames_dir / frame_name(film.frames + 1));
  }
  const std::string output = "film" + file.extension().string();
  if (!run_in(film.frames_dir, encoder_words(options, output))) {
    fs::remove(film.frames_dir / kEncoderLog, error);
    return film;
  }
  fs::rename(film.frames_dir / output, file, error);
  if (error) throw RunError(file.string() + ": cannot be written: " + error.message());
  fs::remove_all(film.frames_dir, error);
  film.frames_dir.clear();
  film.file = file;
  return film;
}

}  // namespace stairwell::apps
