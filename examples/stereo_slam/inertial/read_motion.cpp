// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/read_motion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <tuple>
#include <vector>

#include <antipode/geometry/jacobians.hpp>
#include <antipode/geometry/quaternion.hpp>

#include "stereo_slam/inertial/reading_means.hpp"

namespace stereo_slam {
namespace {

constexpr std::int64_t kEnd_ns = 20'000'000;        // readings at a time are the mean over this one
constexpr std::int64_t kRecent_ns = 1'000'000'000;  // that tells how much the readings usually change

[[nodiscard]] Matrix3<double> rotation_by(const Vector3<double>& angle_rad) {
  Vector6<double> xi = Vector6<double>::Zero();
  xi.head<3>() = angle_rad;
  return Pose::exp(xi).rotation_matrix();
}

/// The samples from shortly before an interval to those after it, in the axes of the IMU.
[[nodiscard]] std::vector<ImuSample> turned_samples(std::span<const ImuSample> samples,
                                                    const antipode::TimeInterval& interval,
                                                    const Matrix3<double>& R) {
  const auto first =
      std::ranges::lower_bound(samples, interval.begin_ns - kRecent_ns, {}, &ImuSample::stamp_ns);
  std::vector<ImuSample> turned(first, samples.end());
  for (ImuSample& sample : turned) {
    sample.angular_velocity = (R * sample.angular_velocity).eval();
    sample.specific_force = (R * sample.specific_force).eval();
  }
  return turned;
}

[[nodiscard]] Vector6<double> readings_at(const ReadingMeans& means, std::int64_t stamp_ns) {
  return means.between(stamp_ns - kEnd_ns / 2, stamp_ns + kEnd_ns / 2);
}

/// The variances of the changes of rate and force during intervals of this length, up to its end: of one
/// axis, the mean over the three.
[[nodiscard]] Vector2<double> usual_changes(const ReadingMeans& means, const antipode::TimeInterval& last) {
  const std::int64_t length_ns = last.end_ns - last.begin_ns;
  Vector2<double> squares = Vector2<double>::Zero();
  double count = 0.0;
  for (std::int64_t end_ns = last.end_ns;
       end_ns > last.end_ns - kRecent_ns && (count == 0.0 || end_ns - length_ns >= means.begin_ns());
       end_ns -= length_ns) {
    const Vector6<double> change = readings_at(means, end_ns) - readings_at(means, end_ns - length_ns);
    squares += Vector2<double>(change.head<3>().squaredNorm(), change.tail<3>().squaredNorm()) / 3.0;
    count += 1.0;
  }
  return squares / count;
}

/// The readings at the ends of a motion, less the biases.
struct EndReadings {
  Vector6<double> begin, end;
};

/// What a delay changes. The change of the readings from end to end contains noise, which must not pass for
/// knowledge of the delay: at rest there is nothing else. Its best estimate is the share of it that is no
/// noise, by the usual changes.
void set_effect_of_delay(const EndReadings& at, const Vector2<double>& usual_changes, const ImuNoise& noise,
                         ReadMotion& read) {
  const Vector2<double> noise_variance =
      Vector2<double>(noise.gyroscope, noise.accelerometer).cwiseAbs2() * 2.0 / (1e-9 * kEnd_ns);
  const Vector6<double> middle = 0.5 * (at.begin + at.end);
  Vector6<double> half = 0.5 * (at.end - at.begin);
  for (int part = 0; part < 2; ++part) {
    const double share = std::max(1.0 - noise_variance[part] / std::max(usual_changes[part], 1e-300), 0.0);
    half.segment<3>(3 * part) *= share;
    read.by_delay_variance.segment<3>(3 * part).setConstant(share * noise_variance[part]);
  }
  read.by_delay = read.motion.derivative_by_shift(middle - half, middle + half);
}

/// What an offset d of the sensor changes: it moves with R [w] d relative to the point that the calibration
/// has, and is R d away from it.
void set_effect_of_offset(const EndReadings& at, ReadMotion& read) {
  const Matrix3<double> R_end_begin = antipode::rotation_matrix(read.motion.rotation).transpose();
  const Matrix3<double> w_begin = antipode::skew(Vector3<double>(at.begin.head<3>()));
  const Matrix3<double> w_end = antipode::skew(Vector3<double>(at.end.head<3>()));
  const Matrix3<double> I = Matrix3<double>::Identity();
  read.by_offset.topRows<3>() = R_end_begin * w_begin - w_end;
  read.by_offset.bottomRows<3>() = R_end_begin * (I + read.motion.duration_s * w_begin) - I;
}

}  // namespace

ReadMotion read_motion(std::span<const ImuSample> samples, const antipode::TimeInterval& images,
                       const InertialState& state, const ImuNoise& noise) {
  const auto& [navigation, biases, turn, delay, offset, drift, path] = state.state;
  const std::int64_t delay_ns = std::llround(1e9 * delay[0]);
  const antipode::TimeInterval interval{images.begin_ns + delay_ns, images.end_ns + delay_ns};
  const auto turned = turned_samples(samples, interval, rotation_by(turn));
  ReadMotion read;
  read.motion = antipode::integrate_imu<double>(turned, interval, biases, noise);
  if (read.motion.status != antipode::InertialStatus::kComplete || interval.begin_ns == interval.end_ns)
    return read;
  const ReadingMeans means(turned);
  read.mean = means.between(interval.begin_ns, interval.end_ns);
  const EndReadings at{readings_at(means, interval.begin_ns) - biases,
                       readings_at(means, interval.end_ns) - biases};
  set_effect_of_delay(at, usual_changes(means, interval), noise, read);
  set_effect_of_offset(at, read);
  return read;
}

}  // namespace stereo_slam
