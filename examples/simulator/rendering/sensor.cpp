// SPDX-License-Identifier: MIT
#include "simulator/rendering/sensor.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include <opencv2/imgproc.hpp>

#include "simulator/textures/random.hpp"

namespace stereo_slam::simulator {
namespace {

/// Nearly normal deviate from 64 random bits: the sum of eight uniform bytes (Irwin and Hall), standardised;
/// its largest value is 4.9 standard deviations.
[[nodiscard]] float normal_deviate(std::uint64_t bits) {
  constexpr std::uint64_t kEven = 0x00ff00ff00ff00ffULL;
  const std::uint64_t pairs = (bits & kEven) + ((bits >> 8) & kEven);
  const std::uint64_t sum = (pairs * 0x0001000100010001ULL) >> 48;
  constexpr float kMean = 8.0F * 127.5F;
  constexpr float kDeviation = 209.0194F;  // sqrt(8 (256^2 - 1) / 12)
  return (static_cast<float>(sum) - kMean) / kDeviation;
}

void require(bool ok, const char* what, double value) {
  if (!ok) throw std::invalid_argument(std::string(what) + ", not " + std::to_string(value));
}

}  // namespace

void validate(const SensorSettings& settings) {
  require(settings.blur_sigma_px >= 0.0 && settings.blur_sigma_px <= 10.0, "blur_sigma_px must be in [0, 10]",
          settings.blur_sigma_px);
  require(settings.noise_sigma >= 0.0 && settings.noise_sigma <= 100.0, "noise_sigma must be in [0, 100]",
          settings.noise_sigma);
  require(settings.read_noise_share >= 0.0 && settings.read_noise_share <= 1.0,
          "read_noise_share must be in [0, 1]", settings.read_noise_share);
  require(settings.vignetting >= 0.0 && settings.vignetting < 1.0, "vignetting must be in [0, 1)",
          settings.vignetting);
  require(settings.exposure_change >= 0.0 && settings.exposure_change < 1.0,
          "exposure_change must be in [0, 1)", settings.exposure_change);
  require(settings.exposure_period_s > 0.0, "exposure_period_s must be positive", settings.exposure_period_s);
  require(std::abs(settings.gain_mismatch) < 0.5, "gain_mismatch must be in (-0.5, 0.5)",
          settings.gain_mismatch);
}

double exposure_gain(const SensorSettings& settings, std::uint64_t seed, double time_s, int camera) {
  Random random(seed, 6);
  const double turn = 2.0 * std::numbers::pi;
  const double slow = std::sin(turn * (time_s / settings.exposure_period_s + random.uniform()));
  const double fast = std::sin(turn * (2.7 * time_s / settings.exposure_period_s + random.uniform()));
  const double drift = 1.0 + settings.exposure_change * (0.7 * slow + 0.3 * fast);
  return camera == 0 ? drift : drift * (1.0 + settings.gain_mismatch);
}

cv::Mat1b expose(const cv::Mat1f& light, const SensorSettings& settings, double gain,
                 std::uint64_t noise_seed) {
  cv::Mat1f blurred = light;
  if (settings.blur_sigma_px > 0.0) {
    cv::GaussianBlur(light, blurred, {}, settings.blur_sigma_px, settings.blur_sigma_px,
                     cv::BORDER_REPLICATE);
  }
  const double centre_x = 0.5 * (light.cols - 1);
  const double centre_y = 0.5 * (light.rows - 1);
  const double corner = centre_x * centre_x + centre_y * centre_y;
  const double loss = corner > 0.0 ? settings.vignetting / corner : 0.0;
  const double variance = settings.noise_sigma * settings.noise_sigma;
  const auto read_variance = static_cast<float>(variance * settings.read_noise_share);
  const auto variance_per_grey = static_cast<float>(variance * (1.0 - settings.read_noise_share) / 128.0);

  cv::Mat1b image(light.size());
  for (int y = 0; y < light.rows; ++y) {
    std::uint64_t counter = mix_bits(noise_seed ^ (static_cast<std::uint64_t>(y) << 32));
    for (int x = 0; x < light.cols; ++x) {
      const double radius = (x - centre_x) * (x - centre_x) + (y - centre_y) * (y - centre_y);
      const float grey = blurred(y, x) * static_cast<float>(gain * (1.0 - loss * radius));
      const float sigma = std::sqrt(read_variance + variance_per_grey * grey);
      image(y, x) = cv::saturate_cast<std::uint8_t>(grey + sigma * normal_deviate(mix_bits(++counter)));
    }
  }
  return image;
}

}  // namespace stereo_slam::simulator
