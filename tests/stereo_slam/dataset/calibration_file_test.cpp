// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/calibration_file.hpp"

#include <cctype>
#include <sstream>

#include <opencv2/calib3d.hpp>

#include "stereo_slam/dataset/camera_info.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// Two cameras that are not quite parallel, as OpenCV describes them.
struct Cameras {
  cv::Size size{320, 120};
  cv::Matx33d K1{200, 0, 160, 0, 201, 60, 0, 0, 1};
  cv::Matx33d K2{202, 0, 158, 0, 203, 61, 0, 0, 1};
  cv::Mat D1 = (cv::Mat_<double>(1, 5) << -0.02, 0.01, 0.001, -0.002, 0.003);
  cv::Mat D2 = (cv::Mat_<double>(1, 5) << -0.03, 0.02, -0.001, 0.002, 0.001);
  cv::Matx33d R;
  cv::Vec3d T{-0.4, 0.002, 0.003};

  Cameras() { cv::Rodrigues(cv::Vec3d(0.01, -0.02, 0.03), R); }
};

/// OpenCV's FileStorage writes it, as a calibration of a user's would.
void write_opencv(const fs::path& file, const Cameras& cameras, bool with_extrinsics = true,
                  double unit = 1.0) {
  cv::FileStorage storage(file.string(), cv::FileStorage::WRITE);
  storage << "M1" << cv::Mat(cameras.K1) << "D1" << cameras.D1 << "M2" << cv::Mat(cameras.K2) << "D2"
          << cameras.D2;
  if (with_extrinsics) storage << "R" << cv::Mat(cameras.R) << "T" << cv::Mat(cameras.T * unit);
}

template <class Matrix>
std::string numbers(const Matrix& matrix) {
  std::string text;
  const cv::Mat values = cv::Mat(matrix).reshape(1, 1);
  for (int i = 0; i < values.cols; ++i)
    text += fmt::format("{}{:.17g}", i == 0 ? "" : ", ", values.at<double>(i));
  return text;
}

/// As camera_calibration of ROS writes one of the two.
std::string camera_info(const Cameras& cameras, bool left) {
  cv::Matx33d R1, R2;
  cv::Matx34d P1, P2;
  cv::Matx44d Q;
  cv::stereoRectify(cameras.K1, cameras.D1, cameras.K2, cameras.D2, cameras.size, cameras.R, cameras.T, R1,
                    R2, P1, P2, Q, cv::CALIB_ZERO_DISPARITY, 0.0);
  return fmt::format(
      "image_width: 320\nimage_height: 120\ncamera_name: narrow_stereo/{}\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\ndistortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{}]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{}]\n",
      left ? "left" : "right", numbers(left ? cameras.K1 : cameras.K2),
      numbers(left ? cameras.D1 : cameras.D2), numbers(left ? R1 : R2), numbers(left ? P1 : P2));
}

std::string camchain(const Cameras& cameras) {
  const auto lens = [](const cv::Matx33d& K, const cv::Mat& D) {
    return fmt::format(
        "  camera_model: pinhole\n  cam_overlaps: [1]\n  distortion_coeffs: [{}]\n  distortion_model: "
        "radtan\n"
        "  intrinsics: [{}, {}, {}, {}]\n  resolution: [320, 120]\n  rostopic: /cam/image_raw\n",
        numbers(D.colRange(0, 4)), K(0, 0), K(1, 1), K(0, 2), K(1, 2));
  };
  std::string T;
  for (int i = 0; i < 3; ++i) {
    T += fmt::format("  - [{:.17g}, {:.17g}, {:.17g}, {:.17g}]\n", cameras.R(i, 0), cameras.R(i, 1),
                     cameras.R(i, 2), cameras.T[i]);
  }
  return "cam0:\n" + lens(cameras.K1, cameras.D1) + "cam1:\n  T_cn_cnm1:\n" + T +
         "  - [0.0, 0.0, 0.0, 1.0]\n" + lens(cameras.K2, cameras.D2);
}

/// Two fisheyes as cv::fisheye describes them.
struct Fisheyes : Cameras {
  Fisheyes(double focal_px, std::initializer_list<double> k) {
    K1 = cv::Matx33d(focal_px, 0, 160, 0, focal_px, 60, 0, 0, 1);
    K2 = cv::Matx33d(focal_px, 0, 158, 0, focal_px, 61, 0, 0, 1);
    D1 = cv::Mat(std::vector<double>(k), true);
    D2 = D1.clone();
  }
};

void check_rig(const OwnCamera& own, const Cameras& cameras, int width_px, std::size_t coefficients = 5) {
  REQUIRE(own.rig);
  const auto& [left, right, T_right_left, T_body_left] = *own.rig;
  CHECK(left.width_px == width_px);
  CHECK(left.fy == Approx(cameras.K1(1, 1)));
  CHECK(right.cx == Approx(cameras.K2(0, 2)));
  REQUIRE(right.coefficients.size() == coefficients);
  CHECK(right.coefficients[3] == Approx(cameras.D2.at<double>(3)));
  for (int i = 0; i < 3; ++i) {
    CHECK(T_right_left.translation()[i] == Approx(cameras.T[i]).margin(1e-9));
    for (int j = 0; j < 3; ++j) CHECK(T_right_left.linear()(i, j) == Approx(cameras.R(i, j)).margin(1e-9));
  }
}

/// The camera_info with another element of P, counted row by row.
std::string with_projection(std::string text, int element, double value) {
  auto at = text.find("data: [", text.find("projection_matrix")) + 7;
  for (int i = 0; i < element; ++i) at = text.find(", ", at) + 2;
  return text.replace(at, text.find_first_of(",]", at) - at, fmt::format("{}", value));
}

StereoRig read_calibration_rig(const fs::path& file, const std::string& text) {
  write_text(file, text);
  return read_calibration(file).rig.value();
}

std::string error_of(const fs::path& file) {
  auto message = message_of([&] { (void)read_calibration(file); });
  CHECK(std::count(message.begin(), message.end(), '\n') == 0);
  return message;
}

}  // namespace

TEST_CASE("One stereo camera is read from the files of OpenCV, Kalibr and ROS", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  for (const char* name : {"stereo.yaml", "stereo.yml", "stereo.xml"}) {
    CAPTURE(name);
    write_opencv(folder / name, cameras);
    check_rig(read_calibration(folder / name), cameras, 0);
  }
  write_text(folder / "camchain-imucam.yaml", camchain(cameras));
  check_rig(read_calibration(folder / "camchain-imucam.yaml"), cameras, 320, 4);
  write_text(folder / "left.yaml", camera_info(cameras, true));
  write_text(folder / "right.yaml", camera_info(cameras, false));
  check_rig(read_calibration(folder / "left.yaml"), cameras, 320);
  check_rig(read_calibration(folder.path()), cameras, 320);
}

TEST_CASE("The times of the images may be added to the calibration of another program", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  write_opencv(folder / "stereo.yaml", cameras);
  write_text(folder / "camchain.yaml", camchain(cameras));
  write_text(folder / "left.yaml", camera_info(cameras, true));
  write_text(folder / "right.yaml", camera_info(cameras, false));
  for (const char* name : {"stereo.yaml", "camchain.yaml", "left.yaml"}) {
    CAPTURE(name);
    const auto text = read_text(folder / name);
    write_text(folder / name, text + "frame_rate_hz: 20\n");
    CHECK(read_calibration(folder / name).frame_rate_hz == 20.0);
    write_text(folder / name, text + "times: t.txt\n");
    CHECK(read_calibration(folder / name).times == "t.txt");
    write_text(folder / name, text + "frame_rate_hz: fast\n");
    CHECK_THAT(error_of(folder / name), Catch::Contains("frame_rate_hz"));
  }
}

TEST_CASE("OpenCV's intrinsics and extrinsics may be two files", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  write_opencv(folder / "intrinsics.yml", cameras, /*with_extrinsics=*/false);
  CHECK_THAT(error_of(folder / "intrinsics.yml"),
             Catch::Contains("has no T; add R and T of cv::stereoCalibrate"));
  {
    cv::FileStorage storage((folder / "extrinsics.yml").string(), cv::FileStorage::WRITE);
    storage << "R" << cv::Mat(cameras.R) << "T" << cv::Mat(cameras.T);
  }
  check_rig(read_calibration(folder / "intrinsics.yml"), cameras, 0);
}

TEST_CASE("A calibration without image size takes that of the images", "[calibration]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "in", 3);
  fs::remove(folder / "in/calibration.yaml");
  write_text(folder / "in/times.txt", "0\n0.1\n0.2\n");
  write_opencv(folder / "stereo.xml", Cameras());
  auto scan = scan_sequence(folder / "in", "auto", folder / "stereo.xml");
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.camera.width_px == 320);
  CHECK(scan.sequence.frames[2].stamp_ns == 200'000'000);
  CHECK(load_frame(scan.sequence, 1).left.cols == 320);
  // In the folder itself it needs no option.
  fs::rename(folder / "stereo.xml", folder / "in/calibration.xml");
  CHECK(scan_sequence(folder / "in", "auto").problems.empty());
  fs::rename(folder / "in/times.txt", folder / "elsewhere.txt");
  scan = scan_sequence(folder / "in", "auto");
  REQUIRE_FALSE(scan.problems.empty());
  CHECK_THAT(scan.problems[0].text, Catch::Contains("or put times.txt beside the folders"));
}

TEST_CASE("Millimetres and squares of the board are suspected, with what to change", "[calibration]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "in", 3);
  write_text(folder / "in/times.txt", "0\n0.1\n0.2\n");
  const auto warning = [&](double unit) {
    write_opencv(folder / "stereo.yaml", Cameras(), true, unit);
    const auto scan = scan_sequence(folder / "in", "auto", folder / "stereo.yaml");
    REQUIRE(scan.problems.size() == 1);
    CHECK_FALSE(is_error(scan.problems[0]));
    return scan.problems[0].text;
  };
  CHECK_THAT(warning(1000.0), Catch::Contains("a baseline of 400 m; lengths must be in metres; if these are "
                                              "millimetres, divide the translation by 1000 (to 0.4 m)"));
  CHECK_THAT(warning(10.0), Catch::Contains("a baseline of 4 m") &&
                                Catch::Contains("if these are centimetres, divide the translation by 100 (to "
                                                "0.04 m)") &&
                                !Catch::Contains("millimetres"));
  CHECK_THAT(warning(30.0), Catch::Contains("a baseline of 12 m") && Catch::Contains("by 100 (to 0.12 m)") &&
                                !Catch::Contains("millimetres"));
  CHECK_THAT(warning(150.0),
             Catch::Contains("a baseline of 60 m") && Catch::Contains("by 100 (to 0.6 m)") &&
                 Catch::Contains("if these are millimetres, divide the translation by 1000 (to "
                                 "0.06 m)"));
  CHECK_THAT(warning(1e5), Catch::Contains("few cameras are so far") && !Catch::Contains("divide"));
  CHECK_THAT(warning(0.001), Catch::Contains("a baseline of 0.0004 m") &&
                                 Catch::Contains("a square of the calibration board"));
}

TEST_CASE("A calibration of another size says what to change", "[calibration]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  write_text(folder / "times.txt", "0\n0.1\n0.2\n");
  const auto error = [&](const std::string& resolution, const std::string& principal) {
    std::string text = camchain(Cameras());
    for (std::size_t at = 0; (at = text.find("[320, 120]", at)) != std::string::npos;)
      text.replace(at, 10, resolution);
    for (const char* was : {"160, 60]", "158, 61]"}) text.replace(text.find(was), 8, principal);
    write_text(folder / "camchain.yaml", text);
    const auto scan = scan_sequence(folder.path(), "auto", folder / "camchain.yaml");
    REQUIRE_FALSE(scan.problems.empty());
    return scan.problems[0].text;
  };
  CHECK_THAT(error("[640, 240]", "320, 120]"), Catch::Contains("resolution is 640x240") &&
                                                   Catch::Contains("multiply fx, fy, cx and cy by 0.5"));
  CHECK_THAT(error("[160, 120]", "80, 60]"), Catch::Contains("use `layout: side-by-side`"));
  CHECK_THAT(error("[320, 200]", "160, 60]"), Catch::Contains("calibrate at the recorded size"));
}

TEST_CASE("Four coefficients without a model are the only one by which the lenses can exist, or refused",
          "[calibration]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "stereo.yml";
  const auto distortion = [&](double focal_px, std::initializer_list<double> k) {
    write_opencv(file, Fisheyes(focal_px, k));
    const auto rig = read_calibration(file).rig.value();
    CHECK(rig.left.distortion == rig.right.distortion);
    return rig.left.distortion;
  };
  // 160 px of half the width at 90 px: 204 degrees of a fisheye, or 121 of a pinhole.
  CHECK(distortion(90.0, {0.0034, 0.0007, -0.0020, 0.0002}) == Distortion::kEquidistant);
  CHECK(distortion(120.0, {-0.02, 0.06, -0.09, 0.04}) == Distortion::kEquidistant);
  CHECK(distortion(200.0, {0.35, 0.12, 0.06, 0.02}) == Distortion::kEquidistant);
  CHECK(distortion(200.0, {-0.283, 0.074, 0.0002, 0.00002}) == Distortion::kRadTan);  // EuRoC's
  CHECK(distortion(200.0, {0.0, 0.0, 0.0, 0.0}) == Distortion::kNone);

  const auto refusal = [&](const Cameras& cameras, const std::string& line = "") {
    write_opencv(file, cameras);
    write_text(file, read_text(file) + line);
    return error_of(file);
  };
  const Fisheyes either(150.0, {-0.01, 0.01, -0.003, 0.0005});
  const auto check_advice = [](const std::string& message) {
    CHECK_THAT(message, Catch::Contains("stereo.yml: has four distortion coefficients") &&
                            Catch::Contains("`distortion_model: plumb_bob`") &&
                            Catch::Contains("`distortion_model: equidistant`"));
  };
  check_advice(refusal(either));
  check_advice(refusal(Fisheyes(60.0, {0.0, 0.0, 0.0, 0.0})));     // no pinhole sees 139 degrees
  check_advice(refusal(Fisheyes(200.0, {-0.9, -0.5, 0.3, 0.1})));  // fits no lens
  check_advice(refusal(Fisheyes(200.0, {1e300, 1e300, 1e300, 1e300})));
  Fisheyes different = either;
  different.D2 = (cv::Mat_<double>(4, 1) << -0.02, 0.06, -0.09, 0.04);
  CHECK(refusal(different).empty());  // the right one decides for both
  CHECK(read_calibration(file).rig->left.distortion == Distortion::kEquidistant);
  different.D2 = (cv::Mat_<double>(1, 5) << -0.01, 0.01, 0.0001, 0.0001, 0.0);
  CHECK(refusal(different).empty());
  CHECK(read_calibration(file).rig->left.distortion == Distortion::kRadTan);
  for (const char* line :
       {"distortion_model: equidistant\n", "fisheye_model: 1\n", "camera_model: fisheye\n"}) {
    CAPTURE(line);
    CHECK(refusal(either, line).empty());
    CHECK(read_calibration(file).rig->left.distortion == Distortion::kEquidistant);
  }
  for (const char* line : {"distortion_model: plumb_bob\n", "fisheye_model: 0\n"}) {
    CAPTURE(line);
    CHECK(refusal(either, line).empty());
    CHECK(read_calibration(file).rig->left.distortion == Distortion::kRadTan);
  }
  check_advice(refusal(either, "camera_model: pinhole\n"));  // which says nothing about the distortion
  CHECK_THAT(refusal(either, "distortion_model: scaramuzza\n"),
             Catch::Contains("distortion_model is scaramuzza"));
}

TEST_CASE("OpenCV's rotation may be a rotation vector, and a fifth coefficient of a fisheye zero",
          "[calibration]") {
  const TemporaryFolder folder;
  Cameras cameras;
  const fs::path file = folder / "stereo.yml";
  write_opencv(file, cameras, /*with_extrinsics=*/false);
  write_text(file, read_text(file) + "R: [0.01, -0.02, 0.03]\nT: [-0.4, 0.002, 0.003]\n");
  check_rig(read_calibration(file), cameras, 0);
  write_opencv(file, cameras, /*with_extrinsics=*/false);
  write_text(file, read_text(file) + "R: [0.01, -0.02, 0.03, 1.0]\nT: [-0.4, 0.002, 0.003]\n");
  CHECK_THAT(error_of(file), Catch::Contains("R is not a matrix"));
  write_opencv(file, cameras, /*with_extrinsics=*/false);
  write_text(file, read_text(file) + "R: [0, 0, 0]\nT: [-0.4, 0.002, 0.003]\n");
  CHECK(read_calibration(file).rig->T_right_left.linear().isIdentity(1e-15));

  std::string text = camchain(cameras);  // of a T265
  const auto replace_all = [&](const std::string& was, const std::string& is) {
    for (std::size_t at = 0; (at = text.find(was, at)) != std::string::npos; at += is.size())
      text.replace(at, was.size(), is);
  };
  replace_all("radtan", "equidistant");
  replace_all("coeffs: [", "coeffs: [0.001, ");
  CHECK_THAT((write_text(file, text), error_of(file)),
             Catch::Contains("equidistant has 5 distortion coefficients"));
  replace_all("coeffs: [0.001, ", "coeffs: [");
  replace_all("]\n  distortion_model", ", 0.0]\n  distortion_model");
  CHECK(read_calibration_rig(file, text).right.coefficients.size() == 4);
}

TEST_CASE("Projection matrices of a ROS pair that contradict each other are refused", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  const std::string left = camera_info(cameras, true), right = camera_info(cameras, false);
  const auto error_with = [&](const std::string& of_left, const std::string& of_right) {
    write_text(folder / "left.yaml", of_left);
    write_text(folder / "right.yaml", of_right);
    return error_of(folder / "left.yaml");
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
  CHECK_THAT(error_of(folder / "left.yaml"),
             Catch::Contains("the two are swapped: name them the other way round"));
  write_text(folder / "left.yaml", with_projection(left, 3, P3));
  write_text(folder / "right.yaml", with_projection(right, 3, P3));
  CHECK_THAT(error_of(folder / "left.yaml"), Catch::Contains("of both cameras have a baseline"));
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
    write_text(folder / "alone.yaml", left);
    CHECK_THAT(error_of(folder / "alone.yaml"), Catch::Contains("is one camera of a ROS pair"));
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
  CHECK_THAT(error_of(folder / "ost.txt"), Catch::Contains("ost.txt: is one camera of a ROS pair"));
  write_text(folder / "ost.txt", "[image]\nwidth\nmany\n");
  CHECK_THAT(error_of(folder / "ost.txt"), Catch::Contains("ost.txt:3: holds neither numbers nor a name"));
  write_text(folder / "ost.txt", "[image]\nwidth\n320\n");
  CHECK_THAT(error_of(folder / "ost.txt"), Catch::Contains("ost.txt: "));
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
  CHECK_THROWS_WITH(rig_of(other, info(-20.0)), Catch::Contains("equidistant has 0 distortion coefficients"));
  CHECK(rectified_of(other, info(20.0)).baseline_m == Approx(0.1));
  CHECK_THAT(baseline_warning(info(0.0), info(20.0)), Catch::Contains("a baseline of 0.1 m"));
}

TEST_CASE("Contradictions within a calibration of OpenCV are refused", "[calibration]") {
  const TemporaryFolder folder;
  Cameras cameras;
  const fs::path file = folder / "stereo.yml";
  const auto error = [&] {
    write_opencv(file, cameras);
    return error_of(file);
  };
  CHECK(error().empty());
  cameras.K2(0, 1) = 3.0;
  CHECK_THAT(error(), Catch::Contains("stereo.yml: M2: the camera matrix has a skew of 3"));
  cameras.K2 = Cameras().K2;
  cameras.K1(2, 2) = 2.0;
  CHECK_THAT(error(), Catch::Contains("the camera matrix is not [fx 0 cx; 0 fy cy; 0 0 1]"));
  cameras.K1 = Cameras().K1;
  write_opencv(file, cameras);
  const std::string text = read_text(file);
  write_text(file, text + "K1: [201, 0, 160, 0, 201, 60, 0, 0, 1]\n");
  CHECK_THAT(error_of(file), Catch::Contains("has both M1 and K1, which are the same"));
  write_text(file, text + "distCoeffs2: [0, 0, 0, 0]\n");
  CHECK_THAT(error_of(file), Catch::Contains("has both D2 and distCoeffs2"));

  write_text(file, text);
  for (const char* name : {"extrinsics.yml", "extrinsics.xml"}) {
    Cameras other;
    write_opencv(folder / name, other);
    check_rig(read_calibration(file), cameras, 0);
    other.T[0] *= 1.1;
    write_opencv(folder / name, other);
    CHECK_THAT(error_of(file), Catch::Contains(std::string("has other R and T than ") + name));
    fs::remove(folder / name);
  }
}

TEST_CASE("Poses in a file of Kalibr that contradict each other are refused", "[calibration]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "camchain.yaml";
  const std::string text = camchain(Cameras());
  const auto error_with = [&](const std::string& of_left, const std::string& of_right) {
    std::string changed = text;
    changed.insert(changed.find("cam1:\n") + 6, of_right);
    write_text(file, changed.insert(6, of_left));
    return error_of(file);
  };
  const auto pose = [](const char* key, double x_m, double z_m) {
    return fmt::format("  {}: [1, 0, 0, {}, 0, 1, 0, 0, 0, 0, 1, {}, 0, 0, 0, 1]\n", key, x_m, z_m);
  };
  const Eigen::Isometry3d T_right_left = read_calibration_rig(file, text).T_right_left;
  std::string consistent;
  for (int i = 0; i < 16; ++i)
    consistent += fmt::format("{}{:.4f}", i == 0 ? "" : ", ", T_right_left.matrix()(i / 4, i % 4));
  consistent = "  T_cam_imu: [" + consistent + "]\n";
  CHECK(error_with(pose("T_cam_imu", 0.0, 0.0), consistent).empty());
  CHECK_THAT(error_with(pose("T_cam_imu", 0.0, 0.0), pose("T_cam_imu", -0.4, 0.0)),
             Catch::Contains("camchain.yaml:") && Catch::Contains("T_cn_cnm1 contradicts T_cam_imu"));
  CHECK_THAT(
      error_with(pose("T_BS", 0.0, 0.0), pose("T_BS", 0.4, 0.0)),
      Catch::Contains("T_cn_cnm1 contradicts T_BS of the two cameras, which give a baseline of 0.4 m"));
  CHECK(error_with(pose("T_BS", 0.1, 0.2) + pose("T_cam_imu", -0.1, -0.2), "").empty());
  CHECK(error_with(pose("T_imu_cam", 0.1, 0.2) + pose("T_cam_imu", -0.1, -0.2), "").empty());
  CHECK_THAT(error_with(pose("T_imu_cam", 0.1, 0.2) + pose("T_cam_imu", 0.1, 0.2), ""),
             Catch::Contains("T_cam_imu is not the inverse of T_imu_cam"));
  CHECK_THAT(error_with(pose("T_imu_cam", 0.0, 0.0), pose("T_imu_cam", 0.5, 0.0)),
             Catch::Contains("T_cn_cnm1 contradicts T_imu_cam"));
  CHECK_THAT(error_with(pose("T_BS", 0.1, 0.2) + pose("T_cam_imu", 0.1, 0.2), ""),
             Catch::Contains("camchain.yaml:3: T_cam_imu is not the inverse of T_BS"));
}

TEST_CASE("Damaged calibrations of other programs are refused in one line", "[calibration]") {
  const TemporaryFolder folder;
  const Cameras cameras;
  CHECK_THAT(error_of(folder / "nowhere.yaml"), Catch::Contains("nowhere.yaml: missing"));
  write_text(folder / "a.xml", "<opencv_storage><M1>");
  CHECK_THAT(error_of(folder / "a.xml"), Catch::Contains("a.xml: "));
  write_text(folder / "a.xml", "<?xml version=\"1.0\"?><opencv_storage><M1>7</M1></opencv_storage>");
  CHECK_THAT(error_of(folder / "a.xml"), Catch::Contains("M1 is not a matrix or a list of 9 finite numbers"));
  write_text(folder / "nul.yaml",
             std::string("%YAML:1.0\n--\0_size: 32\nM1: !!opencv-matrix\n   rows: 3\n", 54));
  CHECK_THAT(error_of(folder / "nul.yaml"), Catch::Contains("nul.yaml:2: there is a zero byte"));
  write_text(folder / "endless.yaml", "%YAML:1.0\n---t: M132\nM1:\n-\n");  // OpenCV's parser does not end
  CHECK_THAT(error_of(folder / "endless.yaml"), Catch::Contains("M1 is not a matrix"));
  std::string deep = "<?xml version=\"1.0\"?><opencv_storage>";
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  write_text(folder / "deep.xml", deep);
  CHECK_THAT(error_of(folder / "deep.xml"), Catch::Contains("deep.xml: is no XML file of named values"));
  write_opencv(folder / "b.yaml", cameras);
  std::string text = read_text(folder / "b.yaml");
  write_text(folder / "b.yaml", text.replace(text.find("-2."), 3, ".nan, -2."));
  CHECK_THAT(error_of(folder / "b.yaml"), Catch::Contains("b.yaml: "));
  Cameras turned;
  turned.R = turned.R * 2.0;
  write_opencv(folder / "c.yaml", turned);
  CHECK_THAT(error_of(folder / "c.yaml"), Catch::Contains("R is not a rotation"));
  Cameras prism;
  prism.D1 = (cv::Mat_<double>(1, 12) << 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.1, 0, 0);
  write_opencv(folder / "d.yaml", prism);
  CHECK_THAT(error_of(folder / "d.yaml"), Catch::Contains("radtan has 12 distortion coefficients"));

  write_text(folder / "camera.yaml", camera_info(cameras, true));
  CHECK_THAT(error_of(folder / "camera.yaml"),
             Catch::Contains("call the two files left.yaml and right.yaml"));
  write_text(folder / "left.yaml", camera_info(cameras, true));
  CHECK_THAT(error_of(folder / "left.yaml"), Catch::Contains("right.yaml: missing"));
  write_text(folder / "right.yaml", camera_info(cameras, true));
  CHECK_THAT(error_of(folder / "left.yaml"),
             Catch::Contains("right.yaml: the projection matrix has no baseline"));
  write_text(folder / "right.yaml", "image_width: 320\nimage_height: 120\n");
  CHECK_THAT(error_of(folder / "left.yaml"), Catch::Contains("right.yaml:1: the file has no camera_matrix"));
}
