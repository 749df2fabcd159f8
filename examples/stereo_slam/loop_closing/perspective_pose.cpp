// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/perspective_pose.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <opencv2/calib3d.hpp>

#include <antipode/opencv/pose.hpp>

#include "stereo_slam/odometry/three_point_sample.hpp"

namespace stereo_slam {
namespace {

constexpr double kMaxReprojectionError_px = 4.0;  // of a RANSAC inlier, in (u, v, disparity)

/// The same point in the coordinates of both cameras.
struct PointInBoth {
  Vector3<double> previous;
  Vector3<double> current;
  double variance = 0.0;  // sum of those of its distances from the two cameras, m^2
};

[[nodiscard]] PointInBoth back_projected(const StereoCorrespondence& c, const StereoCamera& camera,
                                         double disparity_sigma_px) {
  PointInBoth result{camera.back_project(c.previous), camera.back_project(c.current)};
  const double previous_sigma = disparity_sigma_px * result.previous.norm() / c.previous.z();
  const double current_sigma = disparity_sigma_px * result.current.norm() / c.current.z();
  result.variance = previous_sigma * previous_sigma + current_sigma * current_sigma;
  return result;
}

/// Whether two points may be as far from each other in one frame as in the other.
[[nodiscard]] bool equally_far(const PointInBoth& a, const PointInBoth& b) {
  constexpr double kSigmas = 3.0;
  const double change = (a.previous - b.previous).norm() - (a.current - b.current).norm();
  return change * change < kSigmas * kSigmas * (a.variance + b.variance);
}

/// The poses T_current_previous, up to four, that project three points to where they are in the current
/// image (T. Ke, S. Roumeliotis, "An Efficient Algebraic Solution to the Perspective-Three-Point Problem",
/// CVPR 2017).
[[nodiscard]] std::vector<Pose> three_point_poses(const std::array<cv::Point3d, 3>& points,
                                                  const std::array<cv::Point2d, 3>& pixels,
                                                  const StereoCamera& camera) {
  const cv::Matx33d K(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  cv::solveP3P(points, pixels, K, cv::noArray(), rotations, translations, cv::SOLVEPNP_AP3P);
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    if (!cv::checkRange(rotations[i]) || !cv::checkRange(translations[i])) continue;
    poses.push_back(antipode::pose_from_cv<double>(rotations[i], translations[i]));
  }
  return poses;
}

/// RANSAC over the correspondences of two frames.
class PerspectiveRansac {
 public:
  PerspectiveRansac(std::span<const StereoCorrespondence> correspondences, const StereoCamera& camera,
                    const LoopVerificationSettings& settings)
      : correspondences_(correspondences),
        camera_(camera),
        sigma_px_(settings.pixel_sigma_px),
        max_error2_(kMaxReprojectionError_px * kMaxReprojectionError_px) {
    points_.reserve(correspondences.size());
    for (const auto& c : correspondences) {
      points_.push_back(back_projected(c, camera, settings.pixel_sigma_px));
    }
  }

  /// Tries the poses of one sample.
  void add(const ThreePointSample& sample) {
    const auto& [i, j, k] = sample;
    const bool rigid = equally_far(points_[i], points_[j]) && equally_far(points_[j], points_[k]) &&
                       equally_far(points_[k], points_[i]);
    if (!rigid) return;
    std::array<cv::Point3d, 3> points;
    std::array<cv::Point2d, 3> pixels;
    for (std::size_t n = 0; n < sample.size(); ++n) {
      const Vector3<double>& p = points_[sample[n]].previous;
      const StereoPoint& z = correspondences_[sample[n]].current;
      points[n] = {p.x(), p.y(), p.z()};
      pixels[n] = {z.x(), z.y()};
    }
    for (const Pose& pose : three_point_poses(points, pixels, camera_)) judge(pose);
  }

  /// Share of the correspondences that agree with the best pose.
  [[nodiscard]] double inlier_share() const { return inliers() / static_cast<double>(points_.size()); }

  /// T_previous_current by adjustment of the correspondences that agree with the best pose, if more than a
  /// sample do. One sample, perhaps of points that are close together, determines it badly.
  [[nodiscard]] std::optional<Pose> adjusted() const {
    if (inliers() < 4) return std::nullopt;
    const TwoViewAdjustment adjustment(correspondences_, camera_, T_previous_current_, sigma_px_);
    const auto solution = adjustment.solve(T_previous_current_, is_inlier_);
    return solution ? solution->pose : T_previous_current_;
  }

 private:
  /// Number of correspondences that agree with the best pose.
  [[nodiscard]] double inliers() const {
    return static_cast<double>(std::count(is_inlier_.begin(), is_inlier_.end(), 1));
  }

  /// A pose becomes the best one if the sum of its squared errors in (u, v, d), each limited to that of an
  /// inlier, is less.
  void judge(const Pose& T_current_previous) {
    const Matrix3<double> R = T_current_previous.rotation_matrix();
    const Vector3<double> t = T_current_previous.translation();
    std::vector<std::uint8_t> is_inlier(points_.size(), 0);
    double cost = 0.0;
    for (std::size_t i = 0; i < points_.size() && cost < cost_; ++i) {
      const auto z = camera_.project(R * points_[i].previous + t);
      const double error2 = z ? (correspondences_[i].current - *z).squaredNorm() : max_error2_;
      is_inlier[i] = error2 < max_error2_ ? 1 : 0;
      cost += is_inlier[i] != 0 ? error2 : max_error2_;
    }
    if (cost >= cost_) return;
    T_previous_current_ = T_current_previous.inverse();
    cost_ = cost;
    is_inlier_ = std::move(is_inlier);
  }

  std::span<const StereoCorrespondence> correspondences_;
  const StereoCamera& camera_;
  double sigma_px_;
  double max_error2_;
  std::vector<PointInBoth> points_;
  Pose T_previous_current_;
  double cost_ = std::numeric_limits<double>::infinity();
  std::vector<std::uint8_t> is_inlier_{};
};

}  // namespace

std::optional<Pose> perspective_pose(std::span<const StereoCorrespondence> correspondences,
                                     int fewest_inliers, const StereoCamera& camera,
                                     const LoopVerificationSettings& settings, std::mt19937_64& random) {
  if (correspondences.size() < 4) return std::nullopt;
  PerspectiveRansac ransac(correspondences, camera, settings);
  const double fewest_share = fewest_inliers / static_cast<double>(correspondences.size());
  for (int draw = 0; draw < settings.ransac_iterations; ++draw) {
    if (draw >= sufficient_draws(std::max(ransac.inlier_share(), fewest_share))) break;
    ransac.add(draw_three(correspondences.size(), random));
  }
  return ransac.adjusted();
}

}  // namespace stereo_slam
