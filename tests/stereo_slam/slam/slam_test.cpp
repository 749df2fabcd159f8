// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/slam.hpp"

#include <Eigen/Cholesky>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "simulator/recording/simulate.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr int kFrames = 24;

/// A short drive along a rendered street, rendered once.
struct Recording {
  StereoCamera camera{360.0, 360.0, 310.0, 93.0, 0.5371657, 620, 188};
  std::vector<StereoFrame> frames;
  std::vector<Eigen::Isometry3d> truth;
};

const Recording& straight_recording() {
  static const Recording rendered = [] {
    Recording result;
    simulator::SimulationSettings settings;
    settings.frames = kFrames;
    settings.camera = {result.camera.width_px, result.camera.height_px, result.camera.fx,
                       result.camera.fy,       result.camera.cx,        result.camera.cy};
    settings.baseline_m = result.camera.baseline_m;
    const test::TemporaryFolder folder;
    simulator::simulate(settings, folder.path());
    for (int i = 0; i < kFrames; ++i) {
      StereoFrame frame;
      frame.index = static_cast<std::size_t>(i);
      frame.stamp_ns = 100'000'000LL * i;
      frame.left =
          cv::imread((folder.path() / "image_0" / test::frame_name(i)).string(), cv::IMREAD_GRAYSCALE);
      frame.right =
          cv::imread((folder.path() / "image_1" / test::frame_name(i)).string(), cv::IMREAD_GRAYSCALE);
      result.frames.push_back(frame);
    }
    result.truth = read_trajectory(folder.path() / "poses.txt").poses;
    return result;
  }();
  return rendered;
}

std::vector<FrameResult> run(const Settings& settings) {
  const auto slam = make_slam_system(straight_recording().camera, settings);
  std::vector<FrameResult> results;
  for (const auto& frame : straight_recording().frames) results.push_back(slam->process(frame));
  return results;
}

double end_error_m(const std::vector<FrameResult>& results) {
  const Eigen::Isometry3d travelled =
      straight_recording().truth.front().inverse() * straight_recording().truth.back();
  return (results.back().T_world_camera.pose.translation() - travelled.translation()).norm();
}

double path_length_m() {
  double length = 0.0;
  for (std::size_t i = 1; i < straight_recording().truth.size(); ++i) {
    length += (straight_recording().truth[i].translation() - straight_recording().truth[i - 1].translation())
                  .norm();
  }
  return length;
}

TEST_CASE("The common error of a fast run, in pixels, is larger; frames report it as an angle",
          "[stereo_slam][slam]") {
  Settings settings = preset_settings("fast");
  CHECK(settings.calibration.common_error_px > Settings{}.calibration.common_error_px);
  settings.calibration.common_error_px = 0.5;
  const auto results = run(settings);
  const double fx = straight_recording().camera.fx;
  CHECK(results.back().calibration.common_error_rad == Approx(0.5 / fx));
}

TEST_CASE("The default preset follows a rendered street to a hundredth of the way", "[stereo_slam][slam]") {
  const auto results = run(Settings{});
  CHECK(results.front().status == TrackingStatus::kInitializing);
  for (std::size_t i = 1; i < results.size(); ++i) {
    CAPTURE(i);
    CHECK(results[i].status == TrackingStatus::kOk);
    CHECK(results[i].T_world_camera.covariance.llt().info() == Eigen::Success);
  }
  CAPTURE(end_error_m(results), path_length_m());
  CHECK(end_error_m(results) < 0.01 * path_length_m());
}

TEST_CASE("The fast preset follows it as well, with fewer landmarks", "[stereo_slam][slam]") {
  const auto results = run(preset_settings("fast"));
  for (std::size_t i = 1; i < results.size(); ++i) {
    CAPTURE(i);
    CHECK(results[i].status == TrackingStatus::kOk);
    CHECK(results[i].landmarks <= 200);
  }
  CAPTURE(end_error_m(results), path_length_m());
  CHECK(end_error_m(results) < 0.01 * path_length_m());
}

TEST_CASE("The paper preset follows it too", "[stereo_slam][slam]") {
  const auto results = run(preset_settings("paper"));
  CAPTURE(end_error_m(results), path_length_m());
  CHECK(end_error_m(results) < 0.05 * path_length_m());
}

TEST_CASE("Two runs give the same bits, whatever the number of threads", "[stereo_slam][slam]") {
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const auto one = run(Settings{});
  cv::setNumThreads(2);
  const auto two = run(Settings{});
  cv::setNumThreads(threads);
  for (std::size_t i = 0; i < one.size(); ++i) {
    CHECK(one[i].T_world_camera.pose.coeffs() == two[i].T_world_camera.pose.coeffs());
    CHECK(one[i].T_world_camera.covariance == two[i].T_world_camera.covariance);
  }
}

TEST_CASE("Landmarks that are culled in a keyframe do not disturb the rectification", "[stereo_slam][slam]") {
  Settings settings;
  settings.keyframes.min_match_ratio = 0.3;  // keyframes that live long
  settings.map.cull_after_frames = 1;
  Slam slam(straight_recording().camera, settings);
  for (const auto& frame : straight_recording().frames) (void)slam.process(frame);
  slam.finish();
  const PairGeometry learned(straight_recording().camera, slam.saved_map().rectification.coefficients);
  const Vector2<double> offset_px = learned.rms_offset_px();  // over the image; the calibration is exact
  CAPTURE(learned.coefficients(), offset_px);
  CHECK(offset_px.x() < 0.02);  // of the disparity
  CHECK(offset_px.y() < 0.05);  // of the rows
}

TEST_CASE("Black frames are reported lost, with growing uncertainty, and tracking goes on afterwards",
          "[stereo_slam][slam]") {
  const std::string preset = GENERATE("default", "odometry");
  CAPTURE(preset);
  Slam slam(straight_recording().camera, preset_settings(preset));
  const cv::Mat black(straight_recording().camera.height_px, straight_recording().camera.width_px, CV_8UC1,
                      cv::Scalar(0));
  std::vector<FrameResult> results;
  for (auto frame : straight_recording().frames) {
    if (frame.index >= 8 && frame.index < 11) frame.left = frame.right = black;
    results.push_back(slam.process(frame));
  }
  REQUIRE(results.size() == kFrames);
  for (std::size_t i = 8; i < 11; ++i) {
    CHECK(results[i].status == TrackingStatus::kLost);
    CHECK(results[i].T_world_camera.covariance(5, 5) > results[i - 1].T_world_camera.covariance(5, 5));
  }
  CHECK(results.back().status == TrackingStatus::kOk);
  CHECK(slam.trajectory().size() == kFrames);
  for (const auto& pose : slam.trajectory()) CHECK(pose.pose.coeffs().allFinite());
}

TEST_CASE("A run that is lost before its first motion goes on in its first segment, with a wide gap",
          "[stereo_slam][slam]") {
  Slam slam(straight_recording().camera, Settings{});
  std::vector<FrameResult> results;
  for (auto frame : straight_recording().frames) {
    if (frame.index == 0) {  // a scene that no later frame shows
      cv::Mat left, right;
      cv::flip(frame.right, left, 1);
      cv::flip(frame.left, right, 1);
      frame.left = left;
      frame.right = right;
    }
    results.push_back(slam.process(frame));
  }
  CHECK(results[1].status == TrackingStatus::kLost);
  CHECK(results[2].status == TrackingStatus::kWeak);
  for (std::size_t i = 3; i < results.size(); ++i) {
    CHECK(results[i].status == TrackingStatus::kOk);
    CHECK(results[i].segment == 0);
  }
  // The motion before the first measured one is taken for the same, with the deviation of a changed velocity.
  const PoseGaussian second = slam.trajectory()[2];
  const auto step =
      Pose::from_isometry(straight_recording().truth[1].inverse() * straight_recording().truth[2]);
  CHECK((second.pose.translation() - 2.0 * step.translation()).norm() < 0.1);
  CHECK(second.covariance(5, 5) > 0.2);
}

TEST_CASE("A frame that is blurred by motion has a larger covariance, and its error is inside",
          "[stereo_slam][slam]") {
  constexpr std::size_t kBlurred = 10;
  const auto sharp = run(Settings{});
  Slam slam(straight_recording().camera, Settings{});
  FrameResult blurred;
  for (std::size_t i = 0; i <= kBlurred; ++i) {
    StereoFrame frame = straight_recording().frames[i];
    if (i == kBlurred) {
      for (cv::Mat* image : {&frame.left, &frame.right}) cv::blur(image->clone(), *image, {9, 1});
    }
    blurred = slam.process(frame);
  }
  CHECK(blurred.status == TrackingStatus::kOk);
  constexpr int kHeading = 1;
  CHECK(blurred.relative_covariance(kHeading, kHeading) >
        4.0 * sharp[kBlurred].relative_covariance(kHeading, kHeading));
  const auto& [pose, covariance] = blurred.T_world_camera;
  const auto truth = Pose::from_isometry(straight_recording().truth.front().inverse() *
                                         straight_recording().truth[kBlurred]);
  const Vector6<double> error = truth.boxminus(pose);
  CHECK(error.dot(covariance.llt().solve(error)) < 12.6);
}

TEST_CASE("A frame in which hardly a landmark is found is not called certain", "[stereo_slam][slam]") {
  Slam slam(straight_recording().camera, Settings{});
  for (std::size_t i = 0; i <= 10; ++i) {
    StereoFrame frame = straight_recording().frames[i];
    if (i == 10) {
      for (cv::Mat* image : {&frame.left, &frame.right}) cv::blur(image->clone(), *image, {61, 1});
    }
    const auto result = slam.process(frame);
    CAPTURE(i, result.matches);
    if (i == 10) CHECK((result.status == TrackingStatus::kWeak || result.status == TrackingStatus::kLost));
  }
}

TEST_CASE("A frame that is passed over says why, also when it is lost", "[stereo_slam][slam]") {
  const std::string preset = GENERATE("default", "paper", "odometry");
  CAPTURE(preset);
  const auto slam = make_slam_system(straight_recording().camera, preset_settings(preset));
  for (std::size_t i = 0; i < 10; ++i) {
    StereoFrame frame = straight_recording().frames[std::min<std::size_t>(i, 5)];
    frame.index = i;
    frame.stamp_ns = straight_recording().frames[i].stamp_ns;
    if (i == 9) frame.left_fault = frame.right_fault = "missing";
    const auto result = slam->process(frame);
    CAPTURE(i);
    CHECK(result.weak.repeated_image == (i > 5 && i < 9));
    if (i == 6) CHECK(result.status == TrackingStatus::kWeak);
    if (i > 6) CHECK(result.status == TrackingStatus::kLost);
    if (i == 9) CHECK(result.weak.right_image_unfit);
  }
}

TEST_CASE("A calibration error that is stated is in the covariance, with every system",
          "[stereo_slam][slam]") {
  const std::string preset = GENERATE("default", "paper", "odometry");
  CAPTURE(preset);
  Settings settings = preset_settings(preset);
  settings.calibration.scale_sigma = 0.2;
  const auto results = run(settings);
  const auto& [pose, covariance] = results.back().T_world_camera;
  CHECK(results.back().calibration.scale_sigma >= 0.2);
  const double length_m = pose.translation().norm();
  CHECK(std::sqrt(covariance.bottomRightCorner<3, 3>().trace()) >= 0.19 * length_m);
}

TEST_CASE("The largest pyramid that may be asked for is cut to the image", "[stereo_slam][slam]") {
  Settings settings;
  settings.features.count = 20000;
  settings.odometry.window_px = 21;
  Slam slam(straight_recording().camera, settings);
  CHECK(slam.process(straight_recording().frames[0]).status == TrackingStatus::kInitializing);
  CHECK(slam.process(straight_recording().frames[1]).status == TrackingStatus::kOk);
}

TEST_CASE("Before the map begins nothing is claimed of the pose", "[stereo_slam][slam]") {
  constexpr std::size_t kDark = 4;
  const auto darken = [](cv::Mat& image, double factor) {
    cv::Mat dark;
    image.convertTo(dark, -1, factor);
    image = dark;
  };
  Slam slam(straight_recording().camera, Settings{});
  std::string letters;
  for (std::size_t i = 0; i < kDark + 2; ++i) {
    StereoFrame frame = straight_recording().frames[i];
    if (i < kDark) darken(frame.left, 0.02 + 0.01 * static_cast<double>(i));  // no two are identical
    if (i < kDark) darken(frame.right, 0.02);
    const auto result = slam.process(frame);
    letters += *to_string(result.status);
    const double sigma_m = std::sqrt(result.T_world_camera.covariance(5, 5));
    if (i < kDark) CHECK(sigma_m == Approx(100.0).epsilon(0.01));
    if (i >= kDark) CHECK(sigma_m < 0.05);
  }
  CHECK(letters == "LLLLIO");
  const auto trajectory = slam.trajectory();
  CHECK(std::sqrt(trajectory[kDark - 1].covariance(5, 5)) == Approx(100.0).epsilon(0.01));
  CHECK(std::sqrt(trajectory[kDark].covariance(5, 5)) < 1e-4);
}

TEST_CASE("Images without features do no harm", "[stereo_slam][slam]") {
  Slam slam(straight_recording().camera, Settings{});
  StereoFrame frame = straight_recording().frames.front();
  frame.left = frame.right = cv::Mat(frame.left.size(), CV_8UC1, cv::Scalar(128));
  for (std::size_t i = 0; i < 4; ++i) {
    frame.index = i;
    const auto result = slam.process(frame);
    CHECK(result.T_world_camera.pose.coeffs().allFinite());
    CHECK(result.status != TrackingStatus::kOk);
  }
  CHECK(slam.map_points().empty());
}

TEST_CASE("The pose before a chessboard that moves is never called certain", "[stereo_slam][slam]") {
  for (const int side : {16, 32, 100}) {
    for (const double step_px : {0.0, 5.0, 20.0}) {
      CAPTURE(side, step_px);
      Slam slam({500.0, 500.0, 320.0, 240.0, 0.12, 640, 480}, Settings{});
      StereoFrame frame;
      for (frame.index = 0; frame.index < 8; ++frame.index) {
        const double moved = step_px * static_cast<double>(frame.index);
        const double noise = 2.0 + 0.01 * static_cast<double>(frame.index);  // no image is repeated
        frame.stamp_ns = 100'000'000LL * static_cast<std::int64_t>(frame.index);
        frame.left = test::chessboard({640, 480}, side, moved, noise);
        frame.right = test::chessboard({640, 480}, side, moved + 20.0, noise);
        const auto result = slam.process(frame);
        CHECK(result.status != TrackingStatus::kOk);
        CHECK(result.T_world_camera.pose.coeffs().allFinite());
      }
    }
  }
}

TEST_CASE("Features are spread over the image", "[stereo_slam][images]") {
  const auto& frame = straight_recording().frames.front();
  FeatureSettings settings;
  settings.count = 500;
  const auto features = extract_features(frame.left, settings);
  CHECK(features.size() > 250);
  CHECK(features.size() < 700);
  std::vector<int> quarter(4);
  for (const auto& f : features) {
    const int column = std::min(3, static_cast<int>(4.0 * f.position_px.x() / frame.left.cols));
    ++quarter[static_cast<std::size_t>(column)];
  }
  for (const int count : quarter) CHECK(count > static_cast<int>(features.size()) / 12);
}

}  // namespace
}  // namespace stereo_slam
