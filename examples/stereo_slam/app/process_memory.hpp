// SPDX-License-Identifier: MIT
#pragma once

/// Physical memory of this process, in MB (1e6 bytes); NaN where it is unknown.
namespace stereo_slam {

/// In use now.
[[nodiscard]] double resident_memory_mb();

/// Peak since the start.
[[nodiscard]] double peak_resident_memory_mb();

}  // namespace stereo_slam
