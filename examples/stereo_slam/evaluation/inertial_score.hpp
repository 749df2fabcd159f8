// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "stereo_slam/core/inertial_estimate.hpp"
#include "stereo_slam/core/types.hpp"

/// Compares what an IMU told of a run with the ground truth: velocity, tilt, biases and delay.
namespace stereo_slam {

/// A frame's row of inertial.csv in which the filter ran.
struct InertialRow {
  std::int64_t stamp_ns = 0;
  InertialEstimate estimate;
};

/// The true state of the IMU at a time.
struct TrueInertialState {
  std::int64_t stamp_ns = 0;
  Matrix3<double> R_world_imu = Matrix3<double>::Identity();
  Vector3<double> velocity = Vector3<double>::Zero();  ///< in the world, m/s
  std::optional<Vector6<double>> biases{};             ///< rad/s, m/s^2
};

/// Reads inertial.csv: the rows of the phase running. Throws std::runtime_error naming file, line and what
/// was wrong.
[[nodiscard]] std::vector<InertialRow> read_inertial(const std::filesystem::path& file);

/// Reads the data.csv of EuRoC's state_groundtruth_estimate0, in order of the stamps: stamp, position,
/// quaternion (w first), velocity, and biases if it has them. Throws std::runtime_error naming file and line
/// for a row with other numbers, also for a ground truth without velocities.
[[nodiscard]] std::vector<TrueInertialState> read_true_inertial_states(const std::filesystem::path& file);

/// The errors of one part of the state.
struct InertialPartScore {
  std::size_t frames = 0;     ///< that are scored; all figures are zero without any
  double rms = 0.0;           ///< root mean square of the lengths of the errors
  double mean_nees = 0.0;     ///< normalised estimation error squared: the degrees of freedom if it is right
  double share_inside = 0.0;  ///< share of the frames inside the 95 % bound
};

struct InertialScore {
  InertialPartScore velocity;         ///< m/s, 3 degrees of freedom
  InertialPartScore tilt;             ///< rad, 2 degrees of freedom
  InertialPartScore biases;           ///< 6 degrees of freedom; its rms is that of the gyroscope, rad/s
  double accelerometer_bias_rms = 0;  ///< m/s^2
  InertialPartScore delay;          ///< s, one degree of freedom; without frames if the true one is not known
  double last_delay_error_s = 0.0;  ///< of the last frame
  Vector3<double> down = Vector3<double>::Zero();  ///< of the world of the ground truth
};

/// Scores the frames that are between two true states at most `max_difference_s` away each. The vertical of
/// the world is the axis that is nearest to the mean of the estimated directions of gravity. Throws
/// std::runtime_error if no frame can be scored. The delay is scored if the true one is given: by how much
/// the stamps of the IMU are later than those of the images.
[[nodiscard]] InertialScore score_inertial(const std::vector<InertialRow>& rows,
                                           const std::vector<TrueInertialState>& truth,
                                           double max_difference_s,
                                           std::optional<double> true_delay_s = std::nullopt);

/// As text.
void print_inertial_score(std::ostream& stream, const InertialScore& score);

/// As a JSON object.
[[nodiscard]] std::string inertial_score_json(const InertialScore& score);

}  // namespace stereo_slam
