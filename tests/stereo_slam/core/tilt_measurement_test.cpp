// SPDX-License-Identifier: MIT
#include "stereo_slam/core/tilt_measurement.hpp"

#include <cmath>
#include <random>

#include <Eigen/Cholesky>

#include <antipode/geometry/jacobians.hpp>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

[[nodiscard]] Vector3<double> normals(std::mt19937_64& random, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  return Vector3<double>::NullaryExpr([&] { return normal(random); });
}

[[nodiscard]] Pose turned(const Vector3<double>& angle_rad) {
  Vector6<double> xi = Vector6<double>::Zero();
  xi.head<3>() = angle_rad;
  return Pose::exp(xi);
}

template <int N>
[[nodiscard]] antipode::Matrix<double, N> random_covariance(std::mt19937_64& random, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  const antipode::Matrix<double, N> A =
      antipode::Matrix<double, N>::NullaryExpr([&] { return normal(random); });
  return A * A.transpose();
}

/// The errors of the vertical in the axes of a pose, by turns of the pose.
[[nodiscard]] antipode::Matrix<double, 2, 3> tilt_by_turn(const Pose& pose, const Vector3<double>& vertical) {
  const Vector3<double> u = pose.rotation_matrix().transpose() * vertical;
  antipode::Matrix<double, 2, 3> across;
  across << u.unitOrthogonal().transpose(), u.cross(u.unitOrthogonal()).transpose();
  return across * antipode::skew(u);
}

TEST_CASE("The residual of a tilt has the derivative that finite differences have, and none by the heading",
          "[stereo_slam][tilt]") {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Pose pose = turned(normals(random, 1.0));
    TiltMeasurement tilt{.vertical_first = normals(random, 1.0).normalized()};
    tilt.vertical = normals(random, 1.0).normalized();
    tilt.whitening << normals(random, 10.0).transpose(), normals(random, 10.0).transpose();
    const TiltResidual residual = residual_of(tilt, pose);
    constexpr double kStep = 1e-5;  // the second order of the difference is 1e-10 of the whitening
    for (int i = 0; i < 3; ++i) {
      const Vector3<double> step = kStep * Vector3<double>::Unit(i);
      const Vector2<double> difference =
          (residual_of(tilt, pose * turned(step)).value - residual_of(tilt, pose * turned(-step)).value) /
          (2.0 * kStep);
      CHECK((difference - residual.jacobian.col(i)).norm() < 1e-8 * tilt.whitening.norm());
    }
    const Pose elsewhere = turned(0.7 * tilt.vertical_first) * pose;
    CHECK((residual_of(tilt, elsewhere).value - residual.value).norm() < 1e-12 * tilt.whitening.norm());
  }
}

TEST_CASE("A levelled link leads to the tilt that is known, whether it is more or less certain",
          "[stereo_slam][tilt]") {
  std::mt19937_64 random(2);
  for (const double known_rad : {1e-4, 1e-3, 1e-2}) {
    CAPTURE(known_rad);
    const LinkedPose first{{turned(normals(random, 1.0)), random_covariance<6>(random, 1e-3)}};
    const PoseGaussian link{turned(normals(random, 0.1)), random_covariance<6>(random, 5e-4)};
    const Vector3<double> vertical = normals(random, 1.0).normalized();
    const KnownTurn turn{normals(random, 1e-2), random_covariance<3>(random, known_rad)};
    const LevelledLink levelled = level(first, link, vertical, turn);
    REQUIRE(levelled.tilt);
    const LinkedPose result = add_link(first, levelled.T_previous_keyframe, true, levelled.tilt);
    const Pose& pose = result.estimate.pose;
    const Vector3<double> expected =
        (first.estimate.pose * link.pose * turned(turn.mean)).rotation_matrix().transpose() * vertical;
    CHECK((pose.rotation_matrix().transpose() * vertical - expected).norm() < 1e-12);
    // Along any axis the variance is the known one, or up to 5 % larger.
    const auto by_turn = tilt_by_turn(pose, vertical);
    const antipode::Matrix<double, 2> known = by_turn * turn.covariance * by_turn.transpose();
    const antipode::Matrix<double, 2> of_result =
        by_turn * result.estimate.covariance.topLeftCorner<3, 3>() * by_turn.transpose();
    const antipode::Matrix<double, 2> L_inverse = known.llt().matrixL().solve(known.Identity());
    const auto ratios = (L_inverse * of_result * L_inverse.transpose()).selfadjointView<Eigen::Lower>();
    CHECK(ratios.eigenvalues().minCoeff() > 1.0 - 1e-9);
    CHECK(ratios.eigenvalues().maxCoeff() < 1.0 / 0.95 + 1e-9);
  }
}

/// The path of a car with an accelerometer that has a bias, and the filter of both.
class Car {
 public:
  explicit Car(std::uint64_t seed) : random_(seed), bias_(normals(random_, kBias)) {
    P_.setZero();
    P_.block<3, 3>(kBiasPart, kBiasPart).diagonal().setConstant(kBias * kBias);
    vertical_first_ = measured_vertical();  // its error is that of the bias, and of the noise
    P_.block<3, 3>(kVertical, kVertical).diagonal().setConstant(kBias * kBias + kNoise * kNoise);
    P_.block<3, 3>(kVertical, kBiasPart).diagonal().setConstant(-kBias * kBias);
    P_.block<3, 3>(kBiasPart, kVertical).diagonal().setConstant(-kBias * kBias);
  }

  void drive(int k) {
    const Pose link = turned(Vector3<double>(0.02 * std::sin(0.3 * k), 0.08, 0.01 * std::cos(0.2 * k)));
    truth_ = (truth_ * link).renormalized();
    PoseGaussian seen{link * turned(normals(random_, kLink)), kLink * kLink * Matrix6<double>::Identity()};
    alone_ = compose(alone_, seen);
    const LevelledLink levelled = level(path_, seen, vertical_first_.normalized(), filtered(seen));
    path_ = add_link(path_, levelled.T_previous_keyframe, false, levelled.tilt);
  }

  /// Normalised squared error of the tilt, and its standard deviation, rad.
  struct Score {
    double nees, sigma_rad, error_rad;
  };
  [[nodiscard]] Score score(const LinkedPose& path) const {
    const Vector3<double> v = vertical_first_.normalized();
    const auto by_turn = tilt_by_turn(path.estimate.pose, v);
    const Vector2<double> e = by_turn * (path.estimate.pose.inverse() * truth_).log().head<3>();
    const antipode::Matrix<double, 2> P =
        by_turn * path.estimate.covariance.topLeftCorner<3, 3>() * by_turn.transpose();
    return {e.dot(P.llt().solve(e)), std::sqrt(P.trace()), e.norm()};
  }
  [[nodiscard]] Score with() const { return score(path_); }
  [[nodiscard]] Score without() const { return score(alone_); }

 private:
  static constexpr double kLink = 1e-3, kBias = 5e-3, kNoise = 1e-2;
  static constexpr int kVertical = 3, kBiasPart = 6;  // after the turn of the path
  using Vector9 = antipode::Vector<double, 9>;

  [[nodiscard]] Vector3<double> measured_vertical() {
    return truth_.rotation_matrix().transpose() * Vector3<double>::UnitY() + bias_ + normals(random_, kNoise);
  }
  /// The Kalman filter of (turn of the path, true vertical less the first measurement, bias).
  [[nodiscard]] KnownTurn filtered(const PoseGaussian& seen) {
    const Matrix3<double> R_here_before = seen.pose.rotation_matrix().transpose();
    antipode::Matrix<double, 9> A = antipode::Matrix<double, 9>::Identity();
    A.topLeftCorner<3, 3>() = R_here_before;
    P_ = (A * P_ * A.transpose()).eval();
    P_.topLeftCorner<3, 3>() += seen.covariance.topLeftCorner<3, 3>();
    const Matrix3<double> R = (path_.estimate.pose * seen.pose).rotation_matrix().transpose();
    const Vector3<double> expected = R * (vertical_first_ + mean_.segment<3>(kVertical));
    antipode::Matrix<double, 3, 9> H;
    H << antipode::skew(expected), R, Matrix3<double>::Identity();
    const Matrix3<double> S = H * P_ * H.transpose() + kNoise * kNoise * Matrix3<double>::Identity();
    const antipode::Matrix<double, 9, 3> gain = S.llt().solve(H * P_).transpose();
    const Vector3<double> innovation = measured_vertical() - expected - mean_.tail<3>();
    mean_ += gain * innovation;
    P_ = (P_ - gain * H * P_).eval();
    KnownTurn turn{mean_.head<3>(), P_.topLeftCorner<3, 3>()};
    // The levelling corrects the tilt of the path; its heading stays.
    const Vector3<double> u = (R * vertical_first_).normalized();
    mean_.head<3>() = (u * u.dot(mean_.head<3>())).eval();
    return turn;
  }

  std::mt19937_64 random_;
  Vector3<double> bias_, vertical_first_;
  Pose truth_ = Pose::identity();
  LinkedPose path_, alone_;
  Vector9 mean_ = Vector9::Zero();
  antipode::Matrix<double, 9> P_;
};

TEST_CASE("Over a long path the tilt and its covariance stay bounded, and one is as large as the other",
          "[stereo_slam][tilt]") {
  constexpr int kCars = 60, kKeyframes = 600;
  double nees = 0.0, squared = 0.0, sigma_early = 0.0, sigma_late = 0.0, alone = 0.0;
  for (int seed = 0; seed < kCars; ++seed) {
    Car car(static_cast<std::uint64_t>(seed));
    for (int k = 0; k < kKeyframes; ++k) {
      car.drive(k);
      if (k == kKeyframes / 10) sigma_early += car.with().sigma_rad / kCars;
    }
    sigma_late += car.with().sigma_rad / kCars;
    alone += car.without().sigma_rad / kCars;
    nees += car.with().nees / kCars;
    squared += car.with().error_rad * car.with().error_rad / kCars;
  }
  CAPTURE(nees, sigma_early, sigma_late, alone, squared);
  CHECK(sigma_late < sigma_early);  // ten times as far, and no less certain
  CHECK(sigma_late < 0.2 * alone);
  CHECK(squared < 2.0 * sigma_late * sigma_late);  // 60 errors of two coordinates: 1 +- .13, 7 sigma
  CHECK(nees == Approx(2.0).margin(3.3 * 2.0 / std::sqrt(kCars)));  // 5 % waits, which is less
}

}  // namespace
}  // namespace stereo_slam
