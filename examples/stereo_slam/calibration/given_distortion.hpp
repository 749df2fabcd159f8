// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "stereo_slam/calibration/lens_values.hpp"

/// Distortions as files of other programs give them: the coefficients often without the name of their model.
namespace stereo_slam {

struct GivenDistortion {
  std::string model;                 ///< one of set_model()'s names, or empty
  std::vector<double> coefficients;  ///< in OpenCV's order; none for a pinhole
};

/// Sets the distortions of a rig, whose pinholes must be set. Without a name, the number of coefficients
/// decides: none are a pinhole, and five or more radtan. Four may be radtan (k1 k2 p1 p2) or equidistant (k1
/// k2 k3 k4): the other camera decides if it has a name or more coefficients; else they are taken for the
/// only model by which both lenses can exist, and refused if there is none or two: see can_be(). Four zeros
/// are a pinhole if its view is possible.
void set_distortions(StereoRig& rig, const GivenDistortion& left, const GivenDistortion& right,
                     const Fail& fail);

/// Whether a lens with these four coefficients can exist. By either model its image has to grow with the
/// angle to the axis, up to the farthest border.
///  - radtan: tangential coefficients of at most 0.03, and a view of at most 120 degrees across;
///  - equidistant: a view of at most 230 degrees, and k1 of at least -0.2 (-1/6 is an orthographic fisheye).
[[nodiscard]] bool can_be(Distortion model, const Lens& lens, const std::vector<double>& coefficients);

}  // namespace stereo_slam
