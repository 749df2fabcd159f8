// SPDX-License-Identifier: MIT
#pragma once

/// What this process uses of the machine. Memory is physical, in MB (1e6 bytes), NaN where it is unknown; CPU
/// time is in milliseconds.
namespace stereo_slam {

/// Memory in use now.
[[nodiscard]] double resident_memory_mb();

/// Peak of the memory since the start.
[[nodiscard]] double peak_resident_memory_mb();

/// CPU time of all threads since the start.
[[nodiscard]] double process_cpu_ms();

/// CPU time of the calling thread since its start.
[[nodiscard]] double thread_cpu_ms();

}  // namespace stereo_slam
