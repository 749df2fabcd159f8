// SPDX-License-Identifier: MIT
#include "simulator/rendering/lens_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include <opencv2/imgproc.hpp>

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector2d;

constexpr int kPointsPerSide = 2;  // of a pixel

double coefficient(const Lens& lens, std::size_t i) {
  return i < lens.coefficients.size() ? lens.coefficients[i] : 0.0;
}

/// Solves theta (1 + k1 theta^2 + ...) = r for theta by Newton's method.
std::optional<double> invert_equidistant(const Lens& lens, double r) {
  double theta = r;
  for (int step = 0; step < 30; ++step) {
    double value = theta;
    double slope = 1.0;
    double power = 1.0;
    for (std::size_t i = 0; i < 4; ++i) {
      power *= theta * theta;
      value += coefficient(lens, i) * power * theta;
      slope += (2.0 * static_cast<double>(i) + 3.0) * coefficient(lens, i) * power;
    }
    if (!(slope > 0.0)) return std::nullopt;
    const double change = (value - r) / slope;
    theta -= change;
    if (std::abs(change) < 1e-14) return theta;
  }
  return std::nullopt;
}

/// Iterates x = (x' - tangential(x)) / s(x) until x converges.
std::optional<Vector2d> invert_radtan(const Lens& lens, const Vector2d& distorted) {
  const double p1 = coefficient(lens, 2);
  const double p2 = coefficient(lens, 3);
  Vector2d x = distorted;
  for (int step = 0; step < 500; ++step) {
    const double r2 = x.squaredNorm();
    const double r4 = r2 * r2;
    const double s =
        (1.0 + coefficient(lens, 0) * r2 + coefficient(lens, 1) * r4 + coefficient(lens, 4) * r2 * r4) /
        (1.0 + coefficient(lens, 5) * r2 + coefficient(lens, 6) * r4 + coefficient(lens, 7) * r2 * r4);
    const double xy = x.x() * x.y();
    const Vector2d tangential(2.0 * p1 * xy + p2 * (r2 + 2.0 * x.x() * x.x()),
                              p1 * (r2 + 2.0 * x.y() * x.y()) + 2.0 * p2 * xy);
    const Vector2d next = (distorted - tangential) / s;
    const double change = (next - x).norm();
    x = next;
    if (!(change < 10.0)) return std::nullopt;
    if (change < 1e-13) return x;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Vector2d> ray_of_pixel(const Lens& lens, double u, double v) {
  const Vector2d distorted((u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy);
  const double max_ray = std::tan(85.0 * std::numbers::pi / 180.0);
  std::optional<Vector2d> ray;
  switch (lens.distortion) {
    case Distortion::kNone:
      ray = distorted;
      break;
    case Distortion::kRadTan:
      ray = invert_radtan(lens, distorted);
      break;
    case Distortion::kEquidistant: {
      const double r = distorted.norm();
      const auto theta = invert_equidistant(lens, r);
      if (theta && *theta < 0.5 * std::numbers::pi)
        ray = r < 1e-12 ? distorted : Vector2d(distorted / r * std::tan(*theta));
      break;
    }
  }
  if (ray && !(ray->norm() < max_ray)) ray.reset();
  return ray;
}

LensView::LensView(const Lens& lens) : size_(lens.width_px, lens.height_px) {
  cv::Mat2d rays(kPointsPerSide * size_.height, kPointsPerSide * size_.width);
  Vector2d smallest = Vector2d::Zero();
  Vector2d largest = Vector2d::Zero();
  const auto centre = [](int point) { return (point + 0.5) / kPointsPerSide - 0.5; };
  for (int y = 0; y < rays.rows; ++y) {
    for (int x = 0; x < rays.cols; ++x) {
      const auto ray = ray_of_pixel(lens, centre(x), centre(y));
      if (!ray) {
        throw std::invalid_argument("lens: the pixel (" + std::to_string(centre(x)) + ", " +
                                    std::to_string(centre(y)) +
                                    ") sees nothing within 85 degrees of the axis");
      }
      rays(y, x) = {ray->x(), ray->y()};
      smallest = smallest.cwiseMin(*ray);
      largest = largest.cwiseMax(*ray);
    }
  }
  constexpr double kDensity = 1.5;  // rendered pixels per lens pixel, along an axis, in the image centre
  constexpr int kMargin_px = 2;
  const double focal_px = kDensity * std::max(lens.fx, lens.fy);
  const Vector2d extent_px = focal_px * (largest - smallest);
  pinhole_ = {.width_px = static_cast<int>(std::ceil(extent_px.x())) + 2 * kMargin_px,
              .height_px = static_cast<int>(std::ceil(extent_px.y())) + 2 * kMargin_px,
              .fx = focal_px,
              .fy = focal_px,
              .cx = kMargin_px - focal_px * smallest.x(),
              .cy = kMargin_px - focal_px * smallest.y()};
  positions_.create(rays.size());
  for (int y = 0; y < rays.rows; ++y) {
    for (int x = 0; x < rays.cols; ++x) {
      positions_(y, x) = {static_cast<float>(focal_px * rays(y, x)[0] + pinhole_.cx),
                          static_cast<float>(focal_px * rays(y, x)[1] + pinhole_.cy)};
    }
  }
}

cv::Mat1f LensView::through(const cv::Mat1f& pinhole_light) const {
  cv::Mat1f points;
  cv::remap(pinhole_light, points, positions_, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::Mat1f light;
  cv::resize(points, light, size_, 0.0, 0.0, cv::INTER_AREA);
  return light;
}

StereoRig euroc_like_rig(Distortion distortion, double scale) {
  if (distortion == Distortion::kNone)
    throw std::invalid_argument("distortion must be radtan or equidistant for the EuRoC layout");
  const auto lens = [&](double fx, double fy, double cx, double cy, std::vector<double> coefficients) {
    return Lens{.width_px = static_cast<int>(std::lround(752 * scale)),
                .height_px = static_cast<int>(std::lround(480 * scale)),
                .fx = fx * scale,
                .fy = fy * scale,
                .cx = (cx + 0.5) * scale - 0.5,
                .cy = (cy + 0.5) * scale - 0.5,
                .distortion = distortion,
                .coefficients = std::move(coefficients)};
  };
  StereoRig rig;
  if (distortion == Distortion::kRadTan) {
    rig.left = lens(459.1, 457.8, 366.4, 247.3, {-0.283, 0.0741, 1.9e-4, 2.1e-5});
    rig.right = lens(457.2, 456.0, 379.1, 254.6, {-0.279, 0.0722, -1.1e-4, -3.4e-5});
  } else {
    rig.left = lens(381.5, 380.9, 371.2, 244.0, {-0.0127, 0.0061, -0.0042, 0.0009});
    rig.right = lens(379.8, 380.2, 378.4, 236.9, {-0.0102, 0.0048, -0.0037, 0.0007});
  }
  constexpr double kBaseline_m = 0.3;
  Eigen::Isometry3d T_left_right = Eigen::Isometry3d::Identity();
  T_left_right.linear() = (Eigen::AngleAxisd(0.008, Eigen::Vector3d::UnitX()) *
                           Eigen::AngleAxisd(-0.012, Eigen::Vector3d::UnitY()) *
                           Eigen::AngleAxisd(0.006, Eigen::Vector3d::UnitZ()))
                              .toRotationMatrix();
  T_left_right.translation() << kBaseline_m, 0.004, -0.003;
  rig.T_right_left = T_left_right.inverse();
  // A body frame with other axes than the camera, like that of an IMU.
  Eigen::Isometry3d T_body_left = Eigen::Isometry3d::Identity();
  T_body_left.linear() = (Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitZ()) *
                          Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()))
                             .toRotationMatrix();
  T_body_left.translation() << -0.12, -0.06, 0.08;
  rig.T_body_left = T_body_left;
  return rig;
}

}  // namespace stereo_slam::simulator
