// SPDX-License-Identifier: MIT
// What a run learns of the rig corrects the motions that it measured before.
#include "stereo_slam/rig/rectification_estimator.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

const Pose kMotion = test::car_motion(2.5);

/// An estimator that is certain of a disparity offset of `offset_px` everywhere.
RectificationEstimator certain_of(double offset_px, double sigma_px) {
  RectificationEstimate estimate;
  estimate.coefficients(0, 0) = offset_px;
  estimate.disparity_information /= sigma_px * sigma_px;
  estimate.disparity_vector[0] = offset_px / (sigma_px * sigma_px);
  return RectificationEstimator::resumed(test::kitti_camera(), {}, estimate);
}

TEST_CASE("A motion that was measured with another rectification is corrected to the present one, once",
          "[stereo_slam][rectification]") {
  MotionEvidence motion;  // measured without an offset: a pixel would make the motion 10 cm longer
  motion.derivative(5, 0) = 0.1;
  motion.covariance(5, 5) = 0.1 * 0.1 * 0.5 * 0.5;
  const auto estimator = certain_of(0.3, 0.02);
  const MotionChange change = estimator.correct(motion, kMotion);
  CHECK(change.is_corrected);
  Vector6<double> longer = Vector6<double>::Zero();
  longer[5] = 0.1 * 0.3;
  CHECK((change.change - longer).norm() < 1e-12);
  CHECK(change.of(kMotion).is_approx(kMotion.boxplus(longer), 1e-12));
  CHECK(change.covariance_before(5, 5) == 0.1 * 0.1 * 0.5 * 0.5);
  CHECK(change.covariance(5, 5) < change.covariance_before(5, 5) / 100.0);
  CHECK(change.covariance(5, 5) == Approx(estimator.covariance_of(motion)(5, 5)).epsilon(1e-9));
  // Again, with the same estimate: nothing is left to correct.
  const MotionChange again = estimator.correct(motion, change.of(kMotion));
  CHECK(again.change.norm() < 1e-12);
  CHECK(again.covariance_before == change.covariance);
  CHECK(again.covariance.isApprox(change.covariance, 1e-12));
}

TEST_CASE("A frame before the second keyframe of a motion is corrected by its own derivative",
          "[stereo_slam][rectification]") {
  MotionEvidence motion;
  motion.derivative(5, 0) = 0.1;
  FrameDependence frame{};  // a quarter of the way, and sideways
  frame.derivative(5, 0) = 0.025F;
  frame.derivative(3, 0) = -0.05F;
  frame.covariance(5, 5) = 1e-4F;
  const Pose part = test::car_motion(0.6);
  const MotionChange change = certain_of(0.3, 0.02).correct(frame, motion, part);
  CHECK(change.is_corrected);
  Vector6<double> expected = Vector6<double>::Zero();
  expected[5] = 0.025 * 0.3;
  expected[3] = -0.05 * 0.3;
  CHECK((change.change - expected).norm() < 1e-7);  // single precision
  CHECK(change.covariance_before(5, 5) == Approx(1e-4));
  CHECK(change.covariance(3, 3) == Approx(0.05 * 0.05 * 0.02 * 0.02).epsilon(0.05));
  CHECK(change.covariance(3, 5) < 0.0);
  // A motion that told nothing was measured with unknown coefficients.
  CHECK_FALSE(certain_of(0.3, 0.02).correct(frame, MotionEvidence{}, part).is_corrected);
}

TEST_CASE("A motion that does not depend on the rectification, or was that of a vibrating rig, stays",
          "[stereo_slam][rectification]") {
  const auto estimator = certain_of(0.3, 0.02);
  MotionEvidence independent, vibrating;
  vibrating.derivative(5, 0) = 0.1;
  vibrating.vibrates = true;
  for (MotionEvidence* motion : {&independent, &vibrating}) {
    const MotionChange change = estimator.correct(*motion, kMotion);
    CHECK(!change.is_corrected);
    CHECK(change.change.isZero());
    CHECK(change.nonlinearity.isZero());
  }
}

}  // namespace
}  // namespace stereo_slam
