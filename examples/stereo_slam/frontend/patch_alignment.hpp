// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "stereo_slam/frontend/patch_pixels.hpp"

namespace stereo_slam {

/// Homography between two images of a plane, for the pixels of a patch. The pixel at the offset `x` from the
/// patch's centre in the target image corresponds to the offset y / (1 - perspective . y) in the source
/// image, with y = linear x.
struct PatchWarp {
  Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();
  Eigen::Vector2d perspective = Eigen::Vector2d::Zero();  ///< 1/px

  [[nodiscard]] bool is_identity() const {
    return linear == Eigen::Matrix2d::Identity() && perspective == Eigen::Vector2d::Zero();
  }
};

/// Square grey patch with its gradients, warped by the homography of a plane, to be aligned with another
/// image.
///
/// Alignment is the inverse compositional Lucas-Kanade method (Baker and Matthews, IJCV 2004) over a
/// translation, a gain and an offset. The Hessian of the template is inverted once; an iteration only samples
/// the image and computes inner products.
class PatchTemplate {
 public:
  static constexpr int kRadius_px = 3;
  static constexpr int kSide_px = 2 * kRadius_px + 1;
  static_assert(kSide_px == PatchPixels::kSide);

  /// Least texture of a patch in an image of usual contrast. The texture is the smaller eigenvalue of the
  /// structure tensor of the patch, in grey levels squared.
  static constexpr double kTexture = 800.0;

  /// Patch around `centre_px` of an 8-bit image, warped to look as in the image that it will be aligned with.
  /// Nothing if the patch leaves the image or has less than `min_texture` in some direction.
  [[nodiscard]] static std::optional<PatchTemplate> extract(const cv::Mat& image,
                                                            const Eigen::Vector2d& centre_px,
                                                            const PatchWarp& target_to_source = {},
                                                            double min_texture = kTexture);

  struct Alignment {
    Eigen::Vector2d position_px;
    Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();  ///< of the position; see align()
    double correlation = 0.0;  ///< zero-mean normalised cross-correlation, -1..1
  };

  /// Sub-pixel position of the patch in `image` near `start_px`; nothing if the iteration leaves the image,
  /// moves more than `max_shift_px` from its start, or comes where the image does not correlate with the
  /// patch. The covariance is that of least squares: the variance of the remaining grey differences times the
  /// inverse Hessian. It is large if the grey values differ, or if the edges of the patch have one direction.
  [[nodiscard]] std::optional<Alignment> align(const cv::Mat& image, const Eigen::Vector2d& start_px,
                                               double max_shift_px = 3.0) const;

 private:
  PatchTemplate() = default;

  PatchPixels value_;                // zero mean
  std::array<PatchPixels, 2> step_;  // rows of H^-1 J^T: image difference to shift
  Eigen::Matrix2f H_inverse_ = Eigen::Matrix2f::Zero();
  double norm_ = 0.0;  // sqrt(sum value^2)
};

/// Covariance of (u, v, disparity) measured by aligning the same patch in the left and in the right image.
///
/// `left_px2` and `right_px2` are the covariances of the two alignments. The noise of the template displaces
/// both positions equally, which does not change the disparity. The variance of this displacement was
/// measured on rendered drives (docs/results/history/2026-11-24-patches.md).
[[nodiscard]] Eigen::Matrix3d stereo_patch_covariance(const Eigen::Matrix2d& left_px2,
                                                      const Eigen::Matrix2d& right_px2);

/// Least texture of a patch in this 8-bit image: PatchTemplate::kTexture, and less if the image has little
/// contrast.
[[nodiscard]] double min_texture(const cv::Mat& image);

}  // namespace stereo_slam
