// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/image_drift.hpp"

#include <random>

#include "stereo_slam/support/flight.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

[[nodiscard]] PoseGaussian motion_with_noise(const Pose& pose) {
  Vector6<double> sigma;
  sigma << 1e-4, 2e-4, 3e-4, 1e-3, 2e-3, 3e-3;
  return {pose, sigma.cwiseAbs2().asDiagonal()};
}

}  // namespace

TEST_CASE("Over n motions without turns the drift grows with n, and not with its root", "[inertial]") {
  constexpr int kMotions = 12;
  ImageDrift drift;
  drift.see(motion_with_noise(Pose::identity()));
  for (int i = 0; i < kMotions; ++i) drift.move(Pose::identity());
  const Matrix6<double> P = drift.covariance(Matrix6<double>::Identity());
  const Vector6<double> expected = kMotions * drift.of_motion();
  CHECK(P.isApprox(Matrix6<double>(expected.cwiseAbs2().asDiagonal()), 1e-12));
}

TEST_CASE("The drift of a pose is that of a path all of whose motions are wrong alike", "[inertial]") {
  std::mt19937_64 random(3);
  const Pose motion = Pose::exp(Vector6<double>::Constant(0.1));
  ImageDrift drift;
  drift.see(motion_with_noise(motion));
  const Vector6<double> factors =
      (Vector6<double>() << normal3(random, 1.0), normal3(random, 1.0)).finished();
  const Pose wrong = motion * Pose::exp(drift.of_motion().cwiseProduct(factors));
  Pose path = Pose::identity(), wrong_path = Pose::identity();
  for (int i = 0; i < 8; ++i) {
    path = path * motion;
    wrong_path = wrong_path * wrong;
    drift.move(motion);
  }
  // With the covariance f f^T of the factors f, that of the pose is e e^T, to first order in the drift.
  const Vector6<double> e = wrong_path.boxminus(path);
  const Matrix6<double> P = drift.covariance(factors * factors.transpose());
  CHECK(P.isApprox(e * e.transpose(), 1e-2));
}

TEST_CASE("Relative to a new keyframe nothing has drifted, and nothing drifts before a motion was measured",
          "[inertial]") {
  ImageDrift drift;
  drift.move(Pose::identity());
  CHECK(drift.covariance(Matrix6<double>::Identity()).isZero(0.0));
  drift.see(motion_with_noise(Pose::identity()));
  drift.move(Pose::identity());
  CHECK_FALSE(drift.covariance(Matrix6<double>::Identity()).isZero(0.0));
  drift.begin_keyframe();
  CHECK(drift.covariance(Matrix6<double>::Identity()).isZero(0.0));
}
