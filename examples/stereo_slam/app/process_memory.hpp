// SPDX-License-Identifier: MIT
#pragma once

/// Physical memory of this process, in MB (1e6 bytes); NaN where the system does not tell.
namespace stereo_slam {

/// In use now.
[[nodiscard]] double resident_memory_mb();

/// The most that was ever in use.
[[nodiscard]] double peak_resident_memory_mb();

}  // namespace stereo_slam
