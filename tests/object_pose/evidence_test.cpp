// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "object_pose/belief.hpp"
#include "object_pose/pose_evidence.hpp"
#include "object_pose/render.hpp"
#include "support/catch.hpp"

namespace {

using namespace object_pose;

constexpr double kDegree = std::numbers::pi / 180.0;

/// What SIFT would see of a small pattern at T_camera_feature with a gradient along its x axis.
SeenFeature seen_without_error(const Pose& T_camera_feature, double diameter_m, const StereoCamera& camera) {
  const Eigen::Vector3d p = T_camera_feature.translation();
  const Eigen::Matrix2d A =
      camera.projection_jacobian(p).topRows<2>() * T_camera_feature.rotation_matrix().leftCols<2>();
  const Eigen::Vector2d gradient = A.inverse().transpose().col(0);
  return {camera.project_unchecked(p), std::atan2(gradient.y(), gradient.x()),
          diameter_m * std::sqrt(std::abs(A.determinant()))};
}

/// A feature at p, tilted across the line of sight and rolled.
Pose tilted_feature(const Eigen::Vector3d& p, const Eigen::Vector3d& tilt, double roll_rad) {
  const auto to_sight = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), p);
  const Eigen::Matrix3d R = (to_sight * Eigen::AngleAxisd(tilt.norm(), tilt.stableNormalized()) *
                             Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()))
                                .toRotationMatrix();
  return Pose::from_matrix(R, p);
}

TEST_CASE("A feature seen at the tilt of a base element has the pose of this element", "[object_pose]") {
  const StereoCamera camera = SceneSettings{}.camera;
  const EvidenceSettings settings;
  for (const double roll_deg : {-170.0, -40.0, 3.0, 77.0}) {
    for (int k = -1; k < 6; ++k) {
      const double angle = k * 60.0 * kDegree;
      const Eigen::Vector3d tilt =
          k < 0 ? Eigen::Vector3d::Zero().eval()
                : (settings.ring_rad * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0)).eval();
      const Pose truth = tilted_feature({0.2, -0.1, 1.1}, tilt, roll_deg * kDegree);
      const Belief feature = feature_pose(seen_without_error(truth, 0.01, camera), 0.01, camera);
      REQUIRE(feature.size() == 7);
      const auto& element = feature[static_cast<std::size_t>(k + 1)];
      CHECK(element.density.pose().boxminus(truth).norm() < 1e-9);
    }
  }
}

TEST_CASE("Base elements are narrower than the gate of the fusion", "[object_pose]") {
  const StereoCamera camera = SceneSettings{}.camera;
  const Pose pose = tilted_feature({0.0, 0.05, 0.8}, {0.3, -0.2, 0.0}, 0.4);
  for (const auto& element : feature_pose(seen_without_error(pose, 0.01, camera), 0.01, camera)) {
    const Eigen::Matrix3d uu = element.density.covariance().topLeftCorner<3, 3>();
    const double widest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(uu).eigenvalues()[2];
    CHECK(std::sqrt(widest) < 15.0 * kDegree);
  }
}

TEST_CASE("A pattern that appears small is likely tilted", "[object_pose]") {
  const StereoCamera camera = SceneSettings{}.camera;
  const Pose facing = tilted_feature({0.0, 0.0, 1.0}, Eigen::Vector3d::Zero(), 0.0);
  SeenFeature seen = seen_without_error(facing, 0.01, camera);
  const double weight_facing = feature_pose(seen, 0.01, camera)[0].weight;
  seen.diameter_px *= 0.75;
  CHECK(feature_pose(seen, 0.01, camera)[0].weight < 0.5 * weight_facing);
}

TEST_CASE("Composition with a lever has the moments of draws", "[object_pose]") {
  const StereoCamera camera = SceneSettings{}.camera;
  const Pose pose = tilted_feature({0.1, 0.0, 0.9}, {0.2, 0.1, 0.0}, 0.0);
  const Belief feature = feature_pose(seen_without_error(pose, 0.01, camera), 0.01, camera);
  const Pose lever =
      Pose::from_rotation_translation(Eigen::Vector4d(0.8, 0.0, 0.6, 0.0), Eigen::Vector3d(0.1, 0.05, 0.1));
  const Belief moved = compose_with_lever(feature, lever);
  constexpr int kDraws = 20000;
  std::mt19937_64 rng(1);
  Eigen::Matrix3Xd t(3, kDraws), t_moved(3, kDraws);
  for (int k = 0; k < kDraws; ++k) {
    t.col(k) = (feature.sample(rng) * lever).translation();
    t_moved.col(k) = moved.sample(rng).translation();
  }
  const Eigen::Vector3d mean = t.rowwise().mean();
  const Eigen::Matrix3Xd d = t.colwise() - mean;
  const Eigen::Vector3d variance = d.array().square().rowwise().mean();
  const Eigen::Matrix3Xd d_moved = t_moved.colwise() - mean;
  for (int i = 0; i < 3; ++i) {
    // The renormalised density of draws and of the moments differ by the order of tr Sigma_uu, 5 %.
    CHECK(std::abs(d_moved.row(i).mean()) <
          0.05 * std::sqrt(variance[i]) + 5.0 * std::sqrt(2.0 * variance[i] / kDraws));
    CHECK(d_moved.row(i).squaredNorm() / kDraws == Approx(variance[i]).epsilon(0.1));
  }
}

}  // namespace
