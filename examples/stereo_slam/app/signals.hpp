// SPDX-License-Identifier: MIT
#pragma once

#include <csignal>

namespace stereo_slam {

/// While it lives, the first SIGINT or SIGTERM is a polite request to stop; a second one ends the program at
/// once.
class SignalGuard {
 public:
  SignalGuard();
  ~SignalGuard();
  SignalGuard(const SignalGuard&) = delete;
  SignalGuard& operator=(const SignalGuard&) = delete;

  /// Whether a signal came since the last guard was made.
  [[nodiscard]] static bool stop_requested();

 private:
  struct sigaction previous_int_ = {};
  struct sigaction previous_term_ = {};
  struct sigaction previous_hang_up_ = {};
  struct sigaction previous_pipe_ = {};
};

}  // namespace stereo_slam
