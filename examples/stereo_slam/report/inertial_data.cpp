// SPDX-License-Identifier: MIT
#include "stereo_slam/report/inertial_data.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>

#include <nlohmann/json.hpp>

#include "stereo_slam/report/rounding.hpp"

namespace stereo_slam::report {
namespace {

using nlohmann::json;
using Vec = Vector3<double>;

/// Three numbers with their standard deviations.
struct Uncertain {
  Vec value, sigma;
};

/// The standard deviations of three numbers of an estimate from `first` on.
[[nodiscard]] Vec sigma_of(const InertialEstimate& estimate, int first) {
  return estimate.covariance.diagonal().segment<3>(first).cwiseMax(0.0).cwiseSqrt();
}

/// The angles of the axes of the IMU above the horizon, in rad. The vertical is opposite to gravity.
[[nodiscard]] Uncertain elevations(const InertialEstimate& estimate) {
  const double length = std::max(estimate.gravity.norm(), 1e-9);
  const Vec sine = -estimate.gravity / length;
  constexpr double kLeastCosine = 1e-3;  // an axis that is vertical has no first order
  const Vec cosine = (Vec::Ones() - sine.cwiseAbs2()).cwiseMax(kLeastCosine * kLeastCosine).cwiseSqrt();
  return {sine.cwiseMax(-1.0).cwiseMin(1.0).array().asin(),
          sigma_of(estimate, 3).cwiseQuotient(length * cosine)};
}

}  // namespace

json inertial_data(std::span<const FrameResult> results, const std::vector<std::size_t>& rows) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  constexpr int kDecimals = 4, kDigits = 3;
  const auto runs = [](const FrameResult& result) {
    return result.inertial.phase == InertialPhase::kRunning;
  };
  if (std::ranges::none_of(results, runs)) return nullptr;
  json data;
  const auto append = [&](const std::string& name, bool known, const Uncertain& numbers) {
    for (int i = 0; i < 3; ++i) {
      data[name].push_back(known ? to_decimals(numbers.value[i], kDecimals) : kNaN);
      data["sigma_" + name].push_back(known ? to_digits(numbers.sigma[i], kDigits) : kNaN);
    }
  };
  for (const std::size_t k : rows) {
    const InertialEstimate& estimate = results[k].inertial;
    const bool known = runs(results[k]);
    const Uncertain above = elevations(estimate);
    append("velocity_m_s", known, {estimate.velocity, sigma_of(estimate, 0)});
    append("elevation_deg", known, {kDegrees * above.value, kDegrees * above.sigma});
    append("gyroscope_bias_deg_s", known,
           {kDegrees * estimate.biases.head<3>(), kDegrees * sigma_of(estimate, 6)});
    append("accelerometer_bias_m_s2", known, {estimate.biases.tail<3>(), sigma_of(estimate, 9)});
    const double sigma_s = std::sqrt(std::max(estimate.covariance(12, 12), 0.0));
    data["delay_ms"].push_back(known ? to_decimals(1e3 * estimate.delay_s, kDecimals) : kNaN);
    data["sigma_delay_ms"].push_back(known ? to_digits(1e3 * sigma_s, kDigits) : kNaN);
  }
  return data;
}

}  // namespace stereo_slam::report
