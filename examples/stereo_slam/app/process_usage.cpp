// SPDX-License-Identifier: MIT
#include "stereo_slam/app/process_usage.hpp"

#include <cstddef>
#include <ctime>
#include <fstream>
#include <limits>
#include <string>
#include <unistd.h>

namespace stereo_slam {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

double milliseconds_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

}  // namespace

double resident_memory_mb() {
  std::ifstream statm("/proc/self/statm");  // Linux: number of all pages, and of the resident ones
  std::size_t total = 0;
  std::size_t resident = 0;
  if (!(statm >> total >> resident)) return kUnknown;
  return 1e-6 * static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

double peak_resident_memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    double kibibytes = 0.0;
    if (key == "VmHWM:" && status >> kibibytes) return 1e-6 * 1024.0 * kibibytes;
  }
  return kUnknown;
}

double process_cpu_ms() { return milliseconds_of(CLOCK_PROCESS_CPUTIME_ID); }

double thread_cpu_ms() { return milliseconds_of(CLOCK_THREAD_CPUTIME_ID); }

}  // namespace stereo_slam
