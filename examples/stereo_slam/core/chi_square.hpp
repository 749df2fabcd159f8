// SPDX-License-Identifier: MIT
#pragma once

/// Quantiles of the chi-square distribution, which bound squared Mahalanobis distances: kChi2_N_P for N
/// degrees of freedom and P percent.
namespace stereo_slam {

inline constexpr double kChi2_1_95 = 3.841;
inline constexpr double kChi2_2_95 = 5.991;
inline constexpr double kChi2_2_99 = 9.210;
inline constexpr double kChi2_3_50 = 2.366;
inline constexpr double kChi2_3_95 = 7.815;
inline constexpr double kChi2_3_99 = 11.345;
inline constexpr double kChi2_6_95 = 12.592;

}  // namespace stereo_slam
