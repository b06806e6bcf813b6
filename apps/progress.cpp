#include "apps/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace stairwell::apps {

namespace {
constexpr double kBarPeriod_s = 0.1;
constexpr double kLinesPeriod_s = 10.0;
constexpr int kBarWidth = 30;
}  // namespace

std::string progress_text(const ProgressState& state, int bar_width) {
  const double coverage = std::isfinite(state.coverage) ? std::clamp(state.coverage, 0.0, 1.0) : 0.0;
  std::string text;
  if (bar_width > 0) {
    const auto filled = static_cast<std::size_t>(coverage * bar_width);
    text = "[" + std::string(filled, '#') + std::string(static_cast<std::size_t>(bar_width) - filled, '-') + "] ";
  }
  char numbers[128];
  std::snprintf(numbers, sizeof(numbers), "%5.1f %%  sim %.1f s  wall %.1f s  x%.1f", 100.0 * coverage, state.time_s,
                state.wall_s, state.wall_s > 0.0 ? state.time_s / state.wall_s : 0.0);
  return text + numbers;
}

Progress::Style Progress::style_for(bool quiet) {
  if (quiet) return Style::kQuiet;
  return ::isatty(STDERR_FILENO) != 0 ? Style::kBar : Style::kLines;
}

void Progress::show(const ProgressState& state) {
  if (style_ == Style::kQuiet) return;
  const bool bar = style_ == Style::kBar;
  if (state.wall_s - last_shown_s_ < (bar ? kBarPeriod_s : kLinesPeriod_s)) return;
  last_shown_s_ = state.wall_s;
  std::fprintf(stderr, bar ? "\r%s\033[K" : "%s\n", progress_text(state, bar ? kBarWidth : 0).c_str());
  bar_open_ = bar;
}

void Progress::note(const std::string& line) {
  if (style_ == Style::kQuiet) return;
  finish();
  std::fprintf(stderr, "%s\n", line.c_str());
}

void Progress::finish() {
  if (bar_open_) std::fputc('\n', stderr);
  bar_open_ = false;
}

}  // namespace stairwell::apps
