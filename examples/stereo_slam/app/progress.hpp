// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace stereo_slam {

/// State of a job over frames.
struct JobState {
  std::size_t done = 0;                ///< frames
  std::optional<std::size_t> total{};  ///< nothing for a job without end
  double seconds = 0.0;                ///< since its beginning
};

/// "frame 200/1000  25.0 fps  0:32 left  DETAIL". The time left is estimated from the rate so far; it is left
/// out during the first second, and for a job without end.
[[nodiscard]] std::string progress_text(const JobState& job, std::string_view detail);

/// Prints the progress of a job over frames to standard output: one changing line on a terminal, occasional
/// lines elsewhere, nothing when quiet.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Reports `done` finished frames of `total` (nothing: a job without end). `detail` ends the line.
  void update(std::size_t done, std::optional<std::size_t> total, std::string_view detail);

 private:
  [[nodiscard]] bool is_due(std::size_t done, double now_s) const;

  bool quiet_;
  bool terminal_;
  bool line_open_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double last_print_s_ = 0.0;
};

}  // namespace stereo_slam
