// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <string_view>

namespace stereo_slam {

/// Tells the standard output how far a job over frames is: one line that keeps changing on a terminal, a line
/// now and then elsewhere, nothing at all when quiet.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` frames of `total` are finished; `detail` ends the line.
  void update(std::size_t done, std::size_t total, std::string_view detail);

 private:
  [[nodiscard]] bool is_due(std::size_t done, double now_s) const;

  bool quiet_;
  bool terminal_;
  bool line_open_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double last_print_s_ = 0.0;
};

}  // namespace stereo_slam
