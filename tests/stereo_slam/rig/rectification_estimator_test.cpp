// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/rectification_estimator.hpp"

#include <Eigen/LU>

#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

const Pose kDriven = test::car_motion(2.5);

/// One keyframe of the estimator's life: points measured at its beginning and at its end, with the planted
/// offset. Returns the effect of the rectification on the motion.
MotionEvidence drive(RectificationEstimator& estimator, std::mt19937_64& random, const PairGeometry& truth,
                     double sigma_px, bool learns = true, SeenMotion* seen_motion = nullptr) {
  const StereoCamera camera = test::kitti_camera();
  const Pose& motion = kDriven;
  const auto seen = [&](const StereoPoint& z) {
    const auto noise = [&] { return std::normal_distribution<double>(0.0, sigma_px)(random); };
    return estimator.current().measure(truth.left_position(z) + Vector2<double>(noise(), noise()),
                                       truth.right_position(z) + Vector2<double>(noise(), noise()));
  };
  std::vector<StereoMeasurement> rows;
  std::vector<TwoFramePoint> constraints;
  while (constraints.size() < 200) {
    const StereoPoint z = test::random_measurement(random, camera, 6.0, 60.0);
    const auto z_later = camera.project(motion.inverse() * camera.back_project(z));
    if (!z_later || !camera.in_view(*z_later)) continue;
    const auto first = seen(z);
    const auto second = seen(*z_later);
    rows.push_back(first);
    // Linearised at the point that is most likely given both measurements: at a noisy one, the derivatives
    // would be correlated with the errors.
    const Matrix3<double> R = stereo_pixel_covariance(sigma_px);
    TwoFramePoint c;
    StereoPoint likely = first.z;
    for (int iteration = 0; iteration < 3; ++iteration) {
      const Vector3<double> p = motion.inverse() * camera.back_project(likely);
      c.J_first = camera.projection_jacobian(p) * motion.rotation_matrix().transpose() *
                  camera.back_projection_jacobian(likely);
      c.S_inverse = (R + c.J_first * R * c.J_first.transpose()).inverse();
      c.first = likely;
      c.second = camera.project_unchecked(p);
      c.innovation = second.z - c.second - c.J_first * (first.z - likely);
      c.J_pose = pose_jacobian({camera.back_project(likely)}, motion, camera);
      likely = first.z + R * c.J_first.transpose() * c.S_inverse * c.innovation;
    }
    constraints.push_back(c);
  }
  if (seen_motion) *seen_motion = {motion, constraints};
  estimator.add_rows(rows);
  MotionEvidence effect =
      learns ? estimator.add_motion({motion, constraints}) : estimator.consider_motion({motion, constraints});
  estimator.advance();
  return effect;
}

TEST_CASE("An offset of the right image is estimated while driving", "[stereo_slam][rectification]") {
  std::mt19937_64 random(2);
  const StereoCamera camera = test::kitti_camera();
  const PairGeometry truth(camera, test::planted_rectification());
  RectificationEstimator estimator(camera, {});
  for (int keyframe = 0; keyframe < 40; ++keyframe) (void)drive(estimator, random, truth, 0.2);
  // What counts is the offset over the image, not the coefficients.
  double disparity_error = 0.0;
  double row_error = 0.0;
  for (int i = 0; i < 200; ++i) {
    const StereoPoint z = test::random_measurement(random, camera, 10.0, 20.0);
    const Vector2<double> left_px = truth.left_position(z);
    const Vector2<double> error =
        truth.right_position(left_px, z.z()) - estimator.current().right_position(left_px, z.z());
    disparity_error += std::abs(error.x()) / 200;
    row_error += std::abs(error.y()) / 200;
  }
  CAPTURE(disparity_error, row_error, estimator.current().coefficients());
  CHECK(disparity_error < 0.1);
  CHECK(row_error < 0.03);
}

TEST_CASE("The error of both lenses is estimated while driving", "[stereo_slam][rectification]") {
  std::mt19937_64 random(4);
  const StereoCamera camera = test::kitti_camera();
  const LensResidual::Coefficients lens(-13.0, 7.0);
  const PairGeometry truth(camera, test::planted_rectification(), lens);
  RectificationEstimator estimator(camera, {});
  for (int keyframe = 0; keyframe < 40; ++keyframe) (void)drive(estimator, random, truth, 0.2);
  const LensEstimate found = estimator.lens_error();
  const Vector2<double> planted_k = truth.lens().k();
  CAPTURE(found.k, found.sigma, planted_k);
  for (int i = 0; i < 2; ++i) CHECK(std::abs(found.k[i] - planted_k[i]) < 3.0 * found.sigma[i]);
  CHECK(found.sigma[0] < 0.2 * std::abs(planted_k[0]));
  CHECK(RectificationEstimator::resumed(camera, {}, estimator.estimate()).current().lens().coefficients() ==
        estimator.current().lens().coefficients());
}

TEST_CASE("A perfect rectification is hardly changed", "[stereo_slam][rectification]") {
  std::mt19937_64 random(3);
  const PairGeometry exact(test::kitti_camera());
  RectificationEstimator estimator(test::kitti_camera(), {});
  for (int keyframe = 0; keyframe < 20; ++keyframe) {
    (void)drive(estimator, random, exact, 0.2);
  }
  CAPTURE(estimator.current().coefficients());
  for (int i = 0; i < 50; ++i) {
    const StereoPoint z = test::random_measurement(random, test::kitti_camera(), 10.0, 20.0);
    const Vector2<double> ideal(z.x() - z.z(), z.y());
    CHECK((estimator.current().right_position(z) - ideal).cwiseAbs().maxCoeff() < 0.1);
  }
}

TEST_CASE("Little is learned of the disparity offset where the rows show an exact rectification",
          "[stereo_slam][rectification]") {
  std::mt19937_64 random(5);
  RectificationEstimator exact(test::kitti_camera(), {});
  RectificationEstimator wrong(test::kitti_camera(), {});
  (void)drive(exact, random, PairGeometry(test::kitti_camera()), 0.2);
  (void)drive(wrong, random, PairGeometry(test::kitti_camera(), test::planted_rectification()), 0.2);
  CHECK(exact.current().rms_offset_px().x() < 0.05);
  CHECK(exact.scale_sigma() < wrong.scale_sigma());  // the narrower prior
}

TEST_CASE("A displacement of the right image that the rows do not show is learned, if it is large",
          "[stereo_slam][rectification]") {
  std::mt19937_64 random(7);
  const double column_px = GENERATE(-5.0, 0.5, 2.0);
  const double turn_px = GENERATE(0.0, 0.75);  // in proportion to x^2, as of a camera turned sideways
  CAPTURE(column_px, turn_px);
  PairGeometry::Coefficients planted = PairGeometry::Coefficients::Zero();
  planted(0, 0) = column_px;
  planted(0, 3) = column_px * turn_px;
  const PairGeometry truth(test::kitti_camera(), planted);
  RectificationEstimator estimator(test::kitti_camera(), {});
  for (int keyframe = 0; keyframe < 40; ++keyframe) (void)drive(estimator, random, truth, 0.2);
  CAPTURE(estimator.current().coefficients().row(0));
  const PairGeometry error(test::kitti_camera(), estimator.current().coefficients() - planted);
  CHECK(error.rms_offset_px().x() < 0.05 * std::abs(column_px) + 0.03);
}

TEST_CASE("Motions are corrected to the last estimate, unless they contradict it",
          "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  const double px_per_keyframe = GENERATE(0.0, 0.1);  // a displacement from the start, and a slow drift
  CAPTURE(px_per_keyframe);
  std::mt19937_64 random(9);
  RectificationEstimator estimator(camera, {});
  std::vector<MotionEvidence> effects;
  constexpr int kKeyframes = 40;
  const auto column_px = [&](int keyframe) {
    return px_per_keyframe == 0.0 ? 3.0 : px_per_keyframe * keyframe;
  };
  for (int keyframe = 0; keyframe < kKeyframes; ++keyframe) {
    PairGeometry::Coefficients planted = PairGeometry::Coefficients::Zero();
    planted(0, 0) = column_px(keyframe);
    effects.push_back(drive(estimator, random, PairGeometry(camera, planted), 0.1));
  }
  const auto history = estimator.history();
  for (int keyframe = 0; keyframe < kKeyframes; ++keyframe) {
    CAPTURE(keyframe);
    const auto& effect = effects[static_cast<std::size_t>(keyframe)];
    CHECK(std::abs(estimator.coefficients_during(effect, history)[0] - column_px(keyframe)) < 1.0);
  }
}

/// Corners of a right image that is displaced and rolled; every third pair is wrong.
std::vector<CornerPair> corners_of(double rows_px, double roll_px, double noise_px) {
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<float> anywhere(0.0F, 376.0F);
  const PairGeometry terms(test::kitti_camera());
  std::vector<CornerPair> corners;
  for (int i = 0; i < 300; ++i) {
    const StereoPoint z = test::random_measurement(random, test::kitti_camera(), 5.0, 80.0);
    const double row = z.y() + rows_px + roll_px * terms.basis(z.head<2>())[1] + noise_px * normal(random);
    const cv::Point2f left_px(static_cast<float>(z.x()), static_cast<float>(z.y()));
    corners.push_back(
        {left_px, {left_px.x - 10.0F, i % 3 == 0 ? anywhere(random) : static_cast<float>(row)}});
  }
  return corners;
}

TEST_CASE("A large displacement and a roll of the rows are learned from one pair",
          "[stereo_slam][rectification]") {
  const double rows_px = GENERATE(-60.0, 1.5, 5.0);
  const double roll_px = GENERATE(0.0, -4.0);
  RectificationEstimator estimator(test::kitti_camera(), {});
  REQUIRE(estimator.relearn_rows(corners_of(rows_px, roll_px, 0.2)));
  CHECK(std::abs(estimator.current().coefficients()(1, 0) - rows_px) < 0.15);
  CHECK(std::abs(estimator.current().coefficients()(1, 1) - roll_px) < 0.15);
  CHECK(estimator.current().coefficients().row(0).isZero());
  CHECK_FALSE(estimator.relearn_rows(corners_of(rows_px, roll_px, 0.2)));  // it is known now
  estimator.advance();
  CHECK(std::abs(estimator.current().coefficients()(1, 0) - rows_px) < 0.15);
}

TEST_CASE("Rows are not learned anew from pairs that do not agree, nor if they are nearly right",
          "[stereo_slam][rectification]") {
  RectificationEstimator estimator(test::kitti_camera(), {});
  CHECK_FALSE(estimator.relearn_rows({}));
  CHECK_FALSE(estimator.relearn_rows(corners_of(0.8, 0.0, 0.2)));
  CHECK_FALSE(estimator.relearn_rows(corners_of(5.0, 0.0, 1.0)));
  auto few = corners_of(5.0, 0.0, 0.2);
  few.resize(40);
  CHECK_FALSE(estimator.relearn_rows(few));
  CHECK(estimator.current().coefficients().isZero());
}

TEST_CASE("Corners tell the displacement and the roll of a pair, relative to the rows that are known",
          "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  RectificationEstimator estimator(camera, {});
  REQUIRE(estimator.relearn_rows(corners_of(5.0, 0.0, 0.2)));
  const auto shown = estimator.displacement_of_rows(corners_of(-2.0, 3.0, 0.2));
  REQUIRE(shown);
  const double half_width = 0.5 * camera.width_px / camera.fx;
  CHECK(std::abs((*shown)[1] + 7.0) < 0.2);
  CHECK(std::abs((*shown)[2] - 3.0 / half_width) < 0.2 / half_width);
  CHECK(((*shown)[0] == 0.0 && (*shown)[3] == 0.0 && (*shown)[4] == 0.0));  // rows do not tell them
  CHECK(std::abs(estimator.current().coefficients()(1, 0) - 5.0) < 0.15);   // what is known stays
  CHECK_FALSE(estimator.displacement_of_rows({}));
  CHECK_FALSE(estimator.displacement_of_rows(corners_of(0.0, 0.0, 10.0)));
}

TEST_CASE("The reported uncertainty of lengths decreases with the distance driven",
          "[stereo_slam][rectification]") {
  std::mt19937_64 random(6);
  const PairGeometry truth(test::kitti_camera(), test::planted_rectification());
  RectificationEstimator estimator(test::kitti_camera(), {});
  (void)drive(estimator, random, truth, 0.2);
  const double first = estimator.scale_sigma();
  for (int keyframe = 0; keyframe < 10; ++keyframe) (void)drive(estimator, random, truth, 0.2);
  CHECK(first > 0.0);
  CHECK(estimator.scale_sigma() < 0.6 * first);
}

TEST_CASE("The error of the scale that all motions share can be left out of their covariances",
          "[stereo_slam][rectification]") {
  std::mt19937_64 random(8);
  const PairGeometry truth(test::kitti_camera(), test::planted_rectification());
  RectificationEstimator estimator(test::kitti_camera(), {});
  MotionEvidence effect;
  for (int keyframe = 0; keyframe < 10; ++keyframe) effect = drive(estimator, random, truth, 0.2);
  const Matrix6<double> all = estimator.covariance_of(effect);
  const Matrix6<double> rest = estimator.covariance_besides_scale(effect, kDriven);
  const double scale_m = estimator.scale_sigma() * kDriven.translation().norm();
  CAPTURE(rest, all, scale_m);
  CHECK(rest(5, 5) < 0.05 * all(5, 5));
  CHECK(all(5, 5) == Approx(scale_m * scale_m).epsilon(0.2));
  MotionEvidence corrected = effect;
  CHECK(estimator.correct(corrected, kDriven).covariance(5, 5) < 0.05 * effect.covariance(5, 5));
  // A motion that does not depend on the offset as the others do has an error of its own.
  effect.derivative.setZero();
  const Vector6<double> longer = (Vector6<double>() << Vector3<double>::Zero(),
                                  kDriven.inverse().translation() * estimator.scale_sigma())
                                     .finished();
  CHECK((estimator.covariance_besides_scale(effect, kDriven) - longer * longer.transpose()).norm() < 1e-12);
}

TEST_CASE("The dependence of a frame is that of a motion to it, and teaches nothing",
          "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  RectificationEstimator estimator(camera, {});
  std::mt19937_64 random(5);
  SeenMotion motion;
  const MotionEvidence shown = drive(estimator, random, PairGeometry(camera), 0.1, true, &motion);
  RectificationEstimator fresh(camera, {});
  const auto frame = fresh.dependence_of(motion, false);
  REQUIRE(frame);
  CHECK((frame->derivative.cast<double>() - shown.derivative).norm() < 1e-5 * shown.derivative.norm());
  CHECK(fresh.scale_sigma() == 0.0);  // as before the first motion
  motion.points.resize(29);
  CHECK_FALSE(fresh.dependence_of(motion, false));
}

TEST_CASE("What was learned of the same cameras is kept, and of others it is dropped",
          "[stereo_slam][rectification]") {
  constexpr double kNoise_px = 0.05;  // so that ten motions tell the lenses
  const StereoCamera camera = test::kitti_camera();
  const LensResidual::Coefficients lens(-13.0, 7.0);
  const PairGeometry same(camera, test::planted_rectification(), lens);
  std::mt19937_64 random(12);
  RectificationEstimator first(camera, {});
  for (int keyframe = 0; keyframe < 10; ++keyframe) (void)drive(first, random, same, kNoise_px);
  const auto second_run = [&](const PairGeometry& truth) {
    auto estimator = RectificationEstimator::after_drift(camera, {}, first.estimate());
    for (int keyframe = 0; keyframe < 10; ++keyframe) (void)drive(estimator, random, truth, kNoise_px);
    return estimator;
  };
  const auto kept = second_run(same);
  CHECK_FALSE(kept.contradicts_learned());
  CHECK_FALSE(kept.dropped_learned());
  CHECK(kept.lens_error().sigma[0] < first.lens_error().sigma[0]);

  PairGeometry::Coefficients turned = test::planted_rectification();
  turned(0, 0) += 0.7;
  turned(1, 0) -= 0.7;
  const auto drifted = second_run(PairGeometry(camera, turned, lens));
  CHECK_FALSE(drifted.contradicts_learned());
  CHECK_FALSE(drifted.dropped_learned());

  CHECK(second_run(PairGeometry(camera)).contradicts_learned());
  // Other lenses do not show in the rows.
  const auto other_lens = second_run(PairGeometry(camera, test::planted_rectification()));
  CHECK_FALSE(other_lens.contradicts_learned());
  CHECK(other_lens.dropped_learned());
  CHECK(std::abs(other_lens.lens_error().k[0]) < 4.0 * other_lens.lens_error().sigma[0]);
}

TEST_CASE("A resumed estimator gives the same estimates as one that never stopped",
          "[stereo_slam][rectification]") {
  std::mt19937_64 random(4);
  const StereoCamera camera = test::kitti_camera();
  const PairGeometry truth(camera, test::planted_rectification());
  RectificationEstimator estimator(camera, {});
  for (int keyframe = 0; keyframe < 3; ++keyframe) (void)drive(estimator, random, truth, 0.2);
  auto resumed = RectificationEstimator::resumed(camera, {}, estimator.estimate());
  CHECK(resumed.current().coefficients() == estimator.current().coefficients());
  auto same_random = random;
  (void)drive(estimator, random, truth, 0.2);
  (void)drive(resumed, same_random, truth, 0.2);
  CHECK(resumed.current().coefficients() == estimator.current().coefficients());
}

TEST_CASE("A motion that teaches nothing makes lengths as uncertain as one that does",
          "[stereo_slam][rectification]") {
  const PairGeometry exact(test::kitti_camera());
  std::mt19937_64 random(6);
  std::mt19937_64 same_random = random;
  RectificationEstimator taught(test::kitti_camera(), {});
  RectificationEstimator told(test::kitti_camera(), {});
  MotionEvidence effect, considered;
  for (int keyframe = 0; keyframe < 20; ++keyframe) {
    effect = drive(taught, random, exact, 0.1);
    considered = drive(told, same_random, exact, 0.1, /*learns=*/false);
  }
  CHECK(considered.evidence.information.isZero());
  CHECK(considered.derivative.isApprox(effect.derivative, 0.05));
  CHECK(told.current().coefficients().row(0).isZero());
  CHECK(considered.covariance.trace() > effect.covariance.trace());
  // Each coefficient has a standard deviation of .03 px or a little more, and the points have disparities of
  // 6 to 64 px: lengths are uncertain by .03 / 64 at least, and by .03 / 6 for each of some coefficients at
  // most.
  CHECK(told.scale_sigma() > taught.scale_sigma());
  CHECK(told.scale_sigma() > 0.03 / 64.0);
  CHECK(told.scale_sigma() < 0.01);
}

TEST_CASE("Without data the estimate is the prior, zero", "[stereo_slam][rectification]") {
  RectificationEstimator estimator(test::kitti_camera(), {});
  estimator.add_rows({});
  CHECK(estimator.add_motion({}).covariance.isZero());
  CHECK(estimator.consider_motion({}).covariance.isZero());
  CHECK(estimator.scale_sigma() == 0.0);
  estimator.advance();
  CHECK(estimator.current().coefficients() == PairGeometry::Coefficients::Zero());
}

}  // namespace
}  // namespace stereo_slam
