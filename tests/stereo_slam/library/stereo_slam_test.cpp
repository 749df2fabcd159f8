// SPDX-License-Identifier: MIT
#include "stereo_slam/stereo_slam.hpp"

#include <algorithm>
#include <atomic>
#include <limits>
#include <thread>
#include <utility>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

const StereoCamera kTinyCamera{.fx = 200, .fy = 200, .cx = 160, .cy = 60, .baseline_m = 0.4};

struct Images {
  cv::Mat left;
  cv::Mat right;
};

/// Pairs of the tiny recording: a wall that is passed sideways.
Images tiny_images(int frame, int type = CV_8UC1) {
  using Tiny = TinySequence;
  const cv::Mat texture = tiny_texture(Tiny::kWidth + Tiny::kDisparity_px + Tiny::kShift_px * 12);
  const cv::Rect left(Tiny::kShift_px * frame, 0, Tiny::kWidth, Tiny::kHeight);
  Images images{texture(left).clone(), texture(left + cv::Point(Tiny::kDisparity_px, 0)).clone()};
  for (auto* image : {&images.left, &images.right}) {
    if (CV_MAT_CN(type) == 3) cv::cvtColor(*image, *image, cv::COLOR_GRAY2BGR);
    if (CV_MAT_CN(type) == 4) cv::cvtColor(*image, *image, cv::COLOR_GRAY2BGRA);
    if (CV_MAT_DEPTH(type) == CV_16U) image->convertTo(*image, CV_16U, 256.0);
  }
  return images;
}

constexpr std::int64_t kPeriod_ns = 100'000'000;

void process_frames(StereoSlam& slam, int frames, int type = CV_8UC1) {
  for (int i = 0; i < frames; ++i) {
    const auto [left, right] = tiny_images(i, type);
    (void)slam.process(left, right, i * kPeriod_ns);
  }
  slam.finish();
}

}  // namespace

TEST_CASE("The library gives the poses of the SLAM behind it, bit for bit", "[library]") {
  StereoSlam library(kTinyCamera);
  StereoCamera camera = kTinyCamera;
  camera.width_px = TinySequence::kWidth;
  camera.height_px = TinySequence::kHeight;
  Slam slam(camera, Settings{});
  for (int i = 0; i < 8; ++i) {
    auto [left, right] = tiny_images(i);
    const auto expected =
        slam.process({static_cast<std::size_t>(i), i * kPeriod_ns, left.clone(), right.clone()});
    const auto result = library.process(left, right, i * kPeriod_ns);
    left.setTo(0);  // a driver may use the memory again
    right.setTo(0);
    CHECK(result.status == expected.status);
    CHECK(result.T_world_camera.pose.coeffs() == expected.T_world_camera.pose.coeffs());
    CHECK(result.T_world_camera.covariance == expected.T_world_camera.covariance);
  }
  slam.finish();
  library.finish();
  CHECK(library.map_points().size() == slam.map_points().size());
  CHECK(library.camera().width_px == TinySequence::kWidth);
  const auto trajectory = library.trajectory();
  REQUIRE(trajectory.size() == 8);
  CHECK(trajectory[7].T_world_camera.pose.translation().x() == Approx(7 * 0.16).margin(0.05));
  CHECK(trajectory[7].stamp_ns == 7 * kPeriod_ns);
  CHECK(trajectory[7].status == TrackingStatus::kOk);
  REQUIRE_FALSE(library.keyframes().empty());
  CHECK(library.keyframes().front().index == 0);
}

TEST_CASE("Images in colour and with 16 bits are taken as grey ones", "[library]") {
  StereoSlam grey(kTinyCamera);
  process_frames(grey, 3);
  const auto expected = grey.trajectory().back().T_world_camera.pose.coeffs();
  for (const int type : {CV_8UC3, CV_8UC4, CV_16UC1}) {
    CAPTURE(type);
    StereoSlam slam(kTinyCamera);
    process_frames(slam, 3, type);
    CHECK(slam.trajectory().back().T_world_camera.pose.coeffs() == expected);
  }
}

TEST_CASE("Where the right camera delivered no image, the left one alone is tracked", "[library]") {
  StereoSlam slam(kTinyCamera);
  for (int i = 0; i < 8; ++i) {
    const auto [left, right] = tiny_images(i);
    const auto result = slam.process(left, i == 4 ? cv::Mat() : right, i * kPeriod_ns);
    if (i > 0) CHECK(result.status == (i == 4 ? TrackingStatus::kWeak : TrackingStatus::kOk));
    CHECK(result.T_world_camera.pose.translation().x() == Approx(0.16 * i).margin(0.02));
  }
}

TEST_CASE("What cannot be processed is refused, and changes nothing", "[library]") {
  StereoSlam slam(kTinyCamera);
  const auto [left, right] = tiny_images(0);
  const auto refused = [&](const cv::Mat& a, const cv::Mat& b, std::int64_t stamp_ns) {
    return message_of([&] { (void)slam.process(a, b, stamp_ns); });
  };
  CHECK_THAT(refused({}, right, 0), Catch::Contains("the left image is empty"));
  CHECK_THAT(refused(left, right.colRange(0, 100), 0), Catch::Contains("differ in size"));
  CHECK_THAT(refused(cv::Mat(120, 320, CV_32F), right, 0), Catch::Contains("CV_32FC1"));
  CHECK(slam.trajectory().empty());
  CHECK(slam.map_points().empty());
  CHECK_THAT(message_of([&] { slam.save_map("unused.map"); }), Catch::Contains("no frame"));
  (void)slam.process(left, right, 5);
  CHECK_THAT(refused(left, right, 5), Catch::Contains("5 ns is not later"));
  CHECK_THAT(refused(left.rowRange(0, 100), right.rowRange(0, 100), 6),
             Catch::Contains("320x100 pixels, but the calibration is of 320x120"));
  CHECK(slam.trajectory().size() == 1);
}

TEST_CASE("A camera that no images can be of is refused with its values", "[library]") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto refused = [](const auto& change) {
    StereoCamera camera = kTinyCamera;
    camera.width_px = 320;
    camera.height_px = 120;
    change(camera);
    return message_of([&] { StereoSlam slam(camera); });
  };
  CHECK_THAT(refused([](auto& c) { c.fx = kInfinity; }), Catch::Contains("focal lengths inf and"));
  CHECK_THAT(refused([](auto& c) { c.fy = kNan; }), Catch::Contains("and nan px"));
  CHECK_THAT(refused([](auto& c) { c.baseline_m = 1e-300; }), Catch::Contains("baseline of 1e-300 m"));
  CHECK_THAT(refused([](auto& c) { c.cx = kNan; }), Catch::Contains("principal point (nan, "));
  CHECK_THAT(refused([](auto& c) { c.cx = 5000.0; }), Catch::Contains("lies outside the 320x120 images"));
  CHECK_THAT(refused([](auto& c) { c.width_px = -320; }), Catch::Contains("images of -320x120 px"));
  CHECK_THAT(refused([](auto& c) { c.height_px = 0; }), Catch::Contains("images of 320x0 px"));
  StereoCamera unsized = kTinyCamera;
  unsized.cx = 500.0;
  StereoSlam slam(unsized);
  const auto [left, right] = tiny_images(0);
  CHECK_THAT(message_of([&, a = left, b = right] { (void)slam.process(a, b, 0); }),
             Catch::Contains("lies outside the 320x120 images"));
}

TEST_CASE("Raw cameras that no images can be of are refused with their values", "[library]") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](const auto& change) {
    StereoRig rig;
    rig.left.fx = rig.left.fy = 200.0;
    rig.left.cx = 160.0;
    rig.left.cy = 60.0;
    rig.left.width_px = 320;
    rig.left.height_px = 120;
    rig.right = rig.left;
    rig.T_right_left.translation().x() = -0.5;
    change(rig);
    return message_of([&] { StereoSlam slam(rig); });
  };
  CHECK(refused([](StereoRig&) {}).empty());
  CHECK_THAT(refused([](auto& rig) { rig.right.fx = -200.0; }),
             Catch::Contains("the right camera has focal lengths -200"));
  CHECK_THAT(refused([](auto& rig) { rig.left.cy = kNan; }),
             Catch::Contains("the left camera has the principal point (160, nan)"));
  CHECK_THAT(refused([](auto& rig) { rig.left.width_px = 100; }), Catch::Contains("outside the 100x120"));
  CHECK_THAT(refused([](auto& rig) {
               rig.left.distortion = Distortion::kRadTan;
               rig.left.coefficients = {0.0, 0.0, 0.0};
             }),
             Catch::Contains("has 3 distortion coefficients; radtan needs 4, 5 or 8"));
  CHECK_THAT(refused([](auto& rig) {
               rig.left.distortion = Distortion::kRadTan;
               rig.left.coefficients = {kNan, 0.0, 0.0, 0.0};
             }),
             Catch::Contains("not finite"));
  CHECK_THAT(refused([](auto& rig) { rig.T_right_left.linear() *= 2.0; }),
             Catch::Contains("T_right_left has no rotation"));
  CHECK_THAT(refused([](auto& rig) { rig.T_right_left.translation().x() = kNan; }),
             Catch::Contains("T_right_left has the translation (nan"));
  CHECK_THAT(
      refused([&](auto& rig) { rig.T_body_left = Eigen::Isometry3d(Eigen::Translation3d(0, kNan, 0)); }),
      Catch::Contains("T_body_left has the translation"));
}

TEST_CASE("Another thread may ask for results while frames are processed", "[library][threads]") {
  StereoSlam slam(kTinyCamera);
  constexpr std::size_t kFrames = 6;
  std::atomic<bool> done = false;
  std::size_t most = 0;
  std::jthread reader([&] {
    while (!done) {
      const auto frames = slam.trajectory();
      most = std::max(most, frames.size());
      (void)slam.map_points();
      (void)slam.keyframes();
    }
  });
  for (std::size_t i = 0; i < kFrames; ++i) {
    const auto [left, right] = tiny_images(static_cast<int>(i));
    (void)slam.process(left, right, static_cast<std::int64_t>(i) * kPeriod_ns);
  }
  slam.finish();
  done = true;
  reader.join();
  CHECK(most <= kFrames);
  CHECK(slam.trajectory().size() == kFrames);
}

TEST_CASE("Options that cannot be used are refused with their name", "[library]") {
  const auto refused = [](const SlamOptions& options) {
    return message_of([&] { StereoSlam slam(kTinyCamera, options); });
  };
  CHECK_THAT(refused({.preset = "turbo"}), Catch::Contains("turbo"));
  CHECK_THAT(refused({.settings = {{"features.cuont", "500"}}}),
             Catch::Contains("did you mean features.count"));
  CHECK_THAT(refused({.settings = {{"features.count", "many"}}}),
             Catch::Contains("features.count is many, but must be a whole number"));
  CHECK_THAT(refused({.settings_file = "missing.yaml"}), Catch::Contains("missing.yaml"));
  CHECK_THAT(refused({.load_map = "missing.map"}), Catch::Contains("missing.map"));
  CHECK_THAT(refused({.eigen_alignment = 64}), Catch::Contains("aligned") && Catch::Contains("64"));
  CHECK_THAT(message_of([] { StereoSlam slam(StereoCamera{}); }), Catch::Contains("must be positive"));
  CHECK_THAT(message_of([] { StereoSlam slam(fs::path("missing.yaml")); }), Catch::Contains("missing.yaml"));
  CHECK_NOTHROW(StereoSlam(kTinyCamera, {.settings = {{"features.count", "500"}}, .loop_thread = false}));
}

TEST_CASE("A calibration file gives rectification and body", "[library]") {
  const TemporaryFolder folder;
  write_text(folder / "calibration.yaml",
             "left: {resolution: [320, 120], intrinsics: [200, 200, 160, 60], distortion_model: none}\n"
             "right: {resolution: [320, 120], intrinsics: [200, 200, 160, 60], distortion_model: none}\n"
             "T_right_left: [1, 0, 0, -0.4, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
             "T_body_left: [0, 0, 1, 0.1, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 1]\n");
  StereoSlam slam(folder / "calibration.yaml");
  CHECK(slam.camera().baseline_m == Approx(0.4));
  REQUIRE(slam.T_body_camera());
  CHECK(slam.T_body_camera()->translation().x() == Approx(0.1));
  process_frames(slam, 5);
  CHECK(slam.trajectory().back().T_world_camera.pose.translation().x() == Approx(4 * 0.16).margin(0.03));
}

TEST_CASE("A saved map is loaded again, and that of another camera is refused", "[library]") {
  const TemporaryFolder folder;
  StereoSlam first(kTinyCamera);
  process_frames(first, 8);
  first.save_map(folder / "wall.map");
  StereoCamera camera = kTinyCamera;
  camera.width_px = TinySequence::kWidth;
  camera.height_px = TinySequence::kHeight;
  StereoSlam second(camera, {.load_map = folder / "wall.map"});
  process_frames(second, 4);
  CHECK(second.trajectory().front().status != TrackingStatus::kOk);  // until it is localised
  StereoSlam moved = std::move(second);
  CHECK(moved.trajectory().size() == 4);
  camera.baseline_m = 0.5;
  CHECK_THAT(message_of([&] { StereoSlam slam(camera, {.load_map = folder / "wall.map"}); }),
             Catch::Contains("wall.map: it was made with another camera"));
}

TEST_CASE("What was learned of the cameras is used again, and that of others is refused", "[library]") {
  const TemporaryFolder folder;
  const auto file = folder / "cameras.yaml";
  StereoSlam first(kTinyCamera);
  CHECK_THROWS_AS(first.save_cameras(file), std::logic_error);
  process_frames(first, 8);
  first.save_cameras(file);
  StereoCamera camera = kTinyCamera;
  camera.width_px = TinySequence::kWidth;
  camera.height_px = TinySequence::kHeight;
  StereoSlam second(camera, {.learned = file});
  process_frames(second, 4);
  CHECK(second.trajectory().back().status == TrackingStatus::kOk);
  camera.baseline_m = 0.5;
  CHECK_THAT(message_of([&] { StereoSlam slam(camera, {.learned = file}); }),
             Catch::Contains("cameras.yaml: it was made with another camera"));
  CHECK_THAT(message_of([&] { StereoSlam slam(camera, {.load_map = file, .learned = file}); }),
             Catch::Contains("not both"));
  StereoSlam paper(kTinyCamera, {.preset = "paper"});
  process_frames(paper, 2);
  CHECK_THROWS_AS(paper.save_cameras(file), std::logic_error);
}

TEST_CASE("The library takes the samples of an IMU with the images", "[library][imu]") {
  const TemporaryFolder folder;
  const std::string rectified =
      "rectified: {fx: 200, fy: 200, cx: 160, cy: 60, baseline_m: 0.4}\n"
      "T_body_left: [0,0,1,0, -1,0,0,0, 0,-1,0,0, 0,0,0,1]\n";  // an IMU with x forward and z up
  write_text(folder / "calibration.yaml", rectified);
  StereoSlam slam(folder / "calibration.yaml");
  StereoSlam without_body(kTinyCamera);
  std::vector<ImuSample> samples;
  for (int i = -1; i <= 0; ++i) samples.push_back({i * kPeriod_ns / 20, {0, 0, 0}, {0, 0, 9.81}});
  const Images first = tiny_images(0);
  CHECK_THAT(message_of([&] { (void)without_body.process(first.left, first.right, 0, samples); }),
             Catch::Contains("no pose of the camera in the axes of the IMU"));
  for (int frame = 0; frame < 12; ++frame) {
    const auto images = tiny_images(frame);
    const auto result = slam.process(images.left, images.right, frame * kPeriod_ns, samples);
    CHECK((result.inertial.phase == InertialPhase::kRunning) == (frame >= 8));
    samples.clear();
    for (int i = 1; i <= 20; ++i)
      samples.push_back({frame * kPeriod_ns + i * kPeriod_ns / 20, {0, 0, 0}, {0, 0, 9.81}});
  }
  REQUIRE(slam.inertial());
  CHECK(slam.inertial()->restarts == 0);
  SlamOptions options;
  options.imu_noise.gyroscope = -1.0;
  StereoSlam wrong(folder / "calibration.yaml", options);
  CHECK_THAT(message_of([&] { (void)wrong.process(first.left, first.right, 0, samples); }),
             Catch::Contains("noise density"));
}
