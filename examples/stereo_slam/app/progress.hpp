// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <string_view>

namespace stereo_slam {

/// Prints the progress of a job over frames to standard output: one changing line on a terminal, occasional
/// lines elsewhere, nothing when quiet.
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
