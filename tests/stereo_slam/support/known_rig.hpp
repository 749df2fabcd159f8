// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include "simulator/rendering/lens_view.hpp"
#include "stereo_slam/calibration/calibration_file.hpp"
#include "stereo_slam/calibration/rectifier.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

/// A rig whose lenses and poses are known, to be written in the files of many programs and read again.
namespace stereo_slam::test {

template <class Matrix>
std::string row_by_row(const Matrix& matrix) {
  std::string text;
  for (int i = 0; i < matrix.rows(); ++i) {
    for (int j = 0; j < matrix.cols(); ++j)
      text += fmt::format("{}{:.17g}", i + j == 0 ? "" : ", ", static_cast<double>(matrix(i, j)));
  }
  return text;
}

template <class Matrix>
std::string opencv_matrix(const Matrix& matrix, const char* type = "d") {
  return fmt::format("!!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: {}\n   data: [ {} ]\n", matrix.rows(),
                     matrix.cols(), type, row_by_row(matrix));
}

inline Eigen::Matrix3d matrix_of(const Lens& lens) {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = lens.fx;
  K(1, 1) = lens.fy;
  K(0, 2) = lens.cx;
  K(1, 2) = lens.cy;
  return K;
}

inline Eigen::RowVectorXd coefficients_of(const Lens& lens) {
  return Eigen::Map<const Eigen::RowVectorXd>(lens.coefficients.data(),
                                              static_cast<Eigen::Index>(lens.coefficients.size()));
}

/// EuRoC's rig with a pose in the body.
inline StereoRig known_rig(Distortion model) {
  StereoRig rig = simulator::euroc_like_rig(model);
  rig.T_body_left = Eigen::Translation3d(0.1, -0.2, 0.3) *
                    Eigen::AngleAxisd(0.5, Eigen::Vector3d(1.0, 2.0, -1.0).normalized());
  return rig;
}

/// R and P of both cameras as cv::stereoRectify gives them.
struct Rectified {
  Eigen::Matrix3d R_left, R_right;
  Eigen::Matrix<double, 3, 4> P_left, P_right;
};

inline Rectified rectify_with_opencv(const StereoRig& rig) {
  const auto to_cv = [](const Eigen::MatrixXd& matrix) {
    cv::Mat result(static_cast<int>(matrix.rows()), static_cast<int>(matrix.cols()), CV_64F);
    for (int i = 0; i < result.rows; ++i) {
      for (int j = 0; j < result.cols; ++j) result.at<double>(i, j) = matrix(i, j);
    }
    return result;
  };
  cv::Matx33d R1, R2;
  cv::Matx34d P1, P2;
  cv::Matx44d Q;
  cv::stereoRectify(to_cv(matrix_of(rig.left)), to_cv(coefficients_of(rig.left)), to_cv(matrix_of(rig.right)),
                    to_cv(coefficients_of(rig.right)), cv::Size(rig.left.width_px, rig.left.height_px),
                    to_cv(rig.T_right_left.linear()), to_cv(rig.T_right_left.translation()), R1, R2, P1, P2,
                    Q, cv::CALIB_ZERO_DISPARITY, 0.0);
  using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  using RowMajor34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  return {Eigen::Map<RowMajor3>(R1.val), Eigen::Map<RowMajor3>(R2.val), Eigen::Map<RowMajor34>(P1.val),
          Eigen::Map<RowMajor34>(P2.val)};
}

inline void check_lens(const Lens& lens, const Lens& known) {
  CHECK(lens.width_px == known.width_px);
  CHECK(lens.height_px == known.height_px);
  CHECK(lens.distortion == known.distortion);
  CHECK((matrix_of(lens) - matrix_of(known)).cwiseAbs().maxCoeff() < 1e-12 * known.fx);
  for (std::size_t i = 0; i < std::max(lens.coefficients.size(), known.coefficients.size()); ++i) {
    const auto at = [&](const Lens& one) { return i < one.coefficients.size() ? one.coefficients[i] : 0.0; };
    CHECK(at(lens) == Approx(at(known)).margin(1e-15));
  }
}

/// The same lenses and relative pose, to `tolerance`, and the same rectified camera.
inline void check_same(const OwnCamera& own, const StereoRig& known, bool with_body,
                       double tolerance = 1e-12) {
  REQUIRE(own.rig);
  check_lens(own.rig->left, known.left);
  check_lens(own.rig->right, known.right);
  CHECK((own.rig->T_right_left.matrix() - known.T_right_left.matrix()).cwiseAbs().maxCoeff() < tolerance);
  REQUIRE(own.rig->T_body_left.has_value() == with_body);
  if (with_body)
    CHECK((own.rig->T_body_left->matrix() - known.T_body_left->matrix()).cwiseAbs().maxCoeff() < tolerance);
  const StereoCamera camera = Rectifier(*own.rig).camera();
  const StereoCamera expected = Rectifier(known).camera();
  const double tolerance_px = 1e3 * tolerance * expected.fx;
  CHECK(std::abs(camera.fx - expected.fx) < tolerance_px);
  CHECK(std::abs(camera.cx - expected.cx) < tolerance_px);
  CHECK(std::abs(camera.cy - expected.cy) < tolerance_px);
  CHECK(std::abs(camera.baseline_m - expected.baseline_m) < 10.0 * tolerance);
}

/// Reads a text as it is, and with the line ends and the byte order mark of Windows, and comments.
template <class Check>
void read_variants(const fs::path& file, const std::string& text, const Check& check) {
  std::string crlf;
  for (const char c : text) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  std::string commented = "# a comment\n";
  const bool is_json = text.front() == '{';
  for (const auto& variant :
       {text, crlf, "\xEF\xBB\xBF" + text, is_json ? text + "\n\n" : commented + text}) {
    CAPTURE(variant);
    write_text(file, variant);
    check(read_calibration(file));
  }
}

inline std::string error_in(const fs::path& file, const std::string& text) {
  write_text(file, text);
  auto message = message_of([&] { (void)read_calibration(file); });
  CHECK(std::count(message.begin(), message.end(), '\n') == 0);
  CHECK_THAT(message, Catch::Contains(file.filename().string() + ":"));
  return message;
}

inline std::string replaced(std::string text, const std::string& was, const std::string& is) {
  for (std::size_t at = 0; (at = text.find(was, at)) != std::string::npos; at += is.size())
    text.replace(at, was.size(), is);
  return text;
}

}  // namespace stereo_slam::test
