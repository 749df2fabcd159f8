// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/filters/robust_noise.hpp>

namespace stereo_slam {

/// The loss of measurements of points, some of which are wrong matches or on moving objects: a weight halves
/// at the squared Mahalanobis distance 6, which one in nine good measurements of (u, v, disparity) exceeds.
inline constexpr antipode::CauchyLoss<double> kOutlierLoss{2.449489742783178};

}  // namespace stereo_slam
