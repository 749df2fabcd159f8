// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace stereo_slam::simulator {

/// How the camera turns light into grey levels of an 8-bit image.
struct SensorSettings {
  double blur_sigma_px = 0.5;  ///< Gaussian blur of lens and rectification, [0, 10]
  double exposure_s = 0.0;   ///< time in which the light is collected: motion blur; from 0 to the next frame
  double noise_sigma = 2.0;  ///< standard deviation at mid grey (128); it grows with the root of the signal
  double read_noise_share = 0.3;  ///< part of that variance that does not depend on the signal, [0, 1]
  double vignetting = 0.12;       ///< loss of light in the corners, [0, 1)
  double exposure_change = 0.1;   ///< amplitude of the slow drift of the gain, [0, 1)
  double exposure_period_s = 17.0;
  double gain_mismatch = 0.01;  ///< relative gain of the right camera minus the left one's
};

/// Throws std::invalid_argument for a setting outside the range stated above.
void validate(const SensorSettings& settings);

/// Gain of a camera (0 left, 1 right) at a time.
[[nodiscard]] double exposure_gain(const SensorSettings& settings, std::uint64_t seed, double time_s,
                                   int camera);

/// Turns light into an 8-bit image: blur, gain and vignetting, noise. The noise of a pixel depends only on
/// `noise_seed` and the position of the pixel.
[[nodiscard]] cv::Mat1b expose(const cv::Mat1f& light, const SensorSettings& settings, double gain,
                               std::uint64_t noise_seed);

}  // namespace stereo_slam::simulator
