// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/camera_from_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/core/median.hpp"
#include "stereo_slam/core/parallel.hpp"

namespace stereo_slam {
namespace {

using Matrix2x3 = Eigen::Matrix<double, 2, 3>;
using Matrix3x6 = Eigen::Matrix<double, 3, 6>;

/// What is estimated: log of the focal length and principal point, both relative to the calibration, and the
/// motion of each pair of frames, in baselines.
struct Unknowns {
  double focal_px = 0.0;
  Eigen::Vector2d centre_px;
  std::vector<Eigen::Isometry3d> T_second_first;
};

/// Error of a predicted point, px, and its derivatives by (log f, cx, cy) and by the motion (rotation,
/// translation; on the left).
struct Prediction {
  Eigen::Vector2d error_px;
  double sigma_px = 1.0;  ///< of the error for one pixel of noise in each measurement
  Matrix2x3 J_camera;
  Eigen::Matrix<double, 2, 6> J_motion;
  bool in_front = true;
};

Prediction predict(const Unknowns& x, std::size_t pair, const MovedPoint& point) {
  const double f = x.focal_px;
  const double inverse_d = 1.0 / point.disparity_px;
  const Eigen::Isometry3d& T = x.T_second_first[pair];
  Eigen::Vector3d p;
  p << (point.first_px - x.centre_px) * inverse_d, f * inverse_d;
  const Eigen::Vector3d turned = T.linear() * p;
  const Eigen::Vector3d q = turned + T.translation();
  Prediction result;
  constexpr double kNearest = 0.1;  // baselines
  result.in_front = q.z() > kNearest && turned.z() > kNearest;
  if (!result.in_front) return result;
  const Eigen::Vector2d ray = q.head<2>() / q.z();
  result.error_px = f * ray + x.centre_px - point.second_px;
  Matrix2x3 J_point;
  J_point << 1.0, 0.0, -ray.x(), 0.0, 1.0, -ray.y();
  J_point *= f / q.z();
  Eigen::Matrix3d J_p;  // of p by the camera
  J_p << 0.0, -inverse_d, 0.0, 0.0, 0.0, -inverse_d, f * inverse_d, 0.0, 0.0;
  result.J_camera = J_point * T.linear() * J_p;
  result.J_camera.col(0) += f * ray;
  result.J_camera.rightCols<2>() += Eigen::Matrix2d::Identity();
  Eigen::Matrix3d cross;
  cross << 0.0, -q.z(), q.y(), q.z(), 0.0, -q.x(), -q.y(), q.x(), 0.0;
  result.J_motion.leftCols<3>() = -J_point * cross;
  result.J_motion.rightCols<3>() = J_point;
  // An error of the disparity moves the point along its ray, which matters as far as the camera has moved.
  const double parallax_px = f * (ray - turned.head<2>() / turned.z()).norm();
  result.sigma_px = std::hypot(std::sqrt(2.0), parallax_px * inverse_d);
  return result;
}

/// Normal equations of one pair, and those of the camera that remain without its motion.
struct PairEquations {
  Matrix6<double> H = Matrix6<double>::Zero();
  Vector6<double> g = Vector6<double>::Zero();
  Matrix3x6 H_camera_motion = Matrix3x6::Zero();
  Eigen::Matrix3d H_camera = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g_camera = Eigen::Vector3d::Zero();
};

PairEquations equations_of(const Unknowns& x, std::size_t pair, const std::vector<MovedPoint>& points,
                           double scale_px) {
  PairEquations e;
  for (const auto& point : points) {
    const Prediction p = predict(x, pair, point);
    if (!p.in_front) continue;
    const double relative2 = p.error_px.squaredNorm() / (p.sigma_px * p.sigma_px * scale_px * scale_px);
    const double weight = 1.0 / ((1.0 + relative2) * p.sigma_px * p.sigma_px);
    e.H += weight * p.J_motion.transpose() * p.J_motion;
    e.g += weight * p.J_motion.transpose() * p.error_px;
    e.H_camera_motion += weight * p.J_camera.transpose() * p.J_motion;
    e.H_camera += weight * p.J_camera.transpose() * p.J_camera;
    e.g_camera += weight * p.J_camera.transpose() * p.error_px;
  }
  e.H.diagonal().array() += 1e-9 * e.H.trace() + 1e-12;
  return e;
}

void move(Eigen::Isometry3d& T, const Vector6<double>& step) {
  const Eigen::Vector3d turn = step.head<3>();
  const double angle = turn.norm();
  Eigen::Isometry3d change = Eigen::Isometry3d::Identity();
  if (angle > 0.0) change.linear() = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  change.translation() = step.tail<3>();
  T = change * T;
}

/// What of the camera is estimated besides the motions.
enum class FreeCamera { kNothing, kCentre, kAll };

/// One Gauss-Newton step. Returns the information of the camera.
Eigen::Matrix3d step(Unknowns& x, const std::vector<std::vector<MovedPoint>>& pairs, double scale_px,
                     FreeCamera free) {
  constexpr double kLongestStep = 0.2;  // of log f
  std::vector<PairEquations> equations;
  Eigen::Matrix3d S = Eigen::Matrix3d::Zero();
  Eigen::Vector3d s = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto& e = equations.emplace_back(equations_of(x, k, pairs[k], scale_px));
    const Matrix3x6 gain = e.H.ldlt().solve(e.H_camera_motion.transpose()).transpose();
    S += e.H_camera - gain * e.H_camera_motion.transpose();
    s += e.g_camera - gain * e.g;
  }
  Eigen::Vector3d change = Eigen::Vector3d::Zero();
  if (free != FreeCamera::kNothing) {
    constexpr double kFixed = 1e15;
    Eigen::Matrix3d damped = S;  // straight motion leaves the camera open
    damped.diagonal() += Eigen::Vector3d(free == FreeCamera::kAll ? 10.0 : kFixed, 1e-4, 1e-4);
    change = -damped.ldlt().solve(s);
    change.x() = std::clamp(change.x(), -kLongestStep, kLongestStep);
  }
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto& e = equations[k];
    move(x.T_second_first[k], -e.H.ldlt().solve(e.g + e.H_camera_motion.transpose() * change));
  }
  x.focal_px *= std::exp(change.x());
  x.centre_px += change.tail<2>();
  return S;
}

/// Twenty steps. Returns the information of the camera, for a noise of 1 px.
Eigen::Matrix3d iterate(Unknowns& x, const std::vector<std::vector<MovedPoint>>& pairs, double scale_px,
                        FreeCamera free) {
  constexpr int kSteps = 20;
  Eigen::Matrix3d information;
  for (int k = 0; k < kSteps; ++k) information = step(x, pairs, scale_px, free);
  return information;
}

/// Distances of the points from where they are predicted, in units of their sigmas.
std::vector<double> errors_of(const Unknowns& x, const std::vector<std::vector<MovedPoint>>& pairs) {
  constexpr double kBehind = 1e3;
  std::vector<double> errors;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    for (const auto& point : pairs[k]) {
      const Prediction p = predict(x, k, point);
      errors.push_back(p.in_front ? p.error_px.norm() / p.sigma_px : kBehind);
    }
  }
  return errors;
}

/// The noise of a measurement, px, from the median error.
double noise_of(const Unknowns& x, const std::vector<std::vector<MovedPoint>>& pairs) {
  constexpr double kMedianOfNorm = 1.177;  // of two normal errors: sqrt(2 log 2)
  return median(errors_of(x, pairs)) / kMedianOfNorm;
}

/// Cauchy's cost of the errors, which is chi-square for small ones. `scale` is in units of the noise.
double cost(const Unknowns& x, const std::vector<std::vector<MovedPoint>>& pairs, double scale,
            double noise_px) {
  double sum = 0.0;
  for (const double error : errors_of(x, pairs))
    sum += scale * scale * std::log1p(std::pow(error / (scale * noise_px), 2));
  return sum;
}

}  // namespace

std::vector<MovedPoint> moved_points(const StereoFrame& first, const StereoFrame& second) {
  constexpr float kMostRows_px = 2.0F;
  constexpr float kLeastDisparity_px = 2.0F;
  const std::array<cv::Mat, 3> images = {first.left, first.right, second.left};
  std::array<ImageCorners, 3> corners;
  run_each(images.size(), [&](std::size_t i) { corners[i] = find_corners(images[i]); });
  std::vector<CornerPair> stereo;
  std::vector<CornerPair> moved;
  run_both([&] { stereo = match_corners(corners[0], corners[1]); },
           [&] { moved = match_corners(corners[0], corners[2]); });
  std::map<std::pair<float, float>, cv::Point2f> offsets_px;  // left minus right
  for (const auto& [left_px, right_px] : stereo) {
    const cv::Point2f offset = left_px - right_px;
    if (std::abs(offset.y) < kMostRows_px * corners[0].unit_px && offset.x > kLeastDisparity_px)
      offsets_px[{left_px.x, left_px.y}] = offset;
  }
  std::vector<MovedPoint> points;
  for (const auto& [first_px, second_px] : moved) {
    const auto found = offsets_px.find({first_px.x, first_px.y});
    if (found == offsets_px.end()) continue;
    points.push_back({.first_px = Eigen::Vector2f(first_px.x, first_px.y).cast<double>(),
                      .disparity_px = static_cast<double>(found->second.x),
                      .second_px = Eigen::Vector2f(second_px.x, second_px.y).cast<double>(),
                      .rows_px = -static_cast<double>(found->second.y)});
  }
  return points;
}

bool CameraFromMotion::contradicts_calibration() const {
  constexpr double kNoticeable = 0.05;
  constexpr double kLeastGain = 200.0;
  constexpr double kSigmas = 10.0;
  const double change = std::abs(std::log(focal_factor));
  return is_camera && change > kNoticeable && gain > kLeastGain && change > kSigmas * sigma;
}

std::optional<CameraFromMotion> camera_from_motion(const StereoCamera& camera,
                                                   const std::vector<std::vector<MovedPoint>>& pairs) {
  constexpr std::size_t kLeastPoints = 100;
  constexpr double kSharp = 5.0;  // scale of the weights, in units of the noise
  constexpr double kLeastNoise_px = 0.04;
  const std::size_t points =
      std::accumulate(pairs.begin(), pairs.end(), std::size_t{0},
                      [](std::size_t sum, const auto& of_pair) { return sum + of_pair.size(); });
  if (points < kLeastPoints) return std::nullopt;
  Unknowns calibrated{.focal_px = camera.fx,
                      .centre_px = {camera.cx, camera.cy},
                      .T_second_first = std::vector(pairs.size(), Eigen::Isometry3d::Identity())};
  for (const double scale_px : {30.0, 5.0, 1.0})
    (void)iterate(calibrated, pairs, scale_px, FreeCamera::kNothing);
  Unknowns free = calibrated;
  for (const double scale_px : {5.0, 1.0}) (void)iterate(free, pairs, scale_px, FreeCamera::kAll);
  const double noise_px = std::max(noise_of(free, pairs), kLeastNoise_px);
  for (const double scale_px : {5.0, 1.0, kSharp * noise_px})
    (void)iterate(calibrated, pairs, scale_px, FreeCamera::kCentre);
  const Eigen::Matrix3d information = iterate(free, pairs, kSharp * noise_px, FreeCamera::kAll);
  const Eigen::Vector2d& centre_px = free.centre_px;
  return CameraFromMotion{
      .focal_factor = free.focal_px / camera.fx,
      .sigma = noise_px * std::sqrt(std::max(information.inverse()(0, 0), 0.0)),
      .gain = cost(calibrated, pairs, kSharp, noise_px) - cost(free, pairs, kSharp, noise_px),
      .is_camera = centre_px.x() > 0.0 && centre_px.x() < camera.width_px && centre_px.y() > 0.0 &&
                   centre_px.y() < camera.height_px};
}

}  // namespace stereo_slam
