// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace stereo_slam {

/// The first line of covariances.csv: the names of its columns. Files of earlier versions lack the last one.
[[nodiscard]] std::string covariance_columns();

}  // namespace stereo_slam
