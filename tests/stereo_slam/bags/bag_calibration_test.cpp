// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/support/bags.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Topics whose names do not say which is left are ordered by their calibration", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const auto& [bag, left] :
       {std::pair("reversed.bag", "/cam_b/image"), {"unnamed.bag", "/other/image"}}) {
    CAPTURE(bag);
    auto scan = scan_bag(*folder / bag, {});
    CHECK(scan.sequence.left_name == left);
    REQUIRE(scan.problems.size() == 1);
    CHECK_THAT(scan.problems[0].text, Catch::Contains("by P[3] of their camera_info"));
    scan.problems.clear();
    check_images(scan, *folder);
  }
  CHECK_THAT(
      error_of(*folder / "unnamed_without.bag"),
      Catch::Contains("no pairs of image topics; name them") && Catch::Contains("/main/image, /other/image"));
}

TEST_CASE("Rectified images that the camera_info does not describe are refused", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  CHECK_THAT(
      error_of(*folder / "half.bag"),
      Catch::Contains("/a/left/camera_info says 320x120 pixels, but the images of /a/left/image_rect have "
                      "160x60; they may have been scaled"));
  CHECK_THAT(error_of(*folder / "rect_cx.bag"),
             Catch::Contains("cx = 160 in the left and 180 in the right camera: the cameras were calibrated "
                             "without zero disparity") &&
                 Catch::Contains("CALIB_ZERO_DISPARITY, or name the topics of the raw images"));
  check_images(scan_bag(*folder / "raw_cx.bag", {}), *folder);  // raw images are rectified here
}

TEST_CASE("Projection matrices in a bag that contradict each other are refused", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const std::string name : {"rect", "raw"}) {
    CAPTURE(name);
    const auto error = [&](const char* what) { return error_of(*folder / (name + what + ".bag")); };
    CHECK_THAT(error("_fx"), Catch::Contains("contradict each other: fx is 210 in that of the left camera"));
    CHECK_THAT(error("_cy"), Catch::Contains("contradict each other: cy is 60 in that of the left camera"));
    CHECK_THAT(error("_Ty"), Catch::Contains("camera_info: the projection matrix of the right camera has") &&
                                 Catch::Contains("rectified cameras lie side by side"));
    CHECK_THAT(error("_both"), Catch::Contains("of both cameras have a baseline"));
  }
}

TEST_CASE("The first calibrated camera_info counts, and needs no more than the images need", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const char* name : {"uncalibrated_first.bag", "bare_rectified.bag", "bare_raw.bag"}) {
    CAPTURE(name);
    const auto scan = scan_bag(*folder / name, {});
    CHECK(scan.problems.empty());
    CHECK(scan.sequence.camera.baseline_m == Approx(0.4));
    check_images(scan, *folder);
  }
  CHECK_THAT(error_of(*folder / "uncalibrated.bag"),
             Catch::Contains("/stereo/left/camera_info: the camera matrix K is zero in all messages") &&
                 Catch::Contains("--calibration FILE"));
}

TEST_CASE("A positive baseline in a camera_info is read, with a warning that names the topic", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const char* name : {"rect_positive.bag", "raw_positive.bag"}) {
    CAPTURE(name);
    const auto scan = scan_bag(*folder / name, {});
    REQUIRE(scan.problems.size() == 1);
    CHECK_FALSE(is_error(scan.problems[0]));
    CHECK_THAT(scan.problems[0].text,
               Catch::Contains("right/camera_info: P[3] of the right camera is 80, but must be negative"));
    CHECK(scan.sequence.camera.baseline_m == Approx(0.4));
  }
}
