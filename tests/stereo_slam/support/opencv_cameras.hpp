// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include "stereo_slam/calibration/calibration_file.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

/// Calibrations of two cameras, as OpenCV, ROS and Kalibr write them.
namespace stereo_slam::test {

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
inline void write_opencv(const fs::path& file, const Cameras& cameras, bool with_extrinsics = true,
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
inline std::string camera_info(const Cameras& cameras, bool left) {
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

inline std::string camchain(const Cameras& cameras) {
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

inline void check_rig(const OwnCamera& own, const Cameras& cameras, int width_px,
                      std::size_t coefficients = 5) {
  REQUIRE(own.rig);
  const auto& [left, right, T_right_left, T_body_left, imu_later_ns] = *own.rig;
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
inline std::string with_projection(std::string text, int element, double value) {
  auto at = text.find("data: [", text.find("projection_matrix")) + 7;
  for (int i = 0; i < element; ++i) at = text.find(", ", at) + 2;
  return text.replace(at, text.find_first_of(",]", at) - at, fmt::format("{}", value));
}

inline StereoRig read_calibration_rig(const fs::path& file, const std::string& text) {
  write_text(file, text);
  return read_calibration(file).rig.value();
}

inline std::string calibration_error(const fs::path& file) {
  auto message = message_of([&] { (void)read_calibration(file); });
  CHECK(std::count(message.begin(), message.end(), '\n') == 0);
  return message;
}

}  // namespace stereo_slam::test
