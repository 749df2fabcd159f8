// SPDX-License-Identifier: MIT
#pragma once

namespace stereo_slam {

/// Lowers the priority of the calling thread, for work that is not urgent: reading frames ahead, closing
/// loops. Does nothing on systems other than Linux.
void lower_thread_priority();

}  // namespace stereo_slam
