// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/keyframe_trajectory.hpp"

#include <cmath>
#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/tilt_measurement.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

PoseGaussian step(double forward_m) {
  return {test::car_motion(forward_m), 1e-4 * Matrix6<double>::Identity()};
}

/// Frames 0 to 5; frames 0, 2 and 4 are keyframes.
KeyframeTrajectory drive() {
  KeyframeTrajectory trajectory;
  trajectory.begin(0);
  trajectory.append({}, true);
  for (std::size_t frame = 1; frame < 6; ++frame) {
    const PoseGaussian pose = step(frame % 2 == 0 ? 2.0 : 1.0);
    trajectory.append(pose, true);
    if (frame % 2 == 0) trajectory.add_keyframe(frame, {pose});
  }
  return trajectory;
}

TEST_CASE("Poses of frames are compositions over their keyframes", "[stereo_slam][slam]") {
  const auto trajectory = drive();
  CHECK(trajectory.reference() == 2);
  CHECK(trajectory.reference_frame() == 4);
  const auto poses = trajectory.poses(0.0);
  REQUIRE(poses.size() == 6);
  const PoseGaussian fourth = compose_first_order(step(2.0), step(2.0));
  CHECK(poses[0].pose.is_approx(Pose::identity(), 0.0));
  CHECK(poses[4].pose.is_approx(fourth.pose, 1e-12));
  CHECK(poses[4].covariance.isApprox(fourth.covariance, 1e-12));
  CHECK(poses[5].pose.is_approx(compose_first_order(fourth, step(1.0)).pose, 1e-12));
}

TEST_CASE("The common error of the links adds up from keyframe to keyframe", "[stereo_slam][slam]") {
  constexpr double kSigma_rad = 0.003;
  const auto trajectory = drive();
  const auto without = trajectory.poses(0.0);
  const auto with = trajectory.poses(kSigma_rad);
  CHECK(with[1].covariance == without[1].covariance);  // a frame has none of its own
  const LinkedPose last = trajectory.in_world(step(1.0));
  CHECK(last.with_common_error(kSigma_rad).covariance.isApprox(with[5].covariance, 1e-12));
  for (std::size_t frame = 0; frame < 6; ++frame) {
    CAPTURE(frame);
    // The steps only turn about y, so that the heading's error is the sum of those of all links.
    const double added = with[frame].covariance(1, 1) - without[frame].covariance(1, 1);
    const std::size_t links = frame / 2;
    CHECK(added == Approx(std::pow(static_cast<double>(links) * kSigma_rad, 2)).epsilon(1e-4));
  }
}

TEST_CASE("A link that was only predicted has no common error", "[stereo_slam][slam]") {
  KeyframeTrajectory trajectory = drive();
  trajectory.append(step(2.0), false);
  trajectory.add_keyframe(6, {step(2.0)});
  const auto before = trajectory.poses(0.0), with = trajectory.poses(0.003);
  const double two_links = 2 * 0.003;
  CHECK(with[6].covariance(1, 1) - before[6].covariance(1, 1) == Approx(two_links * two_links).epsilon(1e-4));
}

TEST_CASE("The common error of a link does not depend on how accurate the link is", "[stereo_slam][slam]") {
  Vector6<double> sigma;
  sigma << 1e-3, 2e-3, 2e-3, 0.01, 0.02, 0.03;
  const Matrix6<double> covariance = sigma.cwiseAbs2().asDiagonal();
  const Pose motion = test::car_motion(3.0);
  const Vector6<double> common = common_error_per_rad({motion, covariance});
  CHECK(common.head<3>().squaredNorm() == Approx(3.0));
  CHECK((common / common[0]).isApprox(sigma / sigma[0], 1e-12));
  CHECK(common_error_per_rad({motion, 1e-4 * covariance}).isApprox(common, 1e-12));
  CHECK(common_error_per_rad({motion, Matrix6<double>::Zero()}).isZero());
}

TEST_CASE("A camera that stands still gathers no common error", "[stereo_slam][slam]") {
  Vector6<double> sigma;
  sigma << 1e-5, 1e-5, 1e-5, 2e-4, 2e-4, 2e-4;  // points 20 m away
  const Matrix6<double> covariance = sigma.cwiseAbs2().asDiagonal();
  const auto angle = [&](double ahead_m) {
    Vector6<double> motion = Vector6<double>::Zero();
    motion[5] = ahead_m;
    return common_error_per_rad({Pose::exp(motion), covariance})[0];
  };
  CHECK(angle(0.0) == 0.0);
  CHECK(angle(1e-4) == Approx(1e-4));  // 5e-6 of .05 rad
  CHECK(angle(0.5) == Approx(0.5));
  CHECK(angle(1.0) == Approx(1.0));
  CHECK(angle(9.0) == Approx(1.0));
}

TEST_CASE("A frame that a new segment takes over keeps its covariance relative to its own keyframe",
          "[stereo_slam][slam]") {
  KeyframeTrajectory trajectory = drive();
  const PoseGaussian guess{test::car_motion(1.0), Matrix6<double>::Identity()};
  trajectory.append(guess, false);  // frame 6, lost
  trajectory.append(guess, true);
  trajectory.add_keyframe(7, {guess});
  trajectory.replace(6, antipode::inverse(step(1.0)));
  CHECK(trajectory.poses(0.0)[6].pose.is_approx(trajectory.T_world_keyframe(3) * step(1.0).pose.inverse(),
                                                1e-12));
  CHECK(trajectory.relative_covariances()[6] == guess.covariance);
}

TEST_CASE("A correction moves frames with their keyframes and carries later keyframes along",
          "[stereo_slam][slam]") {
  auto trajectory = drive();
  const auto before = trajectory.poses(0.0);
  const Pose motion = test::car_motion(-0.3);
  trajectory.correct({{}, {{motion * before[2].pose, before[2].covariance}}});  // says nothing of keyframe 2
  const auto after = trajectory.poses(0.0);
  CHECK(after[1].pose.is_approx(before[1].pose, 1e-12));
  for (std::size_t frame = 2; frame < 6; ++frame) {
    CAPTURE(frame);
    CHECK(after[frame].pose.is_approx(motion * before[frame].pose, 1e-12));
    CHECK(after[frame].covariance.isApprox(before[frame].covariance, 1e-12));
  }
}

TEST_CASE("The odometry's path does not move with a correction", "[stereo_slam][slam]") {
  auto trajectory = drive();
  const Pose pose = test::car_motion(0.5);
  const Pose before = trajectory.in_odometry_frame(pose);
  trajectory.correct({{}, {{test::car_motion(7.0), Matrix6<double>::Identity()}}});
  CHECK(trajectory.in_odometry_frame(pose).coeffs() == before.coeffs());

  const Pose found = test::car_motion(3.0);
  trajectory.continue_odometry(pose, found);
  CHECK(trajectory.in_odometry_frame(found).is_approx(before, 1e-12));
}

TEST_CASE("Motions are corrected by what was learned of the rig since they were measured",
          "[stereo_slam][slam]") {
  KeyframeTrajectory trajectory;
  trajectory.begin(0);
  trajectory.append({}, true);
  trajectory.append(step(1.0), true);
  PoseGaussian link = step(2.0);
  trajectory.append(link, true);
  MotionChange change{.is_corrected = true};  // 3 cm longer, and twenty times as certain
  change.change[5] = 0.03;
  change.covariance_before(5, 5) = 0.1 * 0.1 * 0.5 * 0.5;
  change.covariance(5, 5) = change.covariance_before(5, 5) / 400.0;
  link.covariance += change.covariance_before;
  trajectory.add_keyframe(2, {link});
  trajectory.append(step(1.0), true);
  const auto before = trajectory.poses(0.0);
  REQUIRE(trajectory.motions().size() == 1);
  CHECK(trajectory.motions()[0].coeffs() == link.pose.coeffs());

  const auto links = trajectory.remeasure({change});
  REQUIRE(links.size() == 1);
  CHECK(links[0].keyframe == 1);
  CHECK(links[0].T_previous_keyframe.pose.is_approx(link.pose.boxplus(change.change), 1e-12));
  const double variance = links[0].T_previous_keyframe.covariance(5, 5);
  CHECK(variance == Approx(step(2.0).covariance(5, 5) + change.covariance(5, 5)).epsilon(1e-9));
  CHECK(trajectory.relative_covariances()[2] == links[0].T_previous_keyframe.covariance);
  CHECK(trajectory.relative_covariances()[1] == step(1.0).covariance);

  const auto after = trajectory.poses(0.0);
  const Vector6<double> half = after[1].pose.boxminus(before[1].pose);
  CHECK(half[5] == Approx(0.015).epsilon(1e-3));  // half way
  CHECK(after[2].pose.is_approx(links[0].T_previous_keyframe.pose, 1e-12));
  // Later frames move along; what they were measured with is the present estimate already.
  CHECK(
      (before[2].pose.inverse() * before[3].pose).is_approx(after[2].pose.inverse() * after[3].pose, 1e-12));
}

TEST_CASE("A frame between keyframes is corrected by its own change, and a keyframe by that of its motion",
          "[stereo_slam][slam]") {
  KeyframeTrajectory trajectory;
  trajectory.begin(0);
  trajectory.append({}, true);
  PoseGaussian between = step(1.0);
  FrameChange own{1, {.is_corrected = true}};  // sideways, and less certain than before
  own.change.change[3] = 0.02;
  own.change.covariance_before(3, 3) = 1e-4;
  own.change.covariance(3, 3) = 4e-4;
  between.covariance += own.change.covariance_before;
  trajectory.append(between, true);
  trajectory.append(step(2.0), true);
  trajectory.add_keyframe(2, {step(2.0)});
  FrameChange of_keyframe = own;  // noted before the frame became one
  of_keyframe.position = 2;
  MotionChange motion{.is_corrected = true};
  motion.change[5] = 0.03;
  (void)trajectory.remeasure({motion}, {own, of_keyframe});
  const auto after = trajectory.poses(0.0);
  CHECK(after[1].pose.is_approx(between.pose.boxplus(own.change.change), 1e-12));
  CHECK(after[2].pose.is_approx(step(2.0).pose.boxplus(motion.change), 1e-12));
  const double variance = step(1.0).covariance(3, 3) + 4e-4;
  CHECK(trajectory.relative_covariances()[1](3, 3) == Approx(variance).epsilon(1e-9));
}

TEST_CASE("What is learned of a motion does not change the tilt that gravity told", "[stereo_slam][slam]") {
  KeyframeTrajectory trajectory;
  trajectory.begin(0);
  trajectory.append({}, true);
  trajectory.append(step(2.0), true);
  const Vector3<double> vertical = Vector3<double>::UnitY();
  const KnownTurn turn{{0.01, 0.0, -0.02}, 1e-6 * Matrix3<double>::Identity()};
  const LevelledLink link = level({}, step(2.0), vertical, turn);
  trajectory.add_keyframe(1, link);
  MotionChange change{.is_corrected = true};
  change.change << 0.03, 0.0, 0.01, 0.0, 0.0, 0.03;
  const auto links = trajectory.remeasure({change});
  REQUIRE(links.size() == 1);
  const PoseGaussian last = trajectory.poses(0.0).back();
  CHECK(last.pose.is_approx(links[0].T_previous_keyframe.pose, 1e-12));
  CHECK((last.pose.rotation_matrix().transpose() * vertical - link.tilt->vertical).norm() < 1e-12);
  // The position does not depend on a turn at its end, and the covariance has the tilt.
  const Pose unlevelled = link.T_previous_keyframe.pose.boxplus(change.change);
  CHECK(last.pose.translation().isApprox(unlevelled.translation(), 1e-12));
  CHECK(last.covariance(0, 0) < 1.1e-6);
  CHECK(last.covariance(1, 1) > 0.9e-4);
}

TEST_CASE("The levelling of a keyframe is shared by the keyframes before", "[stereo_slam][slam]") {
  KeyframeTrajectory trajectory;
  trajectory.begin(0);
  trajectory.append({}, true);
  const Vector3<double> vertical = Vector3<double>::UnitY();
  const double turn_rad = 0.02;  // about z, as are the axes of both keyframes
  LinkedPose path;
  for (std::size_t frame = 1; frame <= 2; ++frame) {
    const PoseGaussian forward{Pose::identity(), 1e-4 * Matrix6<double>::Identity()};
    trajectory.append(forward, true);
    const double mean = frame == 2 ? turn_rad : 0.0;
    LevelledLink link =
        level(path, forward, vertical, {{0.0, 0.0, mean}, 1e-6 * Matrix3<double>::Identity()});
    link.levelling.share_before = 0.25;
    path = add_link(path, link.T_previous_keyframe, true, link.tilt);
    trajectory.add_keyframe(frame, link);
  }
  CHECK(trajectory.spread_levelling());
  (void)trajectory.remeasure(std::vector<MotionChange>(2));
  const auto poses = trajectory.poses(0.0);
  CHECK(poses[1].pose.log()[2] == Approx(0.25 * turn_rad).epsilon(1e-3));
  CHECK(poses[2].pose.log()[2] == Approx(turn_rad));
  CHECK_FALSE(drive().spread_levelling());  // without tilts
}

TEST_CASE("Motions of which nothing was learned stay as they are", "[stereo_slam][slam]") {
  auto trajectory = drive();
  const auto before = trajectory.poses(0.0);
  CHECK(trajectory.remeasure(std::vector<MotionChange>(trajectory.motions().size())).empty());
  for (std::size_t frame = 0; frame < before.size(); ++frame) {
    CHECK(trajectory.poses(0.0)[frame].pose.is_approx(before[frame].pose, 1e-12));
  }
}

TEST_CASE("Predicted frames lie between their measured neighbours", "[stereo_slam][slam]") {
  KeyframeTrajectory trajectory;
  trajectory.append({}, true);
  trajectory.append(step(5.0), false);
  trajectory.append({test::car_motion(2.0), Matrix6<double>::Identity()}, true);
  const double z = trajectory.poses(0.0)[1].pose.translation().z();
  CHECK(z > 0.0);
  CHECK(z < 2.0 + 1e-9);
}

}  // namespace
}  // namespace stereo_slam
