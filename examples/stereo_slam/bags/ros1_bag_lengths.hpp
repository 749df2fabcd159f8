// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

namespace stereo_slam {

/// Checks the lengths that the records of a bag (format 2.0) declare, before a library allocates memory for
/// them. A bag without an index is not checked, since it is refused anyway. Throws std::runtime_error if a
/// record is longer than what is left of the file, or if a chunk unpacks to more than 1 GB.
void require_possible_lengths(const std::filesystem::path& file);

}  // namespace stereo_slam
