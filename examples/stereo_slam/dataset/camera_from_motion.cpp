// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/camera_from_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <antipode/filters/robust_least_squares.hpp>
#include <antipode/geometry/quaternion.hpp>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/core/median.hpp"
#include "stereo_slam/core/parallel.hpp"

namespace stereo_slam {
namespace {

using Motion = antipode::ScrewChart<double>;
using Matrix2x3 = antipode::Matrix<double, 2, 3>;
using Matrix2x6 = antipode::Matrix<double, 2, 6>;
using Evidence = antipode::GaussianInformation<double, 3>;  // of (log f, cx, cy)

constexpr double kNoticeable = 0.05;  // of the logarithm of a focal length

/// The camera, and the motion of each pair of frames in baselines.
struct Unknowns {
  double focal_px = 0.0;
  Vector2<double> centre_px;
  std::vector<Pose> T_second_first;
};

/// A predicted point, px, and its derivatives by (log f, cx, cy) and by the motion.
struct Prediction {
  Vector2<double> px;
  double sigma_px = 1.0;  ///< of the error, for one pixel of noise in each measurement
  Matrix2x3 J_camera = Matrix2x3::Zero();
  Matrix2x6 J_motion = Matrix2x6::Zero();
};

/// Nothing if the point is not in front of the second camera.
std::optional<Prediction> predict(const Unknowns& x, const Matrix3<double>& R, const Vector3<double>& t,
                                  const MovedPoint& point) {
  constexpr double kNearest = 0.1;  // baselines
  const double f = x.focal_px;
  const double inverse_d = 1.0 / point.disparity_px;
  Vector3<double> p;
  p << (point.first_px - x.centre_px) * inverse_d, f * inverse_d;
  const Vector3<double> turned = R * p;
  const Vector3<double> q = turned + t;
  if (!(q.z() > kNearest && turned.z() > kNearest)) return std::nullopt;
  const Vector2<double> ray = q.head<2>() / q.z();
  Matrix2x3 J_point;
  J_point << 1.0, 0.0, -ray.x(), 0.0, 1.0, -ray.y();
  J_point *= f / q.z();
  Matrix3<double> J_p;  // of p by the camera
  J_p << 0.0, -inverse_d, 0.0, 0.0, 0.0, -inverse_d, f * inverse_d, 0.0, 0.0;
  Prediction result{f * ray + x.centre_px};
  const Matrix2x3 J_turned = J_point * R;
  result.J_camera = J_turned * J_p;
  result.J_camera.col(0) += f * ray;
  result.J_camera.rightCols<2>() += Eigen::Matrix2d::Identity();
  result.J_motion << -J_turned * antipode::skew(p), J_turned;
  // An error of the disparity moves the point along its ray, which matters as far as the camera has moved.
  const double parallax_px = f * (ray - turned.head<2>() / turned.z()).norm();
  result.sigma_px = std::hypot(std::sqrt(2.0), parallax_px * inverse_d);
  return result;
}

/// The points of one pair of frames as the model of robust_least_squares().
struct MovedPoints {
  const Unknowns& x;
  const std::vector<MovedPoint>& points;

  template <class Sums>
  void operator()(const Pose& T_second_first, Sums& sums) const {
    const Matrix3<double> R = T_second_first.rotation_matrix();
    const Vector3<double> t = T_second_first.translation();
    for (const auto& point : points) {
      if (const auto predicted = predict(x, R, t, point)) {
        const double information = 1.0 / (predicted->sigma_px * predicted->sigma_px);
        sums.template add<2>(point.second_px - predicted->px, information * Eigen::Matrix2d::Identity(),
                             predicted->J_motion, predicted->J_camera);
      } else {
        sums.miss(2);
      }
    }
  }
};

/// What of the camera is estimated besides the motions.
enum class FreeCamera { kNothing, kCentre, kAll };

/// What the points say of the camera, whatever the motions are, and what they cost: half a chi-square if the
/// noise is 1 px.
struct Fit {
  Evidence camera;
  double cost = 0.0;
  std::vector<Eigen::Matrix<double, 6, 3>> motion_by_camera;  ///< for each pair
};

/// Moves every pair to where its points fit best.
Fit fit_motions(Unknowns& x, const std::vector<std::vector<MovedPoint>>& pairs, double scale_px) {
  constexpr double kWide = 1e3;  // rad and baselines: keeps pairs of few points from being undetermined
  const antipode::LeastSquaresPrior<Motion, 3> wide{Pose::identity(),
                                                    Matrix6<double>::Identity() / (kWide * kWide)};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Fit fit;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    // The cost may increase, since every state has its own noise.
    const auto result = antipode::robust_least_squares<Motion, 3>(
        x.T_second_first[k], MovedPoints{x, pairs[k]}, antipode::CauchyLoss<double>{scale_px},
        {.max_iterations = 20, .max_increase = kInfinity, .check_modes = false}, &wide);
    x.T_second_first[k] = result.state;
    fit.camera = fit.camera + result.considered;
    fit.cost += result.cost;
    fit.motion_by_camera.push_back(result.sensitivity);
  }
  return fit;
}

/// The change of (log f, cx, cy) that the points ask for.
Vector3<double> change_of_camera(const Evidence& camera, FreeCamera free) {
  constexpr double kLongestStep = 0.2;  // of log f
  constexpr double kFixed = 1e15;
  if (free == FreeCamera::kNothing) return Vector3<double>::Zero();
  Matrix3<double> damped = camera.information;  // straight motion leaves the camera open
  damped.diagonal() += Vector3<double>(free == FreeCamera::kAll ? 10.0 : kFixed, 1e-4, 1e-4);
  Vector3<double> change = damped.ldlt().solve(camera.vector);
  change.x() = std::clamp(change.x(), -kLongestStep, kLongestStep);
  return change;
}

/// Moves all unknowns to where the points fit best.
Fit iterate(Unknowns& x, const std::vector<std::vector<MovedPoint>>& pairs, double scale_px,
            FreeCamera free) {
  constexpr int kMostSteps = 20;
  const Vector3<double> negligible(1e-6, 1e-3, 1e-3);
  Fit fit = fit_motions(x, pairs, scale_px);
  for (int step = 0; step < kMostSteps; ++step) {
    const Vector3<double> change = change_of_camera(fit.camera, free);
    if ((change.array().abs() < negligible.array()).all()) break;
    x.focal_px *= std::exp(change.x());
    x.centre_px += change.tail<2>();
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const Vector6<double> moved = fit.motion_by_camera[k] * change;
      if (Motion::contains(moved)) x.T_second_first[k] = Motion::retract(x.T_second_first[k], moved);
    }
    fit = fit_motions(x, pairs, scale_px);
  }
  return fit;
}

/// The noise of a measurement, px: from the median distance of the points from where they are predicted, in
/// units of their sigmas.
double noise_of(const Unknowns& x, const std::vector<std::vector<MovedPoint>>& pairs) {
  constexpr double kMedianOfNorm = 1.177;  // of two normal errors: sqrt(2 log 2)
  constexpr double kBehind = 1e3;
  std::vector<double> distances;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const Pose& T = x.T_second_first[k];
    const Matrix3<double> R = T.rotation_matrix();
    for (const auto& point : pairs[k]) {
      const auto predicted = predict(x, R, T.translation(), point);
      distances.push_back(predicted ? (predicted->px - point.second_px).norm() / predicted->sigma_px
                                    : kBehind);
    }
  }
  return median(distances) / kMedianOfNorm;
}

/// The camera that fits all pairs best; its spread is not known.
std::optional<CameraFromMotion> best_camera(const StereoCamera& camera,
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
                      .T_second_first = std::vector(pairs.size(), Pose::identity())};
  for (const double scale_px : {30.0, 5.0, 1.0})
    (void)iterate(calibrated, pairs, scale_px, FreeCamera::kNothing);
  Unknowns free = calibrated;
  for (const double scale_px : {5.0, 1.0}) (void)iterate(free, pairs, scale_px, FreeCamera::kAll);
  const double noise_px = std::max(noise_of(free, pairs), kLeastNoise_px);
  for (const double scale_px : {5.0, 1.0}) (void)iterate(calibrated, pairs, scale_px, FreeCamera::kCentre);
  const Fit fixed_focal = iterate(calibrated, pairs, kSharp * noise_px, FreeCamera::kCentre);
  const Fit all = iterate(free, pairs, kSharp * noise_px, FreeCamera::kAll);
  const Vector2<double>& centre_px = free.centre_px;
  return CameraFromMotion{
      .focal_factor = free.focal_px / camera.fx,
      .sigma = noise_px * std::sqrt(std::max(all.camera.information.inverse()(0, 0), 0.0)),
      .gain = 2.0 * (fixed_focal.cost - all.cost) / (noise_px * noise_px),
      .is_camera = centre_px.x() > 0.0 && centre_px.x() < camera.width_px && centre_px.y() > 0.0 &&
                   centre_px.y() < camera.height_px};
}

}  // namespace

std::vector<MovedPoint> moved_points(const StereoFrame& first, const StereoFrame& second) {
  constexpr double kMostRows_px = 2.0;
  constexpr float kLeastDisparity_px = 2.0F;
  const std::array<cv::Mat, 3> images = {first.left, first.right, second.left};
  std::array<ImageCorners, 3> corners;
  run_each(images.size(), [&](std::size_t i) { corners[i] = find_corners(images[i]); });
  std::vector<CornerPair> stereo;
  std::vector<CornerPair> moved;
  run_both([&] { stereo = match_corners(corners[0], corners[1]); },
           [&] { moved = match_corners(corners[0], corners[2]); });
  const double most_px = kMostRows_px * static_cast<double>(corners[0].unit_px);
  const RobustLine usual = line_of_rows(stereo, most_px);
  std::map<std::pair<float, float>, cv::Point2f> offsets_px;  // left minus right
  for (const auto& [left_px, right_px] : stereo) {
    const cv::Point2f offset = left_px - right_px;
    const double beside_px = static_cast<double>(offset.y) - usual.at(static_cast<double>(right_px.x));
    if (std::abs(beside_px) < most_px && offset.x > kLeastDisparity_px)
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

bool CameraFromMotion::is_surprising() const {
  constexpr double kLeastGain = 200.0;
  constexpr double kSigmas = 10.0;
  const double change = std::abs(std::log(focal_factor));
  return is_camera && change > kNoticeable && gain > kLeastGain && change > kSigmas * sigma;
}

bool CameraFromMotion::is_one_camera() const { return spread < kNoticeable; }

std::optional<CameraFromMotion> camera_from_motion(const StereoCamera& camera,
                                                   const std::vector<std::vector<MovedPoint>>& pairs) {
  auto found = best_camera(camera, pairs);
  if (!found || !found->is_surprising()) return found;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    auto others = pairs;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
    const auto without = best_camera(camera, others);
    const double factor = without ? without->focal_factor : std::numeric_limits<double>::infinity();
    found->spread = std::max(found->spread, std::abs(std::log(factor / found->focal_factor)));
  }
  return found;
}

}  // namespace stereo_slam
