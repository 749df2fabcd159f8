// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/disparity_error_search.hpp"

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include <antipode/filters/robust_least_squares.hpp>

#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/odometry/motion_in_left.hpp"
#include "stereo_slam/odometry/two_view_adjustment.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kLeastAgreeing = 15;

/// A motion with an error of the disparities, and the points that agree with both.
struct MotionWithError {
  Pose T_previous_current;
  Vector2<double> displacement_px = Vector2<double>::Zero();
  std::vector<std::size_t> agreeing;
};

/// Points of the previous frame and their positions in the current left image.
struct MovedPoints {
  std::span<const StereoPoint> previous;
  std::span<const Vector2<double>> current_px;
  const StereoCamera& camera;

  /// d disparity / d displacement.
  [[nodiscard]] Vector2<double> by_displacement(std::size_t i) const {
    const double x = (previous[i].x() - previous[i].z() - camera.cx) / camera.fx;
    return {1.0, x * x};
  }

  /// A point without the error; nothing if it is then so far that it tells of the rotation alone.
  [[nodiscard]] std::optional<StereoPoint> corrected(std::size_t i,
                                                     const Vector2<double>& displacement_px) const {
    constexpr double kLeastDisparity_px = 0.5;
    StereoPoint z = previous[i];
    z.z() += by_displacement(i).dot(displacement_px);
    if (!(z.z() > kLeastDisparity_px)) return std::nullopt;
    return z;
  }

  /// Where the current left image should show a point; nothing if that is behind the camera, or it is too
  /// far.
  [[nodiscard]] std::optional<Vector2<double>> expected_px(std::size_t i, const MotionWithError& at) const {
    const auto z = corrected(i, at.displacement_px);
    const auto now =
        z ? camera.project(at.T_previous_current.inverse() * camera.back_project(*z)) : std::nullopt;
    if (!now) return std::nullopt;
    return now->head<2>();
  }

  /// The points that agree with a motion and an error.
  [[nodiscard]] std::vector<std::size_t> agreeing_with(const MotionWithError& motion) const {
    std::vector<std::size_t> result;
    for (std::size_t i = 0; i < previous.size(); ++i) {
      const auto px = expected_px(i, motion);
      if (px && (current_px[i] - *px).norm() < AgreedMotion::kMaxError_px) result.push_back(i);
    }
    return result;
  }

  /// The motion of the points with a given error.
  [[nodiscard]] MotionWithError motion_with(const Vector2<double>& displacement_px) const {
    std::vector<StereoPoint> before;
    std::vector<Vector2<double>> now_px;
    std::vector<std::size_t> index;
    for (std::size_t i = 0; i < previous.size(); ++i) {
      const auto z = corrected(i, displacement_px);
      if (!z) continue;
      before.push_back(*z);
      now_px.push_back(current_px[i]);
      index.push_back(i);
    }
    MotionWithError result{Pose::identity(), displacement_px, {}};
    const auto motion =
        before.size() < kLeastAgreeing ? std::nullopt : motion_by_positions(before, now_px, camera);
    if (!motion) return result;
    result.T_previous_current = motion->T_previous_current;
    for (const std::size_t i : motion->agreeing) result.agreeing.push_back(index[i]);
    return result;
  }
};

/// The motion, and the error to a pixel, from where the points are to be fitted. That is no error if half of
/// the points agree without one: with wrong disparities, a static scene and a vehicle in it may have one
/// motion.
[[nodiscard]] MotionWithError begin_with(const MovedPoints& points) {
  constexpr int kLargest_px = 12;
  constexpr double kMore = 1.25;  // by chance, some more agree with one of many errors
  MotionWithError without = points.motion_with(Vector2<double>::Zero());
  if (2 * without.agreeing.size() >= points.previous.size()) return without;
  MotionWithError best = without;
  for (int size_px = 1; size_px <= kLargest_px; ++size_px) {
    for (const int error_px : {size_px, -size_px}) {
      // As by a rotation of the right camera.
      auto motion = points.motion_with(Vector2<double>::Constant(error_px));
      if (motion.agreeing.size() > best.agreeing.size()) best = std::move(motion);
    }
  }
  const bool clear =
      static_cast<double>(best.agreeing.size()) > kMore * static_cast<double>(without.agreeing.size());
  return clear ? best : without;
}

/// A change of the pose, and of the displacement.
using PoseAndError = antipode::VectorChart<double, 8>;

/// The points that agree as measurements of both, linearised at `about`.
struct LinearisedPoints {
  const MovedPoints& points;
  const MotionWithError& about;
  double sigma_px;

  template <class Sums>
  void operator()(const PoseAndError::Point& x, Sums& sums) const {
    const StereoCamera& camera = points.camera;
    const Pose T_current_previous = about.T_previous_current.inverse();
    for (const std::size_t i : about.agreeing) {
      const auto z = points.corrected(i, about.displacement_px);
      if (!z) continue;
      const auto expected = seen_by_second(*z, T_current_previous, camera);
      if (!expected) continue;
      const Vector2<double> by_disparity = expected->J_first.block<2, 1>(0, 2);
      antipode::Matrix<double, 2, PoseAndError::kDim> J;
      J << expected->J_motion.topRows<2>(), by_disparity * points.by_displacement(i).transpose();
      // The errors of a flow, and of a disparity, which has those of two positions.
      const Matrix2<double> S =
          sigma_px * sigma_px * (Matrix2<double>::Identity() + 2.0 * by_disparity * by_disparity.transpose());
      const Vector2<double> innovation = points.current_px[i] - expected->z.head<2>();
      sums.add(Vector2<double>(innovation - J * x), Matrix2<double>(S.inverse()), J);
    }
  }
};

}  // namespace

std::optional<SharedDisparityError> find_shared_disparity_error(std::span<const StereoPoint> previous,
                                                                std::span<const Vector2<double>> current_px,
                                                                const StereoCamera& camera,
                                                                double pixel_sigma_px) {
  constexpr int kLinearisations = 8;
  constexpr double kPriorSigma_px = 20.0;  // nothing is known
  const MovedPoints points{previous, current_px, camera};
  MotionWithError best = begin_with(points);
  SharedDisparityError result;
  for (int i = 0; i < kLinearisations; ++i) {
    antipode::LeastSquaresPrior<PoseAndError> prior{PoseAndError::Point::Zero()};
    prior.mean.tail<2>() = -best.displacement_px;
    prior.information.bottomRightCorner<2, 2>() =
        Matrix2<double>::Identity() / (kPriorSigma_px * kPriorSigma_px);
    const auto fit = antipode::robust_least_squares<PoseAndError>(
        PoseAndError::Point::Zero(), LinearisedPoints{points, best, pixel_sigma_px}, kOutlierLoss,
        {.check_modes = false}, &prior);
    if (!fit.converged()) return std::nullopt;
    best.T_previous_current = best.T_previous_current.boxplus(fit.state.head<6>());
    best.displacement_px += fit.state.tail<2>();
    result = {best.displacement_px, fit.covariance.bottomRightCorner<2, 2>() / kEvidenceWeight};
    best.agreeing = points.agreeing_with(best);
  }
  if (best.agreeing.size() < kLeastAgreeing || 3 * best.agreeing.size() < previous.size())
    return std::nullopt;
  return result;
}

}  // namespace stereo_slam
