// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "stereo_slam/calibration/stereo_rig.hpp"
#include "stereo_slam/core/corner_pairs.hpp"

/// Rigs as they would be without a mistake in the calibration, and how well corners of the raw images fit a
/// rig.
namespace stereo_slam {

/// The rig with all values in pixels multiplied: that of images of another size.
[[nodiscard]] StereoRig with_size_factor(StereoRig rig, double factor);

/// The rig with its numbers fx, fy, cx, cy taken from these positions.
[[nodiscard]] StereoRig with_order(StereoRig rig, const std::array<std::size_t, 4>& order);

/// The rig with its focal lengths multiplied, and the principal points where they are.
[[nodiscard]] StereoRig with_focal_factor(StereoRig rig, double factor);

/// The rig with the radial distortion k1 = log(factor) in both lenses, and k2 = k1^2, as most lenses have it.
[[nodiscard]] StereoRig with_radial_distortion(StereoRig rig, double factor);

/// Whether a lens of the rig has a coefficient other than zero.
[[nodiscard]] bool has_distortion(const StereoRig& rig);

/// The rig with the signs of all coefficients of the distortion changed.
[[nodiscard]] StereoRig with_opposite_distortion(StereoRig rig);

/// The rig with its first four coefficients taken as those of the other lens model, radtan or equidistant.
[[nodiscard]] StereoRig with_other_lens_model(StereoRig rig);

/// How far corners of the raw right images lie below the epipolar lines of their partners, px (median).
[[nodiscard]] double row_displacement_px(const StereoRig& rig, const std::vector<CornerPair>& pairs);

/// The rig whose right images lie lower by that many pixels.
[[nodiscard]] StereoRig with_row_displacement(StereoRig rig, double displacement_px);

/// How far corners of the raw right images lie from the epipolar lines of their partners, px: the median
/// deviation from the median. After rectification this is the distance of their rows, but for a displacement
/// of all.
[[nodiscard]] double epipolar_distance_px(const StereoRig& rig, const std::vector<CornerPair>& pairs);

/// The factor from 0.6 to 1.6 with which the corners lie nearest to these lines. A wrong size or focal length
/// bends the lines, differently in the two images, because their lenses are not parallel or not alike.
[[nodiscard]] double best_factor(const StereoRig& rig, const std::vector<CornerPair>& pairs,
                                 StereoRig (*with_factor)(StereoRig, double));

}  // namespace stereo_slam
