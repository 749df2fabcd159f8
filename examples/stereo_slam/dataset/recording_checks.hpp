// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>

#include "stereo_slam/dataset/sequence.hpp"

/// @file
/// Checks of a calibration and of stamps.
namespace stereo_slam {

/// Adds an error if focal lengths or baseline are out of bounds; a warning if the focal lengths differ by
/// more than a factor of 2, or the baseline does not seem to be in metres.
void check_camera(SequenceScan& scan);

/// Puts the cause first if the rig cannot be that of a stereo camera (see cause_of_rejected_rig).
void check_rig(SequenceScan& scan);

/// Warns about more frames per second than cameras take, about so few that nothing could be tracked, and
/// about times between frames of which a fifth is four times as long as a quarter.
void check_frame_rate(SequenceScan& scan);

/// The principal point of the images as they were calibrated, px: the mean of both cameras.
struct ImageCentre {
  double cx = 0.0;
  double cy = 0.0;
  int width_px = 0;
  int height_px = 0;
};

[[nodiscard]] ImageCentre centre_of(const StereoSequence& sequence);

/// fx, fy, cx, cy of a camera, px, and the size of its images.
struct Intrinsics {
  std::array<double, 4> values_px{};
  int width_px = 0;
  int height_px = 0;
};

/// The positions at which fx, fy, cx and cy stand, if these numbers were given in another order: the only one
/// with which the principal point is about in the middle and pixels are square. Nothing if the order as it is
/// may be right, or others as well.
[[nodiscard]] std::optional<std::array<std::size_t, 4>> likely_order(const Intrinsics& camera);

/// The same of the left camera, raw or rectified, if the right one has that order, too.
[[nodiscard]] std::optional<std::array<std::size_t, 4>> likely_order(const StereoSequence& sequence);

/// What is wrong with numbers in that order: "fx and cx look exchanged".
[[nodiscard]] std::string order_text(const std::array<std::size_t, 4>& order);

/// By how much the values of the calibration in pixels must be multiplied if it was made for images of
/// another size: those in whose middle the principal point lies. Nothing if it lies about in the middle, or
/// off by other factors in x and y.
[[nodiscard]] std::optional<double> size_factor(const ImageCentre& centre);

/// What is wrong then, and what to do.
[[nodiscard]] std::string other_size_text(const ImageCentre& centre, double factor);

}  // namespace stereo_slam
