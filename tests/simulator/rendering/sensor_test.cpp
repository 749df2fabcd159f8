// SPDX-License-Identifier: MIT
#include "simulator/rendering/sensor.hpp"

#include <cmath>

#include "support/catch.hpp"

using namespace stereo_slam::simulator;

TEST_CASE("The noise has the stated strength, grows with the signal and repeats with its seed",
          "[simulate][sensor]") {
  SensorSettings settings;
  settings.noise_sigma = 3.0;
  settings.vignetting = 0.0;
  for (const double grey : {40.0, 128.0, 200.0}) {
    const cv::Mat1f light(300, 400, static_cast<float>(grey));
    const cv::Mat1b image = expose(light, settings, 1.0, 99);
    cv::Scalar mean;
    cv::Scalar deviation;
    cv::meanStdDev(image, mean, deviation);
    const double sigma = 3.0 * std::sqrt(0.3 + 0.7 * grey / 128.0);
    const double rounded = std::sqrt(sigma * sigma + 1.0 / 12.0);
    const double n = 300.0 * 400.0;
    CHECK(std::abs(mean[0] - grey) < 5.0 * rounded / std::sqrt(n));
    CHECK(std::abs(deviation[0] - rounded) < 5.0 * rounded / std::sqrt(2.0 * n));
    CHECK(cv::norm(image, expose(light, settings, 1.0, 99), cv::NORM_INF) == 0.0);
    CHECK(cv::norm(image, expose(light, settings, 1.0, 100), cv::NORM_INF) > 0.0);
    // Neighbours are independent: their correlation is zero within five standard errors.
    cv::Mat1f residual;
    image.convertTo(residual, CV_32F, 1.0, -mean[0]);
    const double across = residual.colRange(1, 400).dot(residual.colRange(0, 399)) / (n * rounded * rounded);
    const double down = residual.rowRange(1, 300).dot(residual.rowRange(0, 299)) / (n * rounded * rounded);
    CHECK(std::abs(across) < 5.0 / std::sqrt(n));
    CHECK(std::abs(down) < 5.0 / std::sqrt(n));
  }
}

TEST_CASE("Blur is symmetric and keeps the total light", "[simulate][sensor]") {
  SensorSettings settings;
  settings.blur_sigma_px = 1.0;
  settings.noise_sigma = 0.0;
  settings.vignetting = 0.0;
  cv::Mat1f light(31, 31, 20.0F);
  light(15, 15) = 1020.0F;
  const cv::Mat1b image = expose(light, settings, 1.0, 1);
  CHECK(image(15, 15) == Approx(20.0 + 1000.0 / (2.0 * CV_PI)).margin(2.0));
  CHECK(image(15, 13) == image(15, 17));
  CHECK(image(13, 15) == image(15, 17));
  CHECK(cv::sum(image - 20)[0] == Approx(1000.0).epsilon(0.02));
}

TEST_CASE("Vignetting darkens the corners and exposure drifts slowly and equally in both cameras",
          "[simulate][sensor]") {
  SensorSettings settings;
  settings.noise_sigma = 0.0;
  settings.vignetting = 0.2;
  const cv::Mat1b image = expose(cv::Mat1f(101, 201, 100.0F), settings, 1.5, 1);
  CHECK(image(50, 100) == 150);
  CHECK(image(0, 0) == 120);
  CHECK(image(100, 200) == 120);
  CHECK(expose(cv::Mat1f(3, 3, 1e6F), settings, 1.0, 1)(1, 1) == 255);
  for (int i = 0; i < 300; ++i) {
    const double time_s = 0.1 * i;
    const double left = exposure_gain(settings, 4, time_s, 0);
    CHECK(std::abs(left - 1.0) <= settings.exposure_change);
    CHECK(std::abs(exposure_gain(settings, 4, time_s + 0.1, 0) - left) < 0.01);
    CHECK(exposure_gain(settings, 4, time_s, 1) == Approx(left * (1.0 + settings.gain_mismatch)));
  }
}
