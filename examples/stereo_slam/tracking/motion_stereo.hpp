// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/lens_residual.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/local_map/local_map.hpp"
#include "stereo_slam/local_map/match.hpp"

namespace stereo_slam {

/// What measures points without right images: the left camera with its lens.
struct LeftCamera {
  const StereoCamera& camera;
  LensResidual lens;
  Matrix2<double> lens_covariance_px2 = Matrix2<double>::Zero();  ///< of its coefficients
};

/// The motion from the last keyframe, and how it depends on the coefficients of the lens, px.
struct MeasuredMotion {
  PoseGaussian T_keyframe_current;
  Eigen::Matrix<double, 6, LensResidual::kTerms> by_lens =
      Eigen::Matrix<double, 6, LensResidual::kTerms>::Zero();
};

/// Points of a new keyframe whose depths are not from a right image.
struct MotionStereoPoints {
  StereoPoints points;
  /// Standard deviation, relative to all depths, of the error that the uncertainties of the motion and of the
  /// lens add to them in common.
  double scale_sigma = 0.0;
};

/// Corners of a keyframe that has no usable right image. They are followed in the left images, until the
/// motion of the camera tells their depths.
class MotionStereo {
 public:
  /// Begins with corners of the keyframe's left image, px. `disparity_px` is a first guess for all of them.
  void begin(const std::vector<Vector2<double>>& corners_px, double disparity_px);

  /// Follows the corners from the previous left image into the current one, and drops those whose motion is
  /// not that of a static point.
  void follow(const ConsecutivePyramids& pyramids, const Pose& T_keyframe_previous,
              const PoseGaussian& T_keyframe_current, const LeftCamera& camera);

  /// Number of corners whose depths are known by now.
  [[nodiscard]] std::size_t known() const;

  /// Stereo measurements, as if there were a right image, of the corners whose depths are known by now, and
  /// of the landmarks that were matched, in a frame that becomes a keyframe. The corners' patches are aligned
  /// with the keyframe's left image.
  [[nodiscard]] MotionStereoPoints measure(const cv::Mat& keyframe_left, const cv::Mat& left,
                                           const std::vector<Match>& matches, const MapView& map,
                                           const MeasuredMotion& motion, const LeftCamera& camera) const;

 private:
  struct Corner {
    Vector2<double> keyframe_px, px;  // in the keyframe's and in the last left image
    double disparity_px = 0.0;        // in the keyframe; a guess until it is known
    bool is_known = false;
  };
  std::vector<Corner> corners_;
};

}  // namespace stereo_slam
