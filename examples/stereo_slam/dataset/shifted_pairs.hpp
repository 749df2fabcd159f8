// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "stereo_slam/dataset/sequence.hpp"

/// @file
/// Pairs whose right image is that of another frame: found in the images, and put right.
namespace stereo_slam {

/// Left images that are those of the frame before while the right ones are new, or the other way round: their
/// pairs are a frame apart and others are not, which looks like a delay. Up to 24 pairs of frames are
/// looked at. Nothing if less than a sixth, or two, are such.
[[nodiscard]] std::optional<Problem> repeated_images(const StereoSequence& sequence);

/// Whether the images of these frames show for certain that each left image belongs to the right image `late`
/// frames later. Rows must agree much better so in at least two frames, and in none worse. A right camera
/// that is displaced or rolled, also anew in every frame, explains as much of the rows as it can in both
/// cases.
[[nodiscard]] bool are_shifted_pairs(const StereoSequence& sequence, const std::vector<std::size_t>& indices,
                                     int late);

/// The frame from which on pairs are shifted like those of frame `known`, as after an image that was lost:
/// the first one that has a partner if the images at the beginning are shifted, too.
[[nodiscard]] std::size_t first_shifted_frame(const StereoSequence& sequence, std::size_t known, int late);

/// Whether both cameras are in one image, so that messages have one name for them.
[[nodiscard]] bool is_one_image(const StereoSequence& sequence);

/// What is said of right images that are late by whole frames, or early (negative).
[[nodiscard]] std::string text_of_delay(const StereoSequence& sequence, int frames);

/// What is added if that is certain: the partner of a left image, where the shift begins, and the options
/// that let a run go on.
[[nodiscard]] std::string text_of_partners(const StereoSequence& sequence, std::size_t left, int late);

/// Pairs every left image with the right image `offset` frames later (negative: earlier), and leaves out the
/// frames at the ends that have no partner. That is the word of the user: pairs that are shifted are no error
/// then, also with zero. Adds an error for a live camera, and if fewer than two frames are left.
void offset_right_images(SequenceScan& scan, int offset);

}  // namespace stereo_slam
