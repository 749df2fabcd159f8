// SPDX-License-Identifier: MIT
#include "stereo_slam/app/progress.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unistd.h>

#include <fmt/format.h>

namespace stereo_slam {
namespace {

/// "1:05:09", "2:30": hours, minutes and seconds.
[[nodiscard]] std::string clock_text(double seconds) {
  constexpr double kMost_s = 1e7;
  const auto whole = static_cast<long>(std::ceil(std::clamp(seconds, 0.0, kMost_s)));
  return whole < 3600 ? fmt::format("{}:{:02}", whole / 60, whole % 60)
                      : fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

}  // namespace

std::string progress_text(const JobState& job, std::string_view detail) {
  constexpr double kKnownAfter_s = 1.0;
  const double rate_hz = static_cast<double>(job.done) / std::max(job.seconds, 1e-9);
  if (!job.total) return fmt::format("frame {}  {:.1f} fps  {}", job.done, rate_hz, detail);
  const bool known = job.done > 0 && job.done < *job.total && job.seconds > kKnownAfter_s;
  const double left_s = known ? static_cast<double>(*job.total - job.done) / rate_hz : 0.0;
  return fmt::format("frame {}/{}  {:.1f} fps  {}{}", job.done, *job.total, rate_hz,
                     known ? clock_text(left_s) + " left  " : "", detail);
}

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

void Progress::update(std::size_t done, std::optional<std::size_t> total, std::string_view detail) {
  const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (quiet_ || !(done == 1 || done == total || is_due(done, now_s))) return;
  last_print_s_ = now_s;
  const std::string text = progress_text({done, total, now_s}, detail);
  if (terminal_) {  // a failure to print does not end the job
    std::fputs(fmt::format("\r{:<72}", text).c_str(), stdout);
    line_open_ = true;
  } else {
    std::fputs((text + "\n").c_str(), stdout);
  }
  std::fflush(stdout);
}

}  // namespace stereo_slam
