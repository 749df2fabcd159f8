// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/point_tracks.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "stereo_slam/odometry/odometry.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr int kDisparity_px = 12;
const StereoCamera kCamera{200.0, 200.0, 160.0, 90.0, 0.5, 320, 180};
const double kDepth_m = kCamera.fx * kCamera.baseline_m / kDisparity_px;

/// A textured wall parallel to the images, seen after the camera has moved sideways: the wall moves to the
/// left by `flow_px` in both images.
StereoFrame wall(std::size_t index, int flow_px) {
  cv::Mat texture(220, 480, CV_8UC1);
  cv::RNG random(7);
  random.fill(texture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(texture, texture, {0, 0}, 1.5);
  cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  const auto view = [&](int x) { return texture({x, 10, kCamera.width_px, kCamera.height_px}).clone(); };
  return {index, 0, view(40 + flow_px), view(40 + flow_px + kDisparity_px)};
}

StereoView view_of(const StereoFrame& frame) { return {frame, kCamera, PairGeometry(kCamera)}; }

Pose sideways(double flow_px) {
  Vector6<double> xi = Vector6<double>::Zero();
  xi[3] = flow_px * kDepth_m / kCamera.fx;
  return Pose::exp(xi);
}

Settings track_settings() {
  Settings result;
  result.stereo.max_disparity_px = 30;
  result.odometry.max_points = 60;
  result.odometry.cell_px = 40;
  return result;
}

/// Follows the tracks from one frame to another, with a motion model that expects no motion.
OdometryResult step(PointTracks& tracks, const StereoFrame& from, const StereoFrame& to) {
  const auto previous = build_pyramids(from);
  const auto current = build_pyramids(to);
  return odometry_from_tracks(tracks, {previous, current}, view_of(to), {Pose::identity()}, track_settings());
}

TEST_CASE("Points are followed and give the motion", "[stereo_slam][odometry]") {
  const StereoFrame first = wall(0, 0);
  const StereoFrame second = wall(1, 5);
  PointTracks tracks;
  tracks.replenish(view_of(first), {}, track_settings());
  const auto begun = tracks.points();
  REQUIRE(begun.size() >= 30);
  for (const auto& point : begun) CHECK(std::abs(point.z.z() - kDisparity_px) < 0.05);

  const auto odometry = step(tracks, first, second);
  REQUIRE(odometry.valid);
  CHECK((odometry.T_previous_current.pose.translation() - sideways(5.0).translation()).norm() < 0.01);
  CHECK(tracks.points().size() >= begun.size() * 3 / 4);
  CHECK(odometry.inliers.size() == tracks.points().size());
  for (const auto& point : tracks.points()) {
    CHECK((point.z - *point.previous - Vector3<double>(-5.0, 0.0, 0.0)).norm() < 0.1);
  }
}

TEST_CASE("Points are followed over a motion that nothing announced", "[stereo_slam][odometry]") {
  const StereoFrame first = wall(0, 0);
  PointTracks tracks;
  tracks.replenish(view_of(first), {}, track_settings());
  const auto odometry = step(tracks, first, wall(1, 25));
  REQUIRE(odometry.valid);
  CHECK((odometry.T_previous_current.pose.translation() - sideways(25.0).translation()).norm() < 0.05);
}

TEST_CASE("The points have the disparity of the rectification at hand", "[stereo_slam][odometry]") {
  const StereoFrame frame = wall(0, 0);
  PairGeometry::Coefficients offset = PairGeometry::Coefficients::Zero();
  offset(0, 0) = 0.4;
  const PairGeometry before(kCamera);
  const PairGeometry after(kCamera, offset);
  PointTracks tracks;
  tracks.replenish({frame, kCamera, before}, {}, track_settings());
  const auto begun = tracks.points();
  tracks.remeasure({before, after});
  REQUIRE(tracks.points().size() == begun.size());
  for (std::size_t i = 0; i < begun.size(); ++i) {
    CHECK(std::abs(tracks.points()[i].z.z() - begun[i].z.z() - 0.4) < 1e-9);
    CHECK(tracks.points()[i].z.head<2>() == begun[i].z.head<2>());
  }
}

TEST_CASE("Points that moved with the camera are static", "[stereo_slam][odometry]") {
  const StereoFrame first = wall(0, 0);
  PointTracks tracks;
  tracks.replenish(view_of(first), {}, track_settings());
  (void)step(tracks, first, wall(1, 5));
  const auto static_after = [&](const std::optional<Pose>& motion, int frames) {
    tracks.compare_with(motion, kCamera, 0.4);
    return std::all_of(tracks.points().begin(), tracks.points().end(),
                       [&](const TrackedPoint& point) { return point.static_frames == frames; });
  };
  const auto evidence = [&] { return correspondences(tracks.points()).front().static_evidence; };
  CHECK(static_after(sideways(5.0), 1));
  const double after_one = evidence();
  CHECK(after_one > 1.0);
  CHECK(static_after(sideways(5.0), 2));
  CHECK(evidence() > after_one);
  CHECK(static_after(sideways(-5.0), 0));
  CHECK(evidence() == 1.0);
  CHECK(static_after(sideways(5.0), 1));
  CHECK(static_after(std::nullopt, 0));
  for (int i = 0; i < 1000; ++i) tracks.compare_with(sideways(5.0), kCamera, 0.4);
  CHECK(evidence() <= 4.0);  // what was static for long may start to move
}

TEST_CASE("Points near the landmarks are dropped, and new ones keep away from them",
          "[stereo_slam][odometry]") {
  const StereoFrame frame = wall(0, 0);
  PointTracks tracks;
  tracks.replenish(view_of(frame), {}, track_settings());
  const auto landmarks_px = tracks.positions();
  tracks.replenish(view_of(frame), landmarks_px, track_settings());
  REQUIRE(tracks.points().size() >= 20);
  for (const auto& px : tracks.positions()) {
    for (const auto& landmark_px : landmarks_px) {
      CHECK((px - landmark_px).norm() > track_settings().odometry.exclusion_px);
    }
  }
}

TEST_CASE("Nothing is followed into another scene or a black image, and nothing breaks",
          "[stereo_slam][odometry]") {
  const StereoFrame first = wall(0, 0);
  StereoFrame black = wall(1, 0);
  black.left.setTo(0);
  black.right.setTo(0);
  StereoFrame mirrored = wall(1, 0);
  cv::flip(mirrored.left, mirrored.left, 0);
  cv::flip(mirrored.right, mirrored.right, 0);
  for (const auto& second : {black, mirrored}) {
    PointTracks tracks;
    tracks.replenish(view_of(first), {}, track_settings());
    const auto odometry = step(tracks, first, second);
    CHECK_FALSE(odometry.valid);
    tracks.replenish(view_of(second), {}, track_settings());
    (void)step(tracks, second, first);
  }
  PointTracks none;
  CHECK_FALSE(step(none, first, wall(1, 5)).valid);
}

}  // namespace
}  // namespace stereo_slam
