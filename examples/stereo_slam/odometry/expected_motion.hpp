// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The motion that is expected between two frames, and how much the measured one may differ from it.
struct ExpectedMotion {
  /// Standard deviations from the expected motion up to which a measured one is no surprise.
  static constexpr double kSurprise = 5.0;

  Pose T_previous_current;
  double rotation_sigma_rad = std::numeric_limits<double>::infinity();   ///< infinite: nothing is known
  double translation_sigma_m = std::numeric_limits<double>::infinity();  ///< infinite: nothing is known

  /// Whether anything is known of the motion.
  [[nodiscard]] bool known() const { return std::isfinite(translation_sigma_m); }

  /// Squared distance of a motion from the expected one, in standard deviations; zero if nothing is known.
  [[nodiscard]] double squared_distance(const Pose& motion) const {
    const Vector6<double> change = motion.boxminus(T_previous_current);
    const double rotation = change.head<3>().norm() / rotation_sigma_rad;
    const double translation = change.tail<3>().norm() / translation_sigma_m;
    return rotation * rotation + translation * translation;
  }

  /// Whether the camera hardly moves like this: it was a vehicle that moved, or the recording has a gap.
  [[nodiscard]] bool surprised_by(const Pose& motion) const {
    return squared_distance(motion) > kSurprise * kSurprise;
  }
};

}  // namespace stereo_slam
