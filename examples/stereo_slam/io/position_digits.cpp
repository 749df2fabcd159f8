// SPDX-License-Identifier: MIT
#include "stereo_slam/io/position_digits.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace stereo_slam {

int last_decimal_place(std::string_view number) {
  const auto mantissa = number.substr(0, number.find_first_of("eE"));
  const auto point = mantissa.find('.');
  const int decimals = point == std::string_view::npos ? 0 : static_cast<int>(mantissa.size() - point - 1);
  if (mantissa.size() == number.size()) return -decimals;
  const int exponent = std::atoi(std::string(number.substr(mantissa.size() + 1)).c_str());
  return std::clamp(exponent, -1000, 1000) - decimals;
}

void PositionDigits::add(const std::array<std::string_view, 3>& numbers) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    finest_place_[axis] = std::min(finest_place_[axis], last_decimal_place(numbers[axis]));
}

std::optional<std::string> PositionDigits::remark(std::span<const Eigen::Isometry3d> poses) const {
  constexpr double kFewestSteps = 1e5;  // of a coordinate that was cut off to six digits
  constexpr double kCoarse = 0.2;
  if (poses.size() < 3) return std::nullopt;
  std::vector<double> steps_m;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const double step_m = (poses[i].translation() - poses[i - 1].translation()).norm();
    if (step_m > 0.0) steps_m.push_back(step_m);  // poses may be written twice, or the body may stand
  }
  if (steps_m.empty()) return std::nullopt;
  const auto middle = steps_m.begin() + static_cast<std::ptrdiff_t>(steps_m.size() / 2);
  std::nth_element(steps_m.begin(), middle, steps_m.end());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double resolution_m = std::pow(10.0, finest_place_[axis]);
    double largest_m = 0.0;
    for (const auto& pose : poses)
      largest_m = std::max(largest_m, std::abs(pose.translation()[static_cast<Eigen::Index>(axis)]));
    if (largest_m < kFewestSteps * resolution_m || resolution_m <= kCoarse * *middle) continue;
    return fmt::format(
        "positions such as {:.0f} m are written to {:.3g} m only, and move by {:.3g} m from pose to pose; "
        "write them with more digits, or relative to the first one",
        largest_m, resolution_m, *middle);
  }
  return std::nullopt;
}

}  // namespace stereo_slam
