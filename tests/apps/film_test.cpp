#include "apps/film.hpp"
#include "core/errors.hpp"
#include "mapping/octomap_io.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <filesystem>

namespace stairwell::apps {

using Catch::Contains;
using testing::fresh_folder;
using testing::read_text;
using testing::write_text;

namespace fs = std::filesystem;

namespace {

/// A run of two UAVs over a floor, too short for the time and coverage in the frames to change.
fs::path make_run(const std::string& name) {
  const fs::path folder = fresh_folder(name);
  mapping::OccupancyMap map(GridSpec(Aabb{{0, 0, 0}, {4, 3, 2}}, 0.1));
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i)
    map.update(map.grid().voxel(i), map.grid().voxel(i).z == 0);
  mapping::save_octomap(map, folder / "map.bt");
  std::string steps = "time_s,coverage\n", tracks = "time_s,uav,x_m,y_m,z_m,yaw_rad,speed_mps\n";
  for (int k = 0; k <= 20; ++k) {
    const std::string time = std::to_string(0.002 * k), along = std::to_string(0.5 + 0.1 * k);
    steps += time + ",0.5\n";
    tracks += time + ",0," + along + ",1,1,0,1\n" + time + ",1,1," + along + ",1,0,1\n";
  }
  write_text(folder / "steps.csv", steps);
  write_text(folder / "trajectories.csv", tracks);
  return folder;
}

FilmOptions small_film(const std::string& encoder) {
  FilmOptions options;
  options.width = 320;
  options.height = 240;
  options.frames = 4;
  options.encoder = encoder;
  return options;
}

std::string make_encoder(const fs::path& folder, const std::string& script) {
  const fs::path file = write_text(folder / "encoder.sh", "#!/bin/sh\n" + script);
  fs::permissions(file, fs::perms::owner_all);
  return file.string();
}

std::size_t files_in(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

}  // namespace

TEST_CASE("without an encoder the frames stay, each with more of the paths") {
  const fs::path run = make_run("film_frames");
  const Film film = make_film(run, run / "a.mp4", small_film("no-such-encoder"));
  CHECK(film.file.empty());
  CHECK(film.frames == 4);
  CHECK(film.frames_dir == run / "a.mp4.frames");
  CHECK_FALSE(fs::exists(run / "a.mp4"));
  REQUIRE(files_in(film.frames_dir) == 4);
  for (int k = 1; k < 4; ++k) {
    const auto frame = [&](int number) {
      return read_text(film.frames_dir / ("frame_0000" + std::to_string(number) + ".png"));
    };
    CHECK(frame(k).starts_with("\x89PNG"));
    CHECK(frame(k) != frame(k + 1));
  }
}

TEST_CASE("the encoder gets the frames in order, whatever the names of folder and film") {
  const fs::path run = make_run("film %05d; rm -rf $HOME `x` 'y'");
  const std::string encoder = make_encoder(run, "for last; do :; done\necho frame_*.png > \"$last\"\n");
  const Film film = make_film(run, run / "-o %d \"$(x)\".gif", small_film(encoder));
  CHECK(film.file == run / "-o %d \"$(x)\".gif");
  CHECK(read_text(film.file) == "frame_00001.png frame_00002.png frame_00003.png frame_00004.png\n");
  CHECK(film.frames_dir.empty());
  CHECK_FALSE(fs::exists(film.file.string() + ".frames"));
}

TEST_CASE("ffmpeg makes films, if it is there") {
  const fs::path run = make_run("film_real");
  for (const char* name : {"a.mp4", "a.gif"}) {
    const Film film = make_film(run, run / name, small_film("ffmpeg"));
    if (film.file.empty()) return;
    const std::string bytes = read_text(film.file);
    CHECK((bytes.starts_with("GIF89a") || bytes.substr(4, 4) == "ftyp"));
  }
}

TEST_CASE("an encoder that fails is quoted, and the frames stay") {
  const fs::path run = make_run("film_fails");
  const std::string encoder = make_encoder(run, "echo 'no such codec' >&2\nexit 3\n");
  CHECK_THROWS_WITH(make_film(run, run / "a.mp4", small_film(encoder)),
                    Contains("no such codec") && Contains("a.mp4.frames"));
  CHECK(fs::exists(run / "a.mp4.frames/frame_00004.png"));
  CHECK_FALSE(fs::exists(run / "a.mp4"));
}

TEST_CASE("what a film cannot be made of is named") {
  const auto refused = [](const fs::path& run, const fs::path& file, const FilmOptions& options,
                          const std::string& text) {
    CAPTURE(text);
    CHECK_THROWS_AS(make_film(run, file, options), InputError);
    CHECK_THROWS_WITH(make_film(run, file, options), Contains(text));
    CHECK_FALSE(fs::exists(file.string() + ".frames"));
  };
  const fs::path run = make_run("film_bad");
  const FilmOptions good = small_film("no-such-encoder");
  refused(run, run / "a.avi", good, "a.avi: a film is .mp4 or .gif");
  FilmOptions bad = good;
  bad.width = 321;
  refused(run, run / "a.mp4", bad, "even");
  bad = good;
  bad.frames = 0;
  refused(run, run / "a.mp4", bad, "frames");
  bad = good;
  bad.view = "side";
  refused(run, run / "a.mp4", bad, "side");
  write_text(run / "trajectories.csv", "time_s,uav,x_m,y_m,z_m\n1,0,1,1,1\n0.5,0,1,1,1\n");
  refused(run, run / "a.mp4", good, "trajectories.csv:3");
  write_text(run / "trajectories.csv", "time_s,uav,x_m,y_m,z_m\n1,99999999999,1,1,1\n");
  refused(run, run / "a.mp4", good, "trajectories.csv:2");
  write_text(run / "trajectories.csv", "time_s,uav,x_m,y_m,z_m\n");
  refused(run, run / "a.mp4", good, "no flight");
  for (const char* part : {"map.bt", "steps.csv", "trajectories.csv"}) {
    const fs::path cut = make_run("film_cut");
    fs::remove(cut / part);
    refused(cut, cut / "a.mp4", good, part);
  }
  refused(run / "none", run / "a.mp4", good, "none");
}

}  // namespace stairwell::apps
