// SPDX-License-Identifier: MIT
#include <thread>

#include "stereo_slam/core/parallel.hpp"

#ifdef __linux__
#include <sys/resource.h>
#endif

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

#ifdef __linux__
TEST_CASE("A thread lowers its own priority and no other", "[stereo_slam][threads]") {
  constexpr int kThisThread = 0;
  const int before = getpriority(PRIO_PROCESS, kThisThread);
  int lowered = before;
  std::thread([&] {
    lower_thread_priority();
    lowered = getpriority(PRIO_PROCESS, kThisThread);
  }).join();
  CHECK(lowered >= before);
  CHECK(lowered >= 10);
  CHECK(getpriority(PRIO_PROCESS, kThisThread) == before);
}
#endif

}  // namespace
}  // namespace stereo_slam
