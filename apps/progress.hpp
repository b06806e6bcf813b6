#pragma once

#include <string>

namespace stairwell::apps {

struct ProgressState {
  double coverage = 0.0;
  double time_s = 0.0;  ///< simulated
  double wall_s = 0.0;
};

/// Shows how a run goes on standard error: a bar that is redrawn on a terminal, else a line now and then.
class Progress {
 public:
  enum class Style { kQuiet, kLines, kBar };
  explicit Progress(Style style) : style_(style) {}
  /// kBar on a terminal, kLines elsewhere, kQuiet when asked for.
  static Style style_for(bool quiet);

  void show(const ProgressState& state);
  void note(const std::string& line);
  void finish();

 private:
  Style style_;
  double last_shown_s_ = -1e9;
  bool bar_open_ = false;
};

/// `[#####-----]  52.3 %  sim 61.0 s  wall 8.1 s  x7.5`
std::string progress_text(const ProgressState& state, int bar_width);

}  // namespace stairwell::apps
