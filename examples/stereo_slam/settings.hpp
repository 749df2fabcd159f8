// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// Every number the SLAM can be told, with its default. Loaded from YAML by settings.cpp, which checks each key.
namespace stereo_slam {

/// Corner detection and description.
struct FeatureSettings {
  int count = 1000;              ///< ORB features an image
  int levels = 4;                ///< pyramid levels
  double scale_factor = 1.2;     ///< between levels
  int cell_px = 32;              ///< grid cell over which features are spread
  int fast_threshold = 12;       ///< grey levels
  int min_fast_threshold = 6;    ///< grey levels, in cells that stay empty
};

/// Disparity of single points.
struct StereoMatchingSettings {
  int max_disparity_px = 160;
  double min_disparity_px = 0.3;   ///< nearer to zero is taken for a wrong match
  double max_row_error_px = 1.0;   ///< epipolar check
  double uniqueness = 0.8;         ///< best cost over second best
  double min_correlation = 0.85;
};

/// Frame-to-frame stereo odometry, the system input u_k.
struct OdometrySettings {
  int max_points = 300;
  double exclusion_px = 4.0;     ///< kept between the odometry's points and those of the filter
  int cell_px = 50;              ///< bucket over which the points are spread
  int window_px = 15;            ///< side of the flow window
  int pyramid_levels = 3;
  double max_loop_error_px = 1.0;  ///< circular matching: distance between start and end of the circle
  double max_row_error_px = 1.5;   ///< epipolar check
  int ransac_iterations = 200;
  double inlier_px = 1.5;
  int min_inliers = 12;
  double pixel_sigma_px = 0.4;   ///< standard deviation of a tracked coordinate
};

struct Settings {
  std::string preset = "default";
  std::uint64_t seed = 1;
  FeatureSettings features;
  StereoMatchingSettings stereo;
  OdometrySettings odometry;
};

}  // namespace stereo_slam
