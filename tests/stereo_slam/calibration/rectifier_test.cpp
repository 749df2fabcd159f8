// SPDX-License-Identifier: MIT
#include "stereo_slam/calibration/rectifier.hpp"

#include <cmath>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "simulator/rendering/lens_view.hpp"
#include "stereo_slam/dataset/recording_hypotheses.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// The formulas of Distortion as they stand there.
Eigen::Vector2d project(const Lens& lens, const Eigen::Vector3d& p) {
  const double x = p.x() / p.z();
  const double y = p.y() / p.z();
  const double r2 = x * x + y * y;
  Eigen::Vector2d distorted(x, y);
  const auto& k = lens.coefficients;
  if (lens.distortion == Distortion::kRadTan) {
    const double s = 1.0 + k[0] * r2 + k[1] * r2 * r2;
    distorted = {s * x + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
                 s * y + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y};
  } else if (lens.distortion == Distortion::kEquidistant && r2 > 0.0) {
    const double theta = std::atan(std::sqrt(r2));
    const double t2 = theta * theta;
    const double factor = 1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])));
    distorted *= theta * factor / std::sqrt(r2);
  }
  return {lens.fx * distorted.x() + lens.cx, lens.fy * distorted.y() + lens.cy};
}

/// Images whose pixels are their own column and row.
std::pair<cv::Mat1f, cv::Mat1f> ramps(const Lens& lens) {
  cv::Mat1f columns(lens.height_px, lens.width_px);
  cv::Mat1f rows(lens.height_px, lens.width_px);
  for (int y = 0; y < columns.rows; ++y) {
    for (int x = 0; x < columns.cols; ++x) {
      columns(y, x) = static_cast<float>(x);
      rows(y, x) = static_cast<float>(y);
    }
  }
  return {columns, rows};
}

/// A rig whose right camera has images of another size, which show the same.
StereoRig with_right_scaled(StereoRig rig, double factor) {
  Lens& right = rig.right;
  right.width_px = static_cast<int>(factor * right.width_px);
  right.height_px = static_cast<int>(factor * right.height_px);
  for (double* value : {&right.fx, &right.fy, &right.cx, &right.cy}) *value *= factor;
  return rig;
}

void check_rectification(const StereoRig& rig) {
  const Rectifier rectifier(rig);
  const StereoCamera& camera = rectifier.camera();
  CHECK(camera.width_px == rig.left.width_px);
  CHECK(camera.height_px == rig.left.height_px);
  CHECK(rectifier.right_size() == cv::Size(rig.right.width_px, rig.right.height_px));
  CHECK(camera.baseline_m == Approx(rig.T_right_left.inverse().translation().norm()));
  CHECK(rectifier.coverage() > 0.997);  // a border of a pixel may be missing
  const auto [left_columns, left_rows] = ramps(rig.left);
  const auto [right_columns, right_rows] = ramps(rig.right);
  const cv::Mat1f left_u = rectifier.left(left_columns);
  const cv::Mat1f left_v = rectifier.left(left_rows);
  const cv::Mat1f right_u = rectifier.right(right_columns);
  const cv::Mat1f right_v = rectifier.right(right_rows);
  // Interpolation works with 32nds of a pixel, and the cubic kernel (a = -0.75) bends a ramp: (2a + 1)
  // (2t^3 - 3t^2
  // + t) at a fraction t, at most 0.0481.
  constexpr double kTolerance_px = 1.0 / 64.0 + 0.0482;
  for (int v = 4; v < camera.height_px - 4; v += 31) {
    for (int u = 44; u < camera.width_px - 4; u += 37) {
      for (const int d : {2, 40}) {
        CAPTURE(u, v, d);
        const Eigen::Vector3d z = Eigen::Vector3i(u, v, d).cast<double>();
        const Eigen::Vector3d p_left = rectifier.T_left_camera() * camera.back_project(z);
        const Eigen::Vector2d left_px = project(rig.left, p_left);
        const Eigen::Vector2d right_px = project(rig.right, rig.T_right_left * p_left);
        CHECK(std::abs(static_cast<double>(left_u(v, u)) - left_px.x()) < kTolerance_px);
        CHECK(std::abs(static_cast<double>(left_v(v, u)) - left_px.y()) < kTolerance_px);
        CHECK(std::abs(static_cast<double>(right_u(v, u - d)) - right_px.x()) < kTolerance_px);
        CHECK(std::abs(static_cast<double>(right_v(v, u - d)) - right_px.y()) < kTolerance_px);
      }
    }
  }
}

}  // namespace

TEST_CASE("The rectified images of a point lie in one row, a disparity apart", "[rectifier]") {
  for (const auto model : {Distortion::kRadTan, Distortion::kEquidistant}) {
    const StereoRig rig = simulator::euroc_like_rig(model);
    CHECK(Rectifier(rig).coverage() > 0.999);
    check_rectification(rig);
  }
}

TEST_CASE("The two cameras may have images of different sizes", "[rectifier]") {
  for (const auto model : {Distortion::kRadTan, Distortion::kEquidistant}) {
    for (const double factor : {0.5, 0.75, 2.0}) {
      CAPTURE(factor);
      check_rectification(with_right_scaled(simulator::euroc_like_rig(model), factor));
    }
  }
  StereoRig without = simulator::euroc_like_rig(Distortion::kRadTan);
  without.right.width_px = 0;
  CHECK_THROWS_WITH(Rectifier(without), Catch::Contains("the image sizes are 752x480 and 0x480"));
}

TEST_CASE("A recording whose cameras have images of different sizes is read", "[rectifier]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  fs::remove(folder / "calibration.yaml");
  write_text(folder / "times.txt", "0\n0.1\n0.2\n");
  const auto lens = [](int width, int height, double focal_px) {
    return fmt::format("{{resolution: [{}, {}], intrinsics: [{}, {}, {}, {}], distortion_model: none}}\n",
                       width, height, focal_px, focal_px, 0.5 * width, 0.5 * height);
  };
  const auto write_calibration = [&](const std::string& right) {
    write_text(folder / "calibration.yaml",
               "left: " + lens(320, 120, 200.0) + "right: " + right +
                   "T_right_left: [1, 0, 0, -0.4, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n");
  };
  for (const auto& entry : fs::directory_iterator(folder / "right")) {
    const cv::Mat image = cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE);
    cv::Mat half;
    cv::resize(image, half, cv::Size(160, 60));
    cv::imwrite(entry.path().string(), half);
  }
  write_calibration(lens(160, 60, 100.0));
  const auto scan = scan_sequence(folder.path(), "auto");
  for (const auto& problem : scan.problems) FAIL(problem.text);
  CHECK(scan.sequence.camera.width_px == 320);
  const StereoFrame frame = load_frame(scan.sequence, 1);
  CHECK(frame.left.size() == cv::Size(320, 120));
  CHECK(frame.right.size() == cv::Size(320, 120));
  CHECK_FALSE(has_one_image_twice(scan.sequence, 1));
  CHECK_NOTHROW((void)cause_of_disagreement(scan.sequence, Suspicion::kStrong));
  CHECK(load_raw_pair(scan.sequence, 0, 1).right.size() == cv::Size(160, 60));
  // The size that is wrong is that of the right images.
  write_calibration(lens(320, 120, 200.0));
  const auto wrong = scan_sequence(folder.path(), "auto");
  REQUIRE_FALSE(wrong.problems.empty());
  CHECK_THAT(wrong.problems[0].text, Catch::Contains("resolution is 320x120, but ") &&
                                         Catch::Contains("right/") &&
                                         Catch::Contains("has 160x60 pixels; if it was only "
                                                         "scaled, multiply fx, fy, cx and cy "
                                                         "by 0.5"));
}

TEST_CASE("A lens of 150 degrees becomes a view of 110 without a black border", "[rectifier]") {
  StereoRig rig = simulator::euroc_like_rig(Distortion::kEquidistant);
  for (auto* lens : {&rig.left, &rig.right}) {  // much like TUM-VI's
    *lens = {.width_px = 512,
             .height_px = 512,
             .fx = 191.0,
             .fy = 191.0,
             .cx = 254.9,
             .cy = 256.9,
             .distortion = Distortion::kEquidistant,
             .coefficients = {0.0034, 0.0007, -0.0020, 0.0002}};
  }
  const Rectifier rectifier(rig);
  CHECK(rectifier.camera().fx == Approx(256.0 / std::tan(55.0 * CV_PI / 180.0)));
  CHECK(rectifier.coverage() > 0.999);
}

TEST_CASE("Distortions that no lens has are refused, not rectified to a camera that is none", "[rectifier]") {
  // Found by tests/fuzz: OpenCV's focal length is negative.
  StereoRig rig;
  for (Lens* lens : {&rig.left, &rig.right}) {
    *lens = {.fx = 40.0, .fy = 40.0, .cx = 24.0, .cy = 16.0, .coefficients = {0.01, -0.06, 0.03, -0.004}};
    lens->distortion = Distortion::kEquidistant;
    lens->width_px = 48;
    lens->height_px = 32;
  }
  rig.left.coefficients[1] = -6.02;
  rig.T_right_left.translation().x() = -0.11;
  CHECK_THROWS_WITH(Rectifier(rig), Catch::Contains("do not fit together"));
}

TEST_CASE("The simulator's inverse lens formulas agree with the formulas", "[rectifier][simulate]") {
  for (const auto model : {Distortion::kRadTan, Distortion::kEquidistant}) {
    const Lens lens = simulator::euroc_like_rig(model).left;
    for (double v = 0.0; v < lens.height_px; v += 23.3) {
      for (double u = 0.0; u < lens.width_px; u += 31.7) {
        const auto ray = simulator::ray_of_pixel(lens, u, v);
        REQUIRE(ray);
        CHECK((project(lens, {ray->x(), ray->y(), 1.0}) - Eigen::Vector2d(u, v)).norm() < 1e-9);
      }
    }
  }
}
