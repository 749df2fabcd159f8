// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <Eigen/Geometry>

namespace stereo_slam {

/// Decimal place of a number's last digit: -2 for "448252.12", 1 for "4.48e+03".
[[nodiscard]] int last_decimal_place(std::string_view number);

/// How finely the positions of a file are written.
class PositionDigits {
 public:
  /// The numbers of the next position.
  void add(const std::array<std::string_view, 3>& numbers);

  /// What is wrong if large coordinates, such as those of UTM, were written with so few digits that they are
  /// coarser than a fifth of the median step; nothing otherwise.
  [[nodiscard]] std::optional<std::string> remark(std::span<const Eigen::Isometry3d> poses) const;

 private:
  std::array<int, 3> finest_place_ = {100, 100, 100};  ///< by axis
};

}  // namespace stereo_slam
