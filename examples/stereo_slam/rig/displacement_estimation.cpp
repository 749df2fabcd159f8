// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/displacement_estimation.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include <antipode/filters/robust_least_squares.hpp>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/core/median.hpp"
#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/core/symmetric_solve.hpp"

namespace stereo_slam {
namespace {

constexpr int kPose = 6;
constexpr int kDisplacement = ImageDisplacement::kTerms;
constexpr double kMedianNormal2 = 0.455;  // median of a squared normal variable: chi-square, one degree
using Unknowns =
    antipode::VectorChart<double, kPose + kDisplacement>;  // a change of the pose, a displacement
using Number = antipode::Vector<double, 1>;

/// The residuals of a point at an estimate.
struct Residuals {
  Vector3<double> point;  // (u, v, disparity), px
  double point2;          // its squared Mahalanobis distance
  double row_px;          // of the row error

  Residuals(const DisplacementConstraint& c, const Unknowns::Point& x)
      : point(c.innovation - c.J_pose * x.head<kPose>()),
        row_px(c.row_error_px + c.basis.row(1) * x.tail<kDisplacement>()) {
    point.z() += c.basis.row(0) * x.tail<kDisplacement>();
    point2 = point.dot(c.S_inverse * point);
  }
  [[nodiscard]] double row2() const { return row_px * row_px / (kRowInFrameSigma_px * kRowInFrameSigma_px); }
};

/// The points and their rows as measurements of pose and displacement. Variances are those assumed, times
/// what the medians of the residuals show, at least one.
struct PointsAndRows {
  std::span<const DisplacementConstraint> points;

  template <class Sums>
  void operator()(const Unknowns::Point& x, Sums& sums) const {
    std::vector<Residuals> residuals;
    std::vector<double> points2, rows2;
    for (const auto& c : points) {
      const Residuals& r = residuals.emplace_back(c, x);
      points2.push_back(r.point2);
      rows2.push_back(r.row2());
    }
    const double point_scale = std::max(1.0, median(std::move(points2)) / kChi2_3_50);
    const double row_variance =
        std::max(1.0, median(std::move(rows2)) / kMedianNormal2) * kRowInFrameSigma_px * kRowInFrameSigma_px;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& c = points[i];
      antipode::Matrix<double, 3, Unknowns::kDim> J = antipode::Matrix<double, 3, Unknowns::kDim>::Zero();
      J.leftCols<kPose>() = c.J_pose;
      J.row(2).tail<kDisplacement>() = -c.basis.row(0);
      sums.add(residuals[i].point, Matrix3<double>(c.S_inverse / point_scale), J);
      antipode::Matrix<double, 1, Unknowns::kDim> J_row = antipode::Matrix<double, 1, Unknowns::kDim>::Zero();
      J_row.tail<kDisplacement>() = -c.basis.row(1);
      sums.add(Number(residuals[i].row_px), Number(1.0 / row_variance), J_row);
    }
  }
};

[[nodiscard]] antipode::LeastSquaresPrior<Unknowns> as_prior_of_unknowns(const DisplacementPrior& prior) {
  antipode::LeastSquaresPrior<Unknowns> result{Unknowns::Point::Zero()};
  result.mean.tail<kDisplacement>() = prior.mean;
  result.information.topLeftCorner<kPose, kPose>() = prior.pose_information;
  result.information.bottomRightCorner<kDisplacement, kDisplacement>() = prior.information;
  return result;
}

}  // namespace

std::optional<DisplacementEstimate> estimate_displacement(std::span<const DisplacementConstraint> points,
                                                          const DisplacementPrior& prior) {
  const auto before = as_prior_of_unknowns(prior);
  // The variances change with the estimate, and with them the unit of the cost.
  const auto fit =
      antipode::robust_least_squares<Unknowns>(Unknowns::Point::Zero(), PointsAndRows{points}, kOutlierLoss,
                                               {.max_iterations = 10,
                                                .max_increase = std::numeric_limits<double>::infinity(),
                                                .covariance = antipode::CovarianceFrom::kNoise,
                                                .check_modes = false},
                                               &before);
  using Status = antipode::LeastSquaresStatus;
  if (fit.status != Status::kConverged && fit.status != Status::kNotSettled) return std::nullopt;
  DisplacementEstimate result;
  result.pose_change = fit.state.head<kPose>();
  result.change = fit.state.tail<kDisplacement>();
  const Matrix6<double> of_pose = fit.information.topLeftCorner<kPose, kPose>();
  const Matrix6<double> inverse = solve_symmetric(of_pose, Matrix6<double>::Identity());
  const antipode::Matrix<double, kPose, kDisplacement> cross =
      fit.information.topRightCorner<kPose, kDisplacement>();
  result.pose_by_displacement = -inverse * cross;
  // By the variances of the residuals, which are at least those assumed, and the weights.
  result.covariance = (fit.information.bottomRightCorner<kDisplacement, kDisplacement>() +
                       cross.transpose() * result.pose_by_displacement)
                          .inverse();
  for (const auto& point : points) {
    const Residuals r(point, fit.state);
    constexpr double kThreeSigma2 = 9.0;
    if (r.point2 < kChi2_3_99 && r.row2() < kThreeSigma2) ++result.agreeing;
  }
  return result;
}

}  // namespace stereo_slam
