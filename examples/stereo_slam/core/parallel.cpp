// SPDX-License-Identifier: MIT
#include "stereo_slam/core/parallel.hpp"

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace stereo_slam {

void lower_thread_priority() {
#ifdef __linux__
  constexpr int kNice = 10;
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
#endif
}

}  // namespace stereo_slam
