// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/local_map/local_map.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/rig/lens_residual.hpp"

namespace stereo_slam {

/// Corners that are followed in left images without usable right ones, until the motion of the camera tells
/// their depths.
class MotionStereo {
 public:
  /// Adds corners of a left image, px, that the camera saw at `T_keyframe_camera`. `disparity_px` is a first
  /// guess for all of them. The oldest corners are dropped if they are from more than eight images.
  void add(const cv::Mat& left, const Pose& T_keyframe_camera, const std::vector<Vector2<double>>& corners_px,
           double disparity_px);

  /// Follows the corners from the previous left image into the current one, and drops those whose motion is
  /// not that of a static point.
  void follow(const ConsecutivePyramids& pyramids, const Pose& T_keyframe_previous,
              const PoseGaussian& T_keyframe_current, const LeftCamera& camera);

  /// Number of corners, and of those whose depths are known by now.
  [[nodiscard]] std::size_t size() const noexcept { return corners_.size(); }
  [[nodiscard]] std::size_t known() const;
  /// Positions in the last left image, px.
  [[nodiscard]] std::vector<Vector2<double>> positions() const;

  /// Stereo measurements, as if there were a right image, of the corners whose depths are known by now, and
  /// of the landmarks that were matched, in a frame that becomes a keyframe. The corners' patches are aligned
  /// with the images in which they were added.
  /// `motion_by_lens` is how the motion from the last keyframe depends on the coefficients of the lens, px.
  [[nodiscard]] StereoPoints measure(const cv::Mat& left, const std::vector<Match>& matches,
                                     const MapView& map, const PoseGaussian& T_keyframe_current,
                                     const Eigen::Matrix<double, 6, LensResidual::kTerms>& motion_by_lens,
                                     const LeftCamera& camera) const;

  /// Goes on relative to a new keyframe, with the corners whose depths are not known yet.
  void change_keyframe(const PoseGaussian& T_previous_keyframe);

 private:
  struct Source {
    cv::Mat left;
    PoseGaussian T_keyframe_source;
  };
  struct Corner {
    std::size_t source = 0;         // in sources_
    Vector2<double> source_px, px;  // in its and in the last left image
    double disparity_px = 0.0;      // in its image; a guess until it is known
    bool is_known = false;
  };
  void drop_unused_sources();

  std::vector<Source> sources_;
  std::vector<Corner> corners_;
};

}  // namespace stereo_slam
