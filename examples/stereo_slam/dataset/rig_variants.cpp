// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/rig_variants.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/calib3d.hpp>

#include "stereo_slam/core/median.hpp"

namespace stereo_slam {
namespace {

/// The rays (X/Z, Y/Z) of points in a raw image.
std::vector<cv::Point2d> rays_of(const Lens& lens, const std::vector<cv::Point2d>& points_px) {
  const cv::Matx33d K(lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0);
  const cv::Mat D = lens.distortion == Distortion::kNone ? cv::Mat(cv::Mat::zeros(4, 1, CV_64F))
                                                         : cv::Mat(lens.coefficients, /*copyData=*/true);
  std::vector<cv::Point2d> rays;
  if (lens.distortion == Distortion::kEquidistant)
    cv::fisheye::undistortPoints(points_px, rays, K, D);
  else
    cv::undistortPoints(points_px, rays, K, D);
  return rays;
}

}  // namespace

StereoRig with_size_factor(StereoRig rig, double factor) {
  for (auto* lens : {&rig.left, &rig.right}) {
    for (double* value_px : {&lens->fx, &lens->fy, &lens->cx, &lens->cy}) *value_px *= factor;
  }
  return rig;
}

StereoRig with_order(StereoRig rig, const std::array<std::size_t, 4>& order) {
  for (auto* lens : {&rig.left, &rig.right}) {
    const std::array<double, 4> given = {lens->fx, lens->fy, lens->cx, lens->cy};
    lens->fx = given[order[0]];
    lens->fy = given[order[1]];
    lens->cx = given[order[2]];
    lens->cy = given[order[3]];
  }
  return rig;
}

StereoRig with_focal_factor(StereoRig rig, double factor) {
  for (auto* lens : {&rig.left, &rig.right}) {
    lens->fx *= factor;
    lens->fy *= factor;
  }
  return rig;
}

StereoRig with_radial_distortion(StereoRig rig, double factor) {
  const double k1 = std::log(factor);
  for (auto* lens : {&rig.left, &rig.right}) {
    lens->distortion = Distortion::kRadTan;
    lens->coefficients = {k1, k1 * k1, 0.0, 0.0};
  }
  return rig;
}

bool has_distortion(const StereoRig& rig) {
  const auto is_distorted = [](const Lens& lens) {
    return std::ranges::any_of(lens.coefficients, [](double k) { return k != 0.0; });
  };
  return is_distorted(rig.left) || is_distorted(rig.right);
}

StereoRig with_opposite_distortion(StereoRig rig) {
  for (auto* lens : {&rig.left, &rig.right}) {
    for (double& k : lens->coefficients) k = -k;
  }
  return rig;
}

StereoRig with_other_lens_model(StereoRig rig) {
  for (auto* lens : {&rig.left, &rig.right}) {
    lens->distortion =
        lens->distortion == Distortion::kEquidistant ? Distortion::kRadTan : Distortion::kEquidistant;
    lens->coefficients.resize(4, 0.0);
  }
  return rig;
}

namespace {

/// The signed distances of corners of the raw right images from the epipolar lines of their partners, px:
/// positive below the line.
std::vector<double> epipolar_distances_px(const StereoRig& rig, const std::vector<CornerPair>& pairs) {
  if (pairs.empty()) return {};
  std::vector<cv::Point2d> left_px(pairs.size());
  std::vector<cv::Point2d> right_px(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    left_px[i] = pairs[i].left_px;
    right_px[i] = pairs[i].right_px;
  }
  const auto left = rays_of(rig.left, left_px);
  const auto right = rays_of(rig.right, right_px);
  const Eigen::Vector3d t = rig.T_right_left.translation();
  std::vector<double> distances_px;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d line =
        t.cross(rig.T_right_left.linear() * Eigen::Vector3d(left[i].x, left[i].y, 1.0));
    const double distance = line.dot(Eigen::Vector3d(right[i].x, right[i].y, 1.0)) / line.head<2>().norm();
    if (std::isfinite(distance)) distances_px.push_back(rig.right.fy * distance);
  }
  return distances_px;
}

}  // namespace

double row_displacement_px(const StereoRig& rig, const std::vector<CornerPair>& pairs) {
  return median(epipolar_distances_px(rig, pairs));
}

StereoRig with_row_displacement(StereoRig rig, double displacement_px) {
  rig.right.cy += displacement_px;
  return rig;
}

double epipolar_distance_px(const StereoRig& rig, const std::vector<CornerPair>& pairs) {
  auto distances_px = epipolar_distances_px(rig, pairs);
  // A displacement of the right image along the columns is another mistake than a wrong scale.
  const double displacement_px = median(distances_px);
  for (double& distance_px : distances_px) distance_px = std::abs(distance_px - displacement_px);
  return median(std::move(distances_px));
}

double best_factor(const StereoRig& rig, const std::vector<CornerPair>& pairs,
                   StereoRig (*with_factor)(StereoRig, double)) {
  constexpr double kMostLog = 0.48;
  double best_log = 0.0;
  double least_px = std::numeric_limits<double>::infinity();
  const auto search = [&](double from, double to, double step) {
    for (double log = from; log <= to; log += step) {
      const double distance_px = epipolar_distance_px(with_factor(rig, std::exp(log)), pairs);
      if (distance_px >= least_px) continue;
      least_px = distance_px;
      best_log = log;
    }
  };
  search(-kMostLog, kMostLog, 0.02);
  search(best_log - 0.02, best_log + 0.02, 0.004);
  return std::exp(best_log);
}

}  // namespace stereo_slam
