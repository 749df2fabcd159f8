// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "stereo_slam/rig/right_image_fit.hpp"

namespace stereo_slam {

/// What is done with the right image of a frame.
enum class RightImage {
  kFits,      ///< it is measured in
  kIgnored,   ///< it does not fit the left one, or there is none
  kDoubtful,  ///< it is measured in, but others before it did not fit; or its rows do not, but for so long
              ///< that this is usual by now, as after the right camera went out of focus
};

/// Notices right images that do not belong to the left ones, such as those of another moment or of a covered
/// camera: hardly any point of the left image is found in them, or the row errors of the points scatter more
/// than usual. Equal row errors of all points are no sign: then a camera was turned up or down, and the
/// disparities are still right.
class RightImageMonitor {
 public:
  /// Begins a frame, about which nothing is known yet. That a frame has no right image is no sign that those
  /// of other frames do not fit.
  void begin_frame(bool has_right = true) {
    has_right_ = has_right;
    if (fits_) last_seen_ = seen_;
    if (fits_) doubt_ = std::clamp(doubt_ + (*fits_ ? -1 : 1), 0, kPatience);
    suspicion_ = std::max(suspicion_ - 1, 0);
    fits_.reset();
    seen_ = true;
  }

  /// Adds points of the frame that were searched in both images.
  void add(const RightImageFit& fit) {
    if (!has_right_ || fit.in_left < kEnoughPoints) return;
    seen_ = seen_ && static_cast<double>(fit.in_right) >= kLeastShare * static_cast<double>(fit.in_left);
    fits_ = fits() && seen_ && certain_row_spread_px(fit) <= largest_row_spread_px();
    if (fits()) learn(fit.row_spread_px);
  }

  /// Makes images that fit doubtful, for as many frames as after a long fault.
  void distrust() noexcept { suspicion_ = kPatience; }

  /// Whether the points of this frame fit, or nothing is known.
  [[nodiscard]] bool fits() const noexcept { return fits_.value_or(true); }

  /// What is to be done with the image, as far as the points added show.
  [[nodiscard]] RightImage judgement() const noexcept {
    if (!has_right_) return RightImage::kIgnored;
    if (!fits_ && !last_seen_) return RightImage::kIgnored;  // until it is seen to fit again
    if (!fits()) return doubt_ < kPatience || !seen_ ? RightImage::kIgnored : RightImage::kDoubtful;
    return doubt_ == 0 && suspicion_ == 0 ? RightImage::kFits : RightImage::kDoubtful;
  }

 private:
  static constexpr std::size_t kEnoughPoints = 30;
  // On KITTI, EuRoC and rendered drives, also at a quarter of the frame rate, at least 0.52 of the points are
  // found, and the spread is at most 2.3 times the usual one. In right images of the frame before, less than
  // 0.3 are found, or the spread is four times the usual one or more.
  static constexpr double kLeastShare = 0.3;
  static constexpr double kUnusual = 3.0;            // relative to the usual spread
  static constexpr double kLeastRowSpread_px = 0.2;  // what is smaller is not unusual
  static constexpr double kMaxRowSpread_px = 1.0;    // what is larger is
  static constexpr double kFallRate = 0.2;  // fast, because the online rectification reduces the error
  static constexpr double kRiseRate = 0.02;
  static constexpr int kPatience = 20;  // frames

  /// The row spread less one standard deviation: that of few points is large by chance.
  [[nodiscard]] static double certain_row_spread_px(const RightImageFit& fit) {
    constexpr double kRelativeSigma = 1.17;  // of the median absolute deviation of one normal number
    const auto points = static_cast<double>(std::max<std::size_t>(fit.in_right, 1));
    return fit.row_spread_px * (1.0 - kRelativeSigma / std::sqrt(points));
  }

  [[nodiscard]] double largest_row_spread_px() const {
    if (!usual_row_spread_px_) return kMaxRowSpread_px;
    return std::clamp(kUnusual * *usual_row_spread_px_, kLeastRowSpread_px, kMaxRowSpread_px);
  }

  void learn(double row_spread_px) {
    if (!usual_row_spread_px_) usual_row_spread_px_ = row_spread_px;
    const double change = row_spread_px - *usual_row_spread_px_;
    *usual_row_spread_px_ += (change < 0.0 ? kFallRate : kRiseRate) * change;
  }

  bool has_right_ = true;     // this frame
  std::optional<bool> fits_;  // of this frame; nothing if too few points were searched
  bool seen_ = true;          // in the right image of this frame: enough of the points
  bool last_seen_ = true;     // the same in the last frame of which something is known
  int suspicion_ = 0;         // frames for which images that fit are doubtful all the same
  int doubt_ = 0;             // counts earlier frames: up if they did not fit, down if they did
  std::optional<double> usual_row_spread_px_;  // nothing before the first frame
};

}  // namespace stereo_slam
