// SPDX-License-Identifier: MIT
// What real rigs do that their calibrations do not say: the images show what the settings and disturbance.csv
// say.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <opencv2/features2d.hpp>
#include <opencv2/video/tracking.hpp>

#include "simulator/recording/simulate.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::simulator;
using namespace stereo_slam::test;

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr PinholeCamera kSmall{400, 160, 230.0, 230.0, 199.3, 79.6};

/// Three frames without noise and without drifting exposure.
SimulationSettings rig_settings() {
  SimulationSettings settings;
  settings.frames = 3;
  settings.camera = kSmall;
  settings.samples_per_pixel = 8;
  settings.texture_size_px = 256;
  settings.sensor.noise_sigma = 0.0;
  settings.sensor.exposure_change = 0.0;
  return settings;
}

cv::Mat image_of(const fs::path& recording, int side, int frame) {
  return cv::imread((recording / fmt::format("image_{}", side) / frame_name(frame)).string(),
                    cv::IMREAD_UNCHANGED);
}

/// Median distance of points of `before`, tracked into `after`, to where `moved` says that they are.
template <class Moved>
double median_error_px(const cv::Mat& before, const cv::Mat& after, const Moved& moved) {
  std::vector<cv::Point2f> from, to;
  cv::goodFeaturesToTrack(before, from, 200, 0.02, 6.0);
  std::vector<unsigned char> found;
  std::vector<float> residuals;
  cv::calcOpticalFlowPyrLK(before, after, from, to, found, residuals);
  std::vector<double> errors;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (found[i] == 0) continue;
    errors.push_back((Vector2d(to[i].x, to[i].y) - moved(Vector2d(from[i].x, from[i].y))).norm());
  }
  REQUIRE(errors.size() > 60);
  std::nth_element(errors.begin(), errors.begin() + static_cast<long>(errors.size() / 2), errors.end());
  return errors[errors.size() / 2];
}

/// Where a camera sees a distant point after it was rotated by `rotation_rad`.
Vector2d rotated(const Vector3d& rotation_rad, const Vector2d& px) {
  const Vector3d ray((px.x() - kSmall.cx) / kSmall.fx, (px.y() - kSmall.cy) / kSmall.fy, 1.0);
  const Vector2d seen = (rotation_matrix(rotation_rad) * ray).hnormalized();
  return {kSmall.fx * seen.x() + kSmall.cx, kSmall.fy * seen.y() + kSmall.cy};
}

/// The rows of disturbance.csv: frame, displacements, rotation, delay.
std::vector<std::vector<double>> disturbances(const fs::path& recording) {
  auto lines = split_lines(read_text(recording / "disturbance.csv"));
  REQUIRE(lines.at(0) == "frame,u_px,v_px,roll_px,pitch_rad,yaw_rad,roll_rad,delay_s");
  std::vector<std::vector<double>> rows;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    std::istringstream cells(lines[i]);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(std::stod(cell));
    REQUIRE(rows.back().size() == 8);
  }
  return rows;
}

constexpr double kTracking_px = 0.05;  // error of tracking without noise

}  // namespace

TEST_CASE("A vibrating right camera sees points where disturbance.csv says", "[simulate][rig]") {
  const TemporaryFolder folder;
  SimulationSettings settings = rig_settings();
  simulator::simulate(settings, folder / "steady");
  CHECK_FALSE(fs::exists(folder / "steady/disturbance.csv"));
  settings.disturbance.vibration_px = 2.0;
  simulator::simulate(settings, folder / "vibrating");
  const auto rows = disturbances(folder / "vibrating");
  REQUIRE(rows.size() == 3);
  for (int i = 0; i < 3; ++i) {
    const auto& row = rows[static_cast<std::size_t>(i)];
    const Vector3d rotation(row[4], row[5], row[6]);
    CHECK(displacement_px(kSmall, rotation).isApprox(Vector3d(row[1], row[2], row[3]), 1e-12));
    CHECK(median_error_px(image_of(folder / "steady", 1, i), image_of(folder / "vibrating", 1, i),
                          [&](const Vector2d& px) { return rotated(rotation, px); }) < kTracking_px);
    CHECK(read_text(folder / "steady/image_0" / frame_name(i)) ==
          read_text(folder / "vibrating/image_0" / frame_name(i)));
  }
  CHECK(read_text(folder / "steady/calib.txt") == read_text(folder / "vibrating/calib.txt"));
}

TEST_CASE("Poses between frames and beyond the ends lie on the screw motions of the steps",
          "[simulate][rig]") {
  CameraPath path;
  for (int i = 0; i < 3; ++i) {
    path.push_back(Eigen::Translation3d(0.1 * i, 0.0, 0.5 * i * i) *
                   Eigen::AngleAxisd(0.2 * i, Eigen::Vector3d::UnitY()));
  }
  CHECK(pose_after(path, 1, 0.0).isApprox(path[1], 1e-15));
  CHECK(pose_after(path, 0, 1.0).isApprox(path[1], 1e-15));
  CHECK(pose_after(path, 2, -2.0).isApprox(path[0], 1e-15));
  const Eigen::Isometry3d quarter = path[0].inverse() * pose_after(path, 0, 0.25);
  CHECK((path[0] * quarter * quarter * quarter * quarter).isApprox(path[1], 1e-12));
  const Eigen::Isometry3d last = path[1].inverse() * path[2];
  CHECK(pose_after(path, 2, 1.0).isApprox(path[2] * last, 1e-12));
  CHECK(pose_after(path, 0, -1.0).isApprox(path[0] * (path[0].inverse() * path[1]).inverse(), 1e-12));
  CHECK(pose_after({path[1]}, 0, 0.7).isApprox(path[1], 1e-15));
}

TEST_CASE("A right image that is exposed one frame later shows what the next one shows", "[simulate][rig]") {
  const TemporaryFolder folder;
  SimulationSettings settings = rig_settings();
  settings.dynamic_objects = 8;
  simulator::simulate(settings, folder / "steady");
  for (const int later : {1, -1}) {
    settings.disturbance.sync_error_s = 0.1 * later;
    const auto name = fmt::format("late{}", later);
    simulator::simulate(settings, folder / name);
    CHECK(disturbances(folder / name)[1][7] == settings.disturbance.sync_error_s);
    cv::Mat difference;
    cv::absdiff(image_of(folder / name, 1, 1), image_of(folder / "steady", 1, 1 + later), difference);
    CHECK(cv::mean(difference)[0] < 0.01);  // poses differ by rounding
    CHECK(read_text(folder / name / "image_0/000001.png") == read_text(folder / "steady/image_0/000001.png"));
  }
}

TEST_CASE("A late right image is displaced by the delay times the motion", "[simulate][rig]") {
  const TemporaryFolder folder;
  constexpr double kTurn_rad = 0.03;  // from frame to frame, to the right
  std::string poses;
  for (int i = 0; i < 3; ++i)
    poses +=
        fmt::format("{0} 0 {1} 0 0 1 0 0 -{1} 0 {0} 0\n", std::cos(kTurn_rad * i), std::sin(kTurn_rad * i));
  write_text(folder / "poses.txt", poses);
  SimulationSettings settings = rig_settings();
  settings.trajectory = folder / "poses.txt";
  settings.baseline_m = 1e-3;  // the turn hardly moves the right camera
  simulator::simulate(settings, folder / "steady");
  settings.disturbance.sync_error_s = 0.04;
  simulator::simulate(settings, folder / "late");
  for (int i = 0; i < 3; ++i) {  // the last one by extrapolation
    const Vector3d rotation(0.0, -0.4 * kTurn_rad, 0.0);
    CHECK(median_error_px(image_of(folder / "steady", 1, i), image_of(folder / "late", 1, i),
                          [&](const Vector2d& px) { return rotated(rotation, px); }) < kTracking_px);
  }
}

TEST_CASE("A lens error moves points of both images to r (1 + k1 r^2 + k2 r^4)", "[simulate][rig]") {
  const TemporaryFolder folder;
  SimulationSettings settings = rig_settings();
  settings.frames = 2;
  settings.lens_error.k1 = 1e-12;  // ideal, but resampled in the same way
  simulator::simulate(settings, folder / "ideal");
  settings.lens_error = {.k1 = -0.026, .k2 = 0.013};  // of KITTI: towards the centre
  simulator::simulate(settings, folder / "bent");
  const auto bent = [](const Vector2d& px) {
    const Vector2d centre(kSmall.cx, kSmall.cy);
    const double r2 = (px - centre).squaredNorm() / (kSmall.fx * kSmall.fx);
    return Vector2d(centre + (px - centre) * (1.0 - 0.026 * r2 + 0.013 * r2 * r2));
  };
  for (const int side : {0, 1}) {
    const cv::Mat ideal = image_of(folder / "ideal", side, 0);
    const cv::Mat with = image_of(folder / "bent", side, 0);
    const double error = median_error_px(ideal, with, bent);
    CHECK(error < kTracking_px);
    CHECK(median_error_px(ideal, with, [](const Vector2d& px) { return px; }) > 2.0 * error);
    CHECK(median_error_px(ideal, with, [&](const Vector2d& px) { return Vector2d(2.0 * px - bent(px)); }) >
          4.0 * error);
  }
  CHECK(read_text(folder / "ideal/calib.txt") == read_text(folder / "bent/calib.txt"));
}

TEST_CASE("The ground truth of a ride contains it, and the images show its pitch", "[simulate][rig]") {
  const TemporaryFolder folder;
  SimulationSettings settings = rig_settings();
  simulator::simulate(settings, folder / "smooth");
  settings.ride.bounce_m = 0.02;
  simulator::simulate(settings, folder / "rough");
  const auto road = camera_path(settings);
  const auto truth = read_trajectory(folder / "rough/poses.txt").poses;
  const auto path = on_bad_road(road, settings.ride, settings.fps, settings.seed);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    CHECK(truth[i].isApprox(path[i], 1e-15));
    const Eigen::AngleAxisd turned((truth[i].inverse() * road[i]).linear());
    const cv::Mat smooth = image_of(folder / "smooth", 0, static_cast<int>(i));
    const cv::Mat rough = image_of(folder / "rough", 0, static_cast<int>(i));
    // Near points move by the bounce as well, at most 230 px * 0.04 m / 5 m.
    CHECK(median_error_px(smooth, rough, [&](const Vector2d& px) {
            return rotated(turned.angle() * turned.axis(), px);
          }) < 1.0);
  }
}

TEST_CASE("A lens error that folds the image is refused", "[simulate][rig]") {
  const PinholeCamera wide{1000, 1000, 400.0, 400.0, 499.5, 499.5};  // corners at a radius of 1.8
  for (const LensError good : {LensError{}, {-0.026, 0.013}, {0.5, 0.5}, {-0.5, 0.25}})
    CHECK_NOTHROW(validate(good, wide));
  for (const LensError bad : {LensError{-0.5, 0.0}, {0.0, -0.2}, {-1.0, 0.5}})
    CHECK_THROWS_WITH(validate(bad, wide), Catch::Contains("folds"));
}

TEST_CASE("A disturbed recording that is stopped lists the frames that it has", "[simulate][rig]") {
  const TemporaryFolder folder;
  SimulationSettings settings = rig_settings();
  settings.frames = 40;
  settings.disturbance.vibration_px = 1.0;
  simulator::simulate(settings, folder / "seq", [](int done, int) { return done < 2; });
  CHECK(disturbances(folder / "seq").size() == read_trajectory(folder / "seq/poses.txt").poses.size());
}

TEST_CASE("Disturbances out of range are refused by name before anything is written", "[simulate][rig]") {
  const TemporaryFolder folder;
  const auto refuse = [&](const char* name, const auto& set) {
    for (const double value : {std::nan(""), -1e9, 1e9}) {
      SimulationSettings settings = rig_settings();
      set(settings, value);
      CHECK_THAT(message_of([&] { simulator::simulate(settings, folder / "seq"); }), Catch::Contains(name));
      CHECK_THROWS_AS(simulator::simulate(settings, folder / "seq"), std::invalid_argument);
      CHECK_FALSE(fs::exists(folder / "seq"));
    }
  };
  refuse("vibration_px", [](auto& s, double value) { s.disturbance.vibration_px = value; });
  refuse("vibration_frames", [](auto& s, double value) { s.disturbance.vibration_frames = value; });
  refuse("lens_error", [](auto& s, double value) { s.lens_error.k1 = value; });
  refuse("lens_error", [](auto& s, double value) { s.lens_error.k2 = value; });
  refuse("drift_px", [](auto& s, double value) { s.disturbance.drift_px = value; });
  refuse("bounce_m", [](auto& s, double value) { s.ride.bounce_m = value; });
  refuse("sync_error_s", [](auto& s, double value) { s.disturbance.sync_error_s = value; });
}
