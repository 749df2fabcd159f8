// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {

/// The first line of covariances.csv: the names of its columns. Files of earlier versions lack the last one.
[[nodiscard]] std::string covariance_columns();

/// Throws std::runtime_error with the line if the first line of a covariances.csv is only the beginning of
/// covariance_columns(). A line without the last name is of an earlier version.
void require_whole_columns(const std::filesystem::path& file, const TextLine& first_line);

/// Throws std::runtime_error with the line unless a text is the name of a TrackingStatus: what the column
/// `status` has.
void require_known_status(const std::filesystem::path& file, int line, std::string_view status);

/// Throws std::runtime_error with the line unless a text is names of WeakReasons with semicolons between
/// them, or empty: what the column `reasons` has.
void require_known_reasons(const std::filesystem::path& file, int line, std::string_view reasons);

}  // namespace stereo_slam
