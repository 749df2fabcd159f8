// SPDX-License-Identifier: MIT
// camera_info of ROS in its files.
#include <algorithm>
#include <cctype>
#include <sstream>

#include "stereo_slam/calibration/calibration_file.hpp"
#include "stereo_slam/calibration/camera_info.hpp"
#include "stereo_slam/support/opencv_cameras.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Projection matrices of a ROS pair that contradict each other are refused", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  const std::string left = camera_info(cameras, true), right = camera_info(cameras, false);
  const auto error_with = [&](const std::string& of_left, const std::string& of_right) {
    write_text(folder / "left.yaml", of_left);
    write_text(folder / "right.yaml", of_right);
    return calibration_error(folder / "left.yaml");
  };
  CHECK(error_with(left, right).empty());
  for (const auto& [element, name] : {std::pair{0, "fx"}, {5, "fy"}, {6, "cy"}}) {
    CAPTURE(name);
    const auto part = fmt::format("contradict each other: {} is ", name);
    CHECK_THAT(error_with(with_projection(left, element, 77.0), right), Catch::Contains(part));
    CHECK_THAT(error_with(left, with_projection(right, element, 77.0)),
               Catch::Contains("right.yaml: the projection matrices") && Catch::Contains(part));
  }
  for (const auto& [element, value] : {std::pair{7, 2.0}, {11, 0.01}}) {
    CAPTURE(element);
    for (const bool of_left : {true, false}) {
      CHECK_THAT(error_with(of_left ? with_projection(left, element, value) : left,
                            of_left ? right : with_projection(right, element, value)),
                 Catch::Contains("rectified cameras lie side by side"));
    }
  }
  CHECK(error_with(left, with_projection(right, 7, 0.1)).empty());  // 0.1 % of the baseline
  CHECK_THAT(error_with(with_projection(left, 3, 9.0), right),
             Catch::Contains("of both cameras have a base"));
  CHECK_THAT(error_with(with_projection(left, 1, 9.0), right),
             Catch::Contains("of the left camera is not [fx 0 cx Tx;"));
  // The images are rectified anew, so that the right ones may have been shifted along their rows.
  CHECK(error_with(left, with_projection(right, 2, 77.0)).empty());
  check_rig(read_calibration(folder / "left.yaml"), cameras, 320);
}

TEST_CASE("A distortion without a value is none", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  for (const std::string given : {"D:\n", "D: null\n", "D: []\n", "D: {rows: 0, cols: 0, data: null}\n"}) {
    CAPTURE(given);
    std::string both;
    for (const double baseline_m : {0.0, 0.5}) {
      both += fmt::format(
          "height: 120\nwidth: 320\ndistortion_model: ''\n{}K: [200, 0, 160, 0, 200, 60, 0, 0, 1]\n"
          "R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nP: [200, 0, 160, {}, 0, 200, 60, 0, 0, 0, 1, 0]\n---\n",
          given, -200.0 * baseline_m);
    }
    write_text(folder / "both.yaml", both);
    CHECK(calibration_error(folder / "both.yaml").empty());
  }
}

TEST_CASE("A baseline in P is read by its sign where it is clear, and warned about where it is not",
          "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  const std::string left = camera_info(cameras, true), right = camera_info(cameras, false);
  const auto at = right.find("data: [", right.find("projection_matrix")) + 7;
  double P3 = 0.0;
  std::istringstream row(right.substr(at));
  for (int i = 0; i <= 3; ++i) row.ignore(i == 0 ? 0 : 100, ',') >> P3;
  REQUIRE(P3 < -1.0);
  const auto read = [&](double of_left, double of_right) {
    write_text(folder / "left.yaml", with_projection(left, 3, of_left));
    write_text(folder / "right.yaml", with_projection(right, 3, of_right));
    return read_calibration(folder / "left.yaml");
  };
  CHECK(read(0.0, P3).warnings.empty());
  // The left camera in front of the right one's x axis, which the P refer to.
  CHECK(read(-P3, 0.0).warnings.empty());
  check_rig(read(-P3, 0.0), cameras, 320);
  // The sign that some drivers write.
  const OwnCamera positive = read(0.0, -P3);
  check_rig(positive, cameras, 320);
  REQUIRE(positive.warnings.size() == 1);
  CHECK_THAT(positive.warnings[0],
             Catch::Contains("right.yaml: P[3] of the right camera is ") &&
                 Catch::Contains("a baseline of 0.4") &&
                 Catch::Contains("exchange the images of the two cameras together with"));
  write_text(folder / "left.yaml", with_projection(left, 3, P3));
  write_text(folder / "right.yaml", with_projection(right, 3, 0.0));
  CHECK_THAT(calibration_error(folder / "left.yaml"),
             Catch::Contains("the two are swapped: name them the other way round"));
  write_text(folder / "left.yaml", with_projection(left, 3, P3));
  write_text(folder / "right.yaml", with_projection(right, 3, P3));
  CHECK_THAT(calibration_error(folder / "left.yaml"), Catch::Contains("of both cameras have a baseline"));
}

TEST_CASE("Echoed camera_info of ROS 1 and 2 is read, from two files or from one", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  const auto echo = [&](bool is_left, bool ros2, const std::string& frame) {
    std::string text = camera_info(cameras, is_left);
    const auto line_of = [&](const std::string& key) {
      const auto begin = text.find("data: [", text.find(key)) + 6;
      return text.substr(begin, text.find(']', begin) + 1 - begin);
    };
    const auto list = [&](const char* name, const std::string& key) {
      if (!ros2) return fmt::format("{}: {}\n", name, line_of(key));
      std::string items = line_of(key);
      items = items.substr(1, items.size() - 2);
      std::string result = fmt::format("{}:\n", static_cast<char>(std::tolower(name[0])));
      std::istringstream stream(items);
      for (std::string item; std::getline(stream, item, ',');) result += "- " + item + "\n";
      return result;
    };
    return fmt::format(
        "header: \n  seq: 0\n  stamp: \n    secs: 1\n    nsecs: 2\n  frame_id: \"{}\"\nheight: 120\nwidth: "
        "320\n"
        "distortion_model: \"plumb_bob\"\n{}{}{}{}binning_x: 0\nbinning_y: 0\nroi: \n  x_offset: 0\n  "
        "do_rectify: "
        "False\n---\n",
        frame, list("D", "distortion_coefficients"), list("K", "camera_matrix"),
        list("R", "rectification_matrix"), list("P", "projection_matrix"));
  };
  for (const bool ros2 : {false, true}) {
    CAPTURE(ros2);
    const std::string left = echo(true, ros2, "a"), right = echo(false, ros2, "b");
    write_text(folder / "info_left.yaml", left);
    write_text(folder / "info_right.yaml", right);
    check_rig(read_calibration(folder / "info_left.yaml"), cameras, 320);
    write_text(folder / "both.yaml", right + left + left + right);
    check_rig(read_calibration(folder / "both.yaml"), cameras, 320);
    write_text(folder / "both.yaml", left + right + "frame_rate_hz: 20\n");
    check_rig(read_calibration(folder / "both.yaml"), cameras, 320);
    CHECK(read_calibration(folder / "both.yaml").frame_rate_hz == 20.0);
    std::string uncalibrated = left;
    const auto K = uncalibrated.find(ros2 ? "\nk:" : "\nK:");
    const auto first = uncalibrated.find_first_of("123456789", K);
    uncalibrated.replace(first, 3, "000");
    write_text(folder / "both.yaml", uncalibrated + left + right);
    check_rig(read_calibration(folder / "both.yaml"), cameras, 320);
    write_text(folder / "both.yaml", uncalibrated);
    CHECK_THAT(calibration_error(folder / "both.yaml"),
               Catch::Contains("both.yaml: the camera matrix K is zero"));
    write_text(folder / "alone.yaml", left);
    CHECK_THAT(calibration_error(folder / "alone.yaml"), Catch::Contains("is one camera of a ROS pair"));
    write_text(folder / "both.yaml", left + right + right.substr(0, right.find("binning")));
    check_rig(read_calibration(folder / "both.yaml"), cameras, 320);
  }
}

TEST_CASE("ROS's ost.txt is read if it has both cameras", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  const auto ost = [&](bool is_left) {
    const std::string info = camera_info(cameras, is_left);
    const auto numbers_of = [&](const std::string& key) {
      const auto begin = info.find("data: [", info.find(key)) + 7;
      std::string text = info.substr(begin, info.find(']', begin) - begin);
      std::replace(text.begin(), text.end(), ',', ' ');
      return text;
    };
    return fmt::format(
        "# oST version 5.0 "
        "parameters\n\n\n[image]\n\nwidth\n320\n\nheight\n120\n\n[narrow_stereo/{}]\n\ncamera "
        "matrix\n{}\n\ndistortion\n{}\n\nrectification\n{}\n\nprojection\n{}\n\n",
        is_left ? "left" : "right", numbers_of("camera_matrix"), numbers_of("distortion_coefficients"),
        numbers_of("rectification_matrix"), numbers_of("projection_matrix"));
  };
  write_text(folder / "ost.txt", ost(true) + ost(false));
  check_rig(read_calibration(folder / "ost.txt"), cameras, 320);
  write_text(folder / "ost.txt", ost(true));
  CHECK_THAT(calibration_error(folder / "ost.txt"), Catch::Contains("ost.txt: is one camera of a ROS pair"));
  write_text(folder / "ost.txt", "[image]\nwidth\nmany\n");
  CHECK_THAT(calibration_error(folder / "ost.txt"),
             Catch::Contains("ost.txt:3: holds neither numbers nor a name"));
  write_text(folder / "ost.txt", "[image]\nwidth\n320\n");
  CHECK_THAT(calibration_error(folder / "ost.txt"), Catch::Contains("ost.txt: "));
  for (const char* numbers : {"320\n1.0 0.0", "320\n320", "320 120"}) {
    write_text(folder / "ost.txt", fmt::format("[image]\nwidth\n{}\n", numbers));
    CHECK_THAT(calibration_error(folder / "ost.txt"), Catch::Contains("expected one number for width"));
  }
}

TEST_CASE("camera_info says which camera is not calibrated, and needs no R where P shows the lens's image",
          "[calibration]") {
  const auto info = [](double shift) {
    return CameraInfo{.width_px = 320,
                      .height_px = 120,
                      .distortion_model = "",
                      .D = {},
                      .K = {200, 0, 160, 0, 200, 60, 0, 0, 1},
                      .R = {},
                      .P = {200, 0, 160, shift, 0, 200, 60, 0, 0, 0, 1, 0}};
  };
  const StereoRig rig = rig_of(info(0.0), info(-20.0));
  CHECK(rig.left.distortion == Distortion::kNone);
  CHECK(rig.T_right_left.isApprox(Eigen::Isometry3d(Eigen::Translation3d(-0.1, 0.0, 0.0)), 1e-15));
  CameraInfo other = info(0.0);
  other.K[0] = 210.0;  // another image than P, so that R is needed
  CHECK_THROWS_WITH(rig_of(other, info(-20.0)), Catch::Contains("R of the left camera is not a rotation"));
  CHECK(rectified_of(other, info(-20.0)).baseline_m == Approx(0.1));
  other = info(0.0);
  other.K = {};
  CHECK_THROWS_WITH(rig_of(other, info(-20.0)),
                    Catch::Contains("the left camera: the camera matrix is zero"));
  other = info(0.0);
  other.distortion_model = "equidistant";
  CHECK_THROWS_WITH(rig_of(other, info(-20.0)),
                    Catch::Contains("the left camera: equidistant has 0 distortion coefficients"));
  other = info(0.0);
  other.distortion_model = "rational_polynomial";
  other.D = {-0.3, 0.1, 0, 0, 0, 0, 0, 0, 0.001, 0, 0, 0};
  CHECK_THROWS_WITH(
      rig_of(other, info(-20.0)),
      Catch::Contains("the left camera: radtan has 12 distortion coefficients, of which those after the "
                      "eighth (thin prism, tilted sensor) are not zero"));
  other.distortion_model = "equidistant";
  other.D.clear();
  CHECK(rectified_of(other, info(20.0)).baseline_m == Approx(0.1));
  CHECK_THAT(baseline_warning(info(0.0), info(20.0)), Catch::Contains("a baseline of 0.1 m"));
}
