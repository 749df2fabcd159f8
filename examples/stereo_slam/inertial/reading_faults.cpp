// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/reading_faults.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/SVD>
#include <fmt/format.h>

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/inertial/reading_means.hpp"

namespace stereo_slam {
namespace {

using Rates = Eigen::Matrix3Xd;

/// The mean rates between frames, without their mean: biases do not matter. One column a rotation.
[[nodiscard]] Rates centred(Rates rates) {
  rates.colwise() -= rates.rowwise().mean().eval();
  return rates;
}

[[nodiscard]] Rates seen_rates(std::span<const SeenRotation> rotations) {
  Rates rates(3, rotations.size());
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const auto& [begin_ns, end_ns, angle_rad] = rotations[i];
    rates.col(static_cast<Eigen::Index>(i)) = angle_rad / (1e-9 * static_cast<double>(end_ns - begin_ns));
  }
  return centred(std::move(rates));
}

/// The mean rates during the rotations, if the stamps of the samples are `later_ns` later than those of the
/// frames.
[[nodiscard]] Rates rates_during(std::span<const SeenRotation> rotations, const ReadingMeans& readings,
                                 std::int64_t later_ns) {
  Rates rates(3, rotations.size());
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const auto& [begin_ns, end_ns, angle_rad] = rotations[i];
    rates.col(static_cast<Eigen::Index>(i)) =
        readings.between(begin_ns + later_ns, end_ns + later_ns).head<3>();
  }
  return centred(std::move(rates));
}

/// Whether the readings of the accelerometer are multiples of gravity: their usual length is 1.
[[nodiscard]] bool is_in_multiples_of_gravity(std::span<const ImuSample> samples) {
  std::vector<double> lengths;
  for (const auto& sample : samples) lengths.push_back(sample.specific_force.norm());
  const double usual = lengths.empty() ? 0.0 : median(lengths);
  return usual > 0.8 && usual < 1.25;
}

/// The 24 rotations that map axes to axes.
[[nodiscard]] std::vector<Matrix3<double>> axis_rotations() {
  std::vector<Matrix3<double>> rotations;
  std::array<int, 3> axes{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3<double> R = Matrix3<double>::Zero();
      for (int i = 0; i < 3; ++i) R(i, axes[static_cast<std::size_t>(i)]) = (signs >> i) & 1 ? -1.0 : 1.0;
      if (R.determinant() > 0.0) rotations.push_back(R);
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  return rotations;
}

[[nodiscard]] double angle_deg(const Matrix3<double>& R) {
  return std::acos(std::clamp(0.5 * (R.trace() - 1.0), -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

/// The rotation of the axes that explains the rates best: one by right angles, the smallest of those that are
/// about as good, or any if that is far better. Nothing if the axes are right.
[[nodiscard]] std::optional<Matrix3<double>> turn_of_axes(const Rates& seen, const Rates& read) {
  constexpr double kMuch = 0.3, kLeastTurn_deg = 10.0;
  const auto error = [&](const Matrix3<double>& R) { return (seen - R * read).squaredNorm(); };
  Matrix3<double> best = Matrix3<double>::Identity();
  auto candidates = axis_rotations();
  std::ranges::sort(candidates, {}, angle_deg);
  for (const auto& R : candidates) {
    if (error(R) < 0.9 * error(best)) best = R;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(seen * read.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3<double> signs = Vector3<double>::Ones();
  signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() > 0.0 ? 1.0 : -1.0;
  const Matrix3<double> any = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  if (error(any) < kMuch * error(best)) best = any;
  const bool better = error(best) < kMuch * error(Matrix3<double>::Identity());
  return better && angle_deg(best) > kLeastTurn_deg ? std::optional(best) : std::nullopt;
}

/// By how much the samples are later than the frames, if that explains the rates: the delay with the least
/// error, between whole milliseconds by a parabola.
[[nodiscard]] std::optional<std::int64_t> lateness_ns(std::span<const SeenRotation> rotations,
                                                      const ReadingMeans& readings) {
  constexpr int kLargest_ms = 200, kLeast_ms = 2, kWidth_ms = 4;
  constexpr double kNanosecondsPerMs = 1e6, kShare = 0.5;
  constexpr std::size_t kFewest = 15;
  while (!rotations.empty() &&
         rotations.back().end_ns + std::int64_t{kLargest_ms} * 1'000'000 > readings.end_ns())
    rotations = rotations.first(rotations.size() - 1);
  if (rotations.size() < kFewest) return std::nullopt;
  const Rates seen = seen_rates(rotations);
  const auto error = [&](int later_ms) {
    return (seen - rates_during(rotations, readings, std::int64_t{later_ms} * 1'000'000)).squaredNorm();
  };
  int best_ms = 0;
  double least = error(0);
  const double undelayed = least;
  for (int later_ms = -kLargest_ms; later_ms <= kLargest_ms; ++later_ms) {
    const double e = error(later_ms);
    if (e < least) {
      least = e;
      best_ms = later_ms;
    }
  }
  const bool explains = least < kShare * undelayed && least < 0.25 * seen.squaredNorm();
  if (!explains || std::abs(best_ms) < kLeast_ms) return std::nullopt;
  const double before = error(best_ms - kWidth_ms), after = error(best_ms + kWidth_ms);
  const double curvature = before - 2.0 * least + after;
  const double step_ms = curvature > 0.0 ? 0.5 * kWidth_ms * (before - after) / curvature : 0.0;
  return std::llround(kNanosecondsPerMs * (best_ms + std::clamp(step_ms, -1.0, 1.0)));
}

}  // namespace

std::optional<std::int64_t> seen_delay_ns(std::span<const SeenRotation> rotations,
                                          std::span<const ImuSample> samples) {
  if (samples.size() < 2) return std::nullopt;
  return lateness_ns(rotations, ReadingMeans(samples));
}

std::string probable_fault(std::span<const SeenRotation> rotations, std::span<const ImuSample> samples,
                           std::int64_t known_delay_ns) {
  constexpr double kLeastRate_rad_s = 0.02;  // slower rotations are those of the noise
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  if (is_in_multiples_of_gravity(samples)) {
    return "the accelerometer's readings have a length of about 1, so they seem to be in multiples of "
           "gravity: write them in m/s^2";
  }
  if (rotations.empty() || samples.size() < 2) return "no cause is known";
  const Rates seen = seen_rates(rotations);
  const ReadingMeans readings(samples);
  const Rates read = rates_during(rotations, readings, 0);
  const double count = static_cast<double>(rotations.size());
  const double seen_rad_s = std::sqrt(seen.squaredNorm() / count);
  const double ratio = std::sqrt(read.squaredNorm() / count) / std::max(seen_rad_s, 1e-9);
  if (seen_rad_s < kLeastRate_rad_s) {
    return "the camera hardly turns, which would tell; check the units and T_BS, the pose of the camera in "
           "the axes of the IMU";
  }
  if (ratio > 0.7 * kDegrees && ratio < 1.4 * kDegrees) {
    return fmt::format(
        "the gyroscope's rates are {:.0f} times those of the images, so they seem to be in "
        "degrees: write them in rad/s",
        ratio);
  }
  if (const auto turn = turn_of_axes(seen, read)) {
    return fmt::format(
        "the axes of the IMU seem to be turned by {:.0f} degrees: correct the pose of the "
        "camera in the axes of the IMU (T_BS, T_cam_imu)",
        angle_deg(*turn));
  }
  if (const auto later_ns = lateness_ns(rotations, readings)) {
    const double later_ms = 1e-6 * static_cast<double>(*later_ns);
    return fmt::format(
        "the stamps of the IMU seem to be about {:.0f} ms {} than those of the images{}: set "
        "timeshift_cam_imu to {:.4f} in the file that describes the IMU",
        std::abs(later_ms), later_ms > 0.0 ? "later" : "earlier",
        known_delay_ns == 0 ? "" : " and the known delay",
        1e-9 * static_cast<double>(*later_ns + known_delay_ns));
  }
  return "neither units, axes nor a delay explain it; check the calibration of the cameras and the IMU";
}

}  // namespace stereo_slam
