// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/rig/displacement_estimation.hpp"
#include "stereo_slam/rig/image_displacement.hpp"

namespace stereo_slam {

/// How far the right images are displaced from frame to frame, as the last frames showed it: zero for a rigid
/// rig.
class Vibration {
 public:
  /// Adds the displacement of a frame.
  void add(const ImageDisplacement::Coefficients& displacement) {
    last_.push_back(displacement);
    if (last_.size() > kRest) last_.erase(last_.begin());
    frames_ = std::min(frames_ + 1, kWindow);
    mean_square_ += (displacement.cwiseAbs2() - mean_square_) / frames_;
    const double largest = mean_square_.head<ImageDisplacement::kSeen>().maxCoeff();
    present_ = largest > (present_ ? kEnds_px2 : kBegins_px2);
  }

  /// Notes that a frame could only be measured with a displacement.
  void begin() noexcept {
    present_ = true;
    mean_square_ = mean_square_.cwiseMax(4.0 * kBegins_px2);
  }

  /// Whether the displacements are larger than those that the errors of lenses leave to a rigid rig.
  [[nodiscard]] bool present() const noexcept { return present_; }

  /// Whether the displacement that the landmarks of a frame show is five standard deviations from those of
  /// the frames before, in one of its first three coefficients: that of its noise, and the usual one of this
  /// rig.
  [[nodiscard]] bool is_surprised_by(const DisplacementEstimate& shown) const {
    constexpr double kClear2 = 25.0;
    const ImageDisplacement::Coefficients usual_px2 = shown.covariance.diagonal() + mean_square_;
    return (shown.change.cwiseAbs2() - kClear2 * usual_px2).head<ImageDisplacement::kSeen>().maxCoeff() > 0.0;
  }

  /// The displacement at which the right image has come to rest after it was displaced, if the last 60 frames
  /// agree on one that is larger than those of rigid rigs: the right camera was turned, or moved.
  [[nodiscard]] std::optional<ImageDisplacement::Coefficients> rest() const {
    if (!present_ || last_.size() < kRest) return std::nullopt;
    ImageDisplacement::Coefficients mean = ImageDisplacement::Coefficients::Zero();
    for (const auto& displacement : last_) mean += displacement / static_cast<double>(kRest);
    ImageDisplacement::Coefficients variance = ImageDisplacement::Coefficients::Zero();
    for (const auto& displacement : last_)
      variance += (displacement - mean).cwiseAbs2() / static_cast<double>(kRest);
    const auto largest = [](const ImageDisplacement::Coefficients& square_px2) {
      return square_px2.head<ImageDisplacement::kSeen>().maxCoeff();
    };
    if (largest(variance) > kEnds_px2 || largest(mean.cwiseAbs2()) < kEnds_px2) return std::nullopt;
    return mean;
  }

  /// Mean squares of the displacements of the last frames, px^2.
  [[nodiscard]] const ImageDisplacement::Coefficients& mean_square_px2() const noexcept {
    return mean_square_;
  }

 private:
  // Their root mean squares in frames of rigid rigs: .04 to .15, .04 to .10 and .06 to .12 px on KITTI 00,
  // 01, 06 and EuRoC MH_01, less than .025 on rendered drives.
  static constexpr double kBegins_px2 = 0.25 * 0.25;
  static constexpr double kEnds_px2 = 0.2 * 0.2;
  static constexpr std::size_t kRest = 60;  // frames
  static constexpr int kWindow = 30;        // frames
  static constexpr int kPriorFrames = 10;   // the first frames do not decide alone

  std::vector<ImageDisplacement::Coefficients> last_;  // of the last frames
  ImageDisplacement::Coefficients mean_square_ = ImageDisplacement::Coefficients::Zero();  // px^2
  int frames_ = kPriorFrames;
  bool present_ = false;
};

}  // namespace stereo_slam
