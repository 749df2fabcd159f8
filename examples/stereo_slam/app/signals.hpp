// SPDX-License-Identifier: MIT
#pragma once

#include <csignal>

namespace stereo_slam {

/// While it exists, the first SIGINT, SIGTERM or SIGHUP is a request to stop; a second one ends the program
/// at once.
class SignalGuard {
 public:
  SignalGuard();
  ~SignalGuard();
  SignalGuard(const SignalGuard&) = delete;
  SignalGuard& operator=(const SignalGuard&) = delete;

  /// Whether a signal came since the last guard was created.
  [[nodiscard]] static bool stop_requested();

 private:
  struct sigaction previous_int_ = {};
  struct sigaction previous_term_ = {};
  struct sigaction previous_hang_up_ = {};
};

}  // namespace stereo_slam
