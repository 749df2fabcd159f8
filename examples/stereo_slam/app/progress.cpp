// SPDX-License-Identifier: MIT
#include "stereo_slam/app/progress.hpp"

#include <algorithm>
#include <cstdio>
#include <unistd.h>

#include <fmt/format.h>

namespace stereo_slam {

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(isatty(STDOUT_FILENO) != 0) {}

Progress::~Progress() {
  if (line_open_) std::fputc('\n', stdout);
}

bool Progress::is_due(std::size_t done, double now_s) const {
  constexpr double kTerminalPeriod_s = 0.1;
  constexpr double kLogPeriod_s = 10.0;
  constexpr std::size_t kLogFrames = 50;
  if (terminal_) return now_s - last_print_s_ > kTerminalPeriod_s;
  return done % kLogFrames == 0 || now_s - last_print_s_ > kLogPeriod_s;
}

void Progress::update(std::size_t done, std::size_t total, std::string_view detail) {
  const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (quiet_ || !(done == 1 || done == total || is_due(done, now_s))) return;
  last_print_s_ = now_s;
  const auto text = fmt::format("frame {}/{}  {:.1f} fps  {}", done, total,
                                static_cast<double>(done) / std::max(now_s, 1e-9), detail);
  if (terminal_) {  // a failure to print does not end the job
    std::fputs(fmt::format("\r{:<72}", text).c_str(), stdout);
    line_open_ = true;
  } else {
    std::fputs((text + "\n").c_str(), stdout);
  }
  std::fflush(stdout);
}

}  // namespace stereo_slam
