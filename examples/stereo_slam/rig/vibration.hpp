// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/rig/displacement_estimation.hpp"
#include "stereo_slam/rig/image_displacement.hpp"

namespace stereo_slam {

/// How the right images are displaced from frame to frame, as the last frames showed it. A rigid rig holds
/// its displacement: zero, or, after a jump, that of the frame that jumped. A jump within twenty frames of
/// another one, or of the start, is a vibration, and so are displacements that are large on average.
class Vibration {
 public:
  struct Held {
    ImageDisplacement::Coefficients displacement = ImageDisplacement::Coefficients::Zero();  ///< px
    ImageDisplacement::Covariance covariance =
        ImageDisplacement::Covariance::Zero();  ///< of it, against that of the last keyframe, px^2
  };

  /// Adds the displacement of a frame.
  void add(const ImageDisplacement::Coefficients& displacement) {
    last_.push_back(displacement);
    if (last_.size() > kRest) last_.erase(last_.begin());
    ++since_jump_;
    frames_ = std::min(frames_ + 1, kWindow);
    mean_square_ += ((displacement - held_.displacement).cwiseAbs2() - mean_square_) / frames_;
    const double largest = mean_square_.head<ImageDisplacement::kSeen>().maxCoeff();
    present_ = largest > (present_ ? kEnds_px2 : kBegins_px2);
    if (present_) held_ = {};
  }

  /// Adds the displacement of a frame, with its covariance, that could not be measured with the one held.
  void jump(const ImageDisplacement::Coefficients& displacement,
            const ImageDisplacement::Covariance& covariance) {
    present_ = since_jump_ < kRigid;
    since_jump_ = 0;
    held_ = {displacement, covariance};
    held_.covariance.diagonal() += mean_square_;  // it would be displaced without a jump, too
    if (!present_) return;
    mean_square_ = mean_square_.cwiseMax(4.0 * kBegins_px2);
    held_ = {};
    add(displacement);
  }

  /// Corrects the displacement that is held by that of another frame after the jump, with its covariance.
  /// From the next keyframe on, frames do not tell it: the keyframe's landmarks are displaced as they are.
  void measure_held(const ImageDisplacement::Coefficients& displacement,
                    const ImageDisplacement::Covariance& covariance) {
    if (held_.covariance.isZero(0.0)) return;
    ImageDisplacement::Covariance innovation = held_.covariance + covariance;
    innovation.diagonal() += mean_square_;
    const ImageDisplacement::Covariance gain = held_.covariance * innovation.inverse();
    held_.displacement += gain * (displacement - held_.displacement);
    held_.covariance -= gain * innovation * gain.transpose();
  }

  /// What is expected of the next frame.
  [[nodiscard]] const Held& held() const noexcept { return held_; }
  /// Whether the last frame jumped.
  [[nodiscard]] bool has_jumped() const noexcept { return since_jump_ == 0; }

  /// The last frame became a keyframe, measured with the displacement that is held.
  void begin_keyframe() { held_.covariance.setZero(); }

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

  /// The displacement at which the right image has come to rest, if it has: the right camera was turned, or
  /// moved. A jump is one if the frame after it had none; a vibration comes to rest if its last 60 frames
  /// agree on a displacement that is larger than those of rigid rigs.
  [[nodiscard]] std::optional<ImageDisplacement::Coefficients> rest() const {
    if (!held_.displacement.isZero(0.0) && since_jump_ > 0) return held_.displacement;
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

  /// The displacement rest() is from now on an error of the rig.
  void settle() {
    if (present_) *this = {};
    held_ = {};
    last_.clear();
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
  static constexpr int kRigid = 20;         // frames between jumps: a loose camera jumps every twelfth or so
  static constexpr int kWindow = 30;        // frames
  static constexpr int kPriorFrames = 10;   // the first frames do not decide alone

  std::vector<ImageDisplacement::Coefficients> last_;  // of the last frames
  Held held_;
  int since_jump_ = 1;  // frames, or since the start
  ImageDisplacement::Coefficients mean_square_ = ImageDisplacement::Coefficients::Zero();  // px^2
  int frames_ = kPriorFrames;
  bool present_ = false;
};

}  // namespace stereo_slam
