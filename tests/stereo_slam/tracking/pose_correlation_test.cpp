// SPDX-License-Identifier: MIT
#include <Eigen/Cholesky>

#include "stereo_slam/local_map/local_map.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/tracking/predict.hpp"
#include "stereo_slam/tracking/update.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// Mean NEES of the pose after a drive of `frames` past landmarks that were triangulated once, with the
/// covariance for noise that is as assumed.
double mean_nees(int runs, int frames, bool track_correlation, double inverse_dof = 0.0) {
  const StereoCamera camera = test::kitti_camera();
  Settings settings;
  settings.update.robust_cap = 1e3;
  settings.update.student_t_inverse_dof = inverse_dof;
  MapSettings map_settings;
  map_settings.pixel_sigma_px = 0.5;
  const StereoFrame frame{0, 0, cv::Mat(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar(80)), {}};
  PoseGaussian noise;
  noise.covariance.diagonal() << Vector3<double>::Constant(4e-8), Vector3<double>::Constant(4e-6);
  double sum = 0.0;
  for (int run = 0; run < runs; ++run) {
    std::mt19937_64 random(static_cast<unsigned>(run));
    std::normal_distribution<double> normal;
    std::vector<Vector3<double>> points;
    std::vector<StereoPoint> seen;
    while (points.size() < 60) {
      const StereoPoint z = test::random_measurement(random, camera, 12.0, 40.0);
      points.push_back(camera.back_project(z));
      seen.push_back(z + test::stereo_noise(random, 0.5));
    }
    LocalMap map(camera, map_settings);
    map.add(test::points_at(seen), std::vector<std::uint32_t>(seen.size()), {}, frame);
    PoseGaussian state{Pose::identity(), 1e-10 * Matrix6<double>::Identity()};
    Pose truth = Pose::identity();
    for (int k = 0; k < frames; ++k) {
      truth = truth * test::car_motion(0.4);
      Vector6<double> error;
      for (double& e : error) e = normal(random);
      PoseGaussian odometry = noise;
      odometry.pose =
          test::car_motion(0.4).boxplus(noise.covariance.diagonal().cwiseSqrt().cwiseProduct(error));
      const auto prior = predict_pose(state, odometry);
      if (track_correlation) map.predict_correlation(odometry.pose.inverse().adjoint());
      std::vector<Match> matches;
      for (const auto& p : project_landmarks(map.view(), prior, 1e3)) {
        const auto z = camera.project(truth.inverse() * points[p.index]);
        if (!z || !camera.in_view(*z)) continue;
        const StereoPoint measured = *z + test::stereo_noise(random, 0.5);
        matches.push_back({p.index, measured, measured.head<2>(), stereo_pixel_covariance(0.5), p});
      }
      const auto update = update_pose(prior, matches, map.view(), settings.update);
      REQUIRE(update.converged);
      if (track_correlation) map.update_correlation(prior, update.posterior.pose, update.used);
      state = update.posterior;
    }
    const Vector6<double> error = truth.boxminus(state.pose);
    const Matrix6<double> covariance = expected_variance_ratio(settings.update) * state.covariance;
    sum += error.dot(covariance.ldlt().solve(error)) / runs;
  }
  return sum;
}

TEST_CASE("Tracking the correlation of pose and landmarks keeps the pose's covariance consistent",
          "[stereo_slam][update]") {
  // The mean of 100 chi-squares with six degrees has a standard deviation of 0.35.
  const double tracked = mean_nees(100, 12, true);
  const double forgotten = mean_nees(100, 12, false);
  CAPTURE(tracked, forgotten);
  CHECK(std::abs(tracked - 6.0) < 1.05);
  CHECK(forgotten > 8.0);
}

TEST_CASE("With weights by residuals, the tracked correlation keeps it consistent, too",
          "[stereo_slam][update]") {
  const double tracked = mean_nees(100, 12, true, UpdateSettings{}.student_t_inverse_dof);
  CAPTURE(tracked);
  CHECK(std::abs(tracked - 6.0) < 1.5);
}

}  // namespace
}  // namespace stereo_slam
