// SPDX-License-Identifier: MIT
#include "stereo_slam/app/signals.hpp"

namespace stereo_slam {
namespace {

/// A signal handler can access only globals.
volatile std::sig_atomic_t stop_signal = 0;

}  // namespace

SignalGuard::SignalGuard() {
  stop_signal = 0;
  struct sigaction action = {};
  action.sa_handler = [](int signal) { stop_signal = signal; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, &previous_int_);
  sigaction(SIGTERM, &action, &previous_term_);
  sigaction(SIGHUP, &action, &previous_hang_up_);
}

SignalGuard::~SignalGuard() {
  sigaction(SIGINT, &previous_int_, nullptr);
  sigaction(SIGTERM, &previous_term_, nullptr);
  sigaction(SIGHUP, &previous_hang_up_, nullptr);
}

bool SignalGuard::stop_requested() { return stop_signal != 0; }

}  // namespace stereo_slam
