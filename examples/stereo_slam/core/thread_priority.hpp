// SPDX-License-Identifier: MIT
#pragma once

namespace stereo_slam {

/// Gives the calling thread a lower priority than the others of the program have, for work that has time:
/// frames that are read ahead, loops that take effect later. Has an effect on Linux, where threads have
/// priorities of their own.
void lower_thread_priority();

}  // namespace stereo_slam
