// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Frames, or as much time as they take, without a measured motion.
struct UnseenSteps {
  double before = 0.0;  ///< the one at hand
  double now = 1.0;     ///< in the one at hand
};

/// How far the camera will have come by a stamp if it goes on as it did.
///
/// A step is the time between the two pictures that the motion was last measured between. Stamps that do not
/// increase count as one step.
class ConstantVelocity {
 public:
  /// Longer than this nothing goes on as it did: the expectation stays where it is.
  static constexpr double kLongest_steps = 50.0;

  /// The motion from the last picture to one with this stamp; none when too long ago.
  [[nodiscard]] Pose motion_until(std::int64_t stamp_ns) const;

  /// The steps that have passed unmeasured before the last picture, and those since: never less than one, as
  /// a picture whose motion is unknown adds to what is not known however soon it comes.
  [[nodiscard]] UnseenSteps unseen_until(std::int64_t stamp_ns) const;

  /// Takes the measured motion from the last picture to one with this stamp.
  void measured(std::int64_t stamp_ns, const Pose& T_previous_current);

  /// Takes a picture whose motion nothing measured.
  void unmeasured(std::int64_t stamp_ns);

  /// Takes a picture whose pose was found again, whatever the motion was.
  void found(std::int64_t stamp_ns);

 private:
  [[nodiscard]] double steps_until(std::int64_t stamp_ns) const;

  Vector6<double> per_step_ = Vector6<double>::Zero();
  double step_ns_ = 0.0;  // 0: no motion was measured yet
  std::int64_t stamp_ns_ = 0;
  double unseen_steps_ = 0.0;
};

}  // namespace stereo_slam
