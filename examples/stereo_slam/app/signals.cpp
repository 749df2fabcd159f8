// SPDX-License-Identifier: MIT
#include "stereo_slam/app/signals.hpp"

namespace stereo_slam {
namespace {

/// A signal handler can access only globals.
volatile std::sig_atomic_t stop_signal = 0;

/// Installs a handler and keeps the previous one, unless the signal is ignored, as SIGHUP is below nohup.
void handle(int signal, const struct sigaction& action, struct sigaction& previous) {
  sigaction(signal, nullptr, &previous);
  if (previous.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
}

}  // namespace

SignalGuard::SignalGuard() {
  stop_signal = 0;
  struct sigaction action = {};
  action.sa_handler = [](int signal) { stop_signal = signal; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  handle(SIGINT, action, previous_int_);
  handle(SIGTERM, action, previous_term_);
  handle(SIGHUP, action, previous_hang_up_);
}

SignalGuard::~SignalGuard() {
  sigaction(SIGINT, &previous_int_, nullptr);
  sigaction(SIGTERM, &previous_term_, nullptr);
  sigaction(SIGHUP, &previous_hang_up_, nullptr);
}

bool SignalGuard::stop_requested() { return stop_signal != 0; }

}  // namespace stereo_slam
