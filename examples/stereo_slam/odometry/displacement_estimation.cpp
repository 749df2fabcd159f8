// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/displacement_estimation.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/core/median.hpp"

namespace stereo_slam {
namespace {

constexpr int kPose = 6;
constexpr int kUnknowns = kPose + ImageDisplacement::kTerms;
constexpr double kHalfWeightDistance2 = 6.0;  // squared Mahalanobis distance at which a weight halves
constexpr double kRowSigma_px = 0.15;         // of a row difference
constexpr double kMedianNormal2 = 0.455;      // median of a squared normal variable: chi-square, one degree
using Unknowns = antipode::Vector<double, kUnknowns>;
using Information = antipode::Matrix<double, kUnknowns>;

/// The residuals of a point at an estimate.
struct Residuals {
  double point2 = 0.0;  // squared Mahalanobis distance of (u, v, disparity)
  double row2 = 0.0;    // of the row error
};

[[nodiscard]] Residuals residuals_of(const DisplacementConstraint& c, const Unknowns& x) {
  Vector3<double> e = c.innovation - c.J_pose * x.head<kPose>();
  e.z() += c.basis.row(0) * x.tail<ImageDisplacement::kTerms>();
  const double row = (c.row_error_px + c.basis.row(1) * x.tail<ImageDisplacement::kTerms>()) / kRowSigma_px;
  return {e.dot(c.S_inverse * e), row * row};
}

struct Scales {
  double point = 1.0;
  double row = 1.0;
};

/// Variances relative to those assumed, by the medians; at least one.
[[nodiscard]] Scales scales_of(std::span<const Residuals> residuals) {
  std::vector<double> points, rows;
  for (const auto& r : residuals) {
    points.push_back(r.point2);
    rows.push_back(r.row2);
  }
  return {std::max(1.0, median(std::move(points)) / kChi2_3_50),
          std::max(1.0, median(std::move(rows)) / kMedianNormal2)};
}

struct Equations {
  Information information = Information::Zero();
  Unknowns vector = Unknowns::Zero();
};

[[nodiscard]] Equations equations_of(std::span<const DisplacementConstraint> points,
                                     std::span<const Residuals> residuals, const DisplacementPrior& prior) {
  const Scales scales = scales_of(residuals);
  const auto weight = [](double distance2, double scale) {
    return 1.0 / (scale + distance2 / kHalfWeightDistance2);
  };
  Equations result;
  result.information.topLeftCorner<kPose, kPose>() = prior.pose_information;
  result.information.bottomRightCorner<ImageDisplacement::kTerms, ImageDisplacement::kTerms>() =
      prior.information;
  result.vector.tail<ImageDisplacement::kTerms>() = prior.information * prior.mean;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& c = points[i];
    Eigen::Matrix<double, 3, kUnknowns> J = Eigen::Matrix<double, 3, kUnknowns>::Zero();
    J.leftCols<kPose>() = c.J_pose;
    J.row(2).tail<ImageDisplacement::kTerms>() = -c.basis.row(0);
    const Eigen::Matrix<double, kUnknowns, 3> JtW =
        weight(residuals[i].point2, scales.point) * J.transpose() * c.S_inverse;
    result.information.noalias() += JtW * J;
    result.vector.noalias() += JtW * c.innovation;
    const double w = weight(residuals[i].row2, scales.row) / (kRowSigma_px * kRowSigma_px);
    const auto row = c.basis.row(1);
    result.information.bottomRightCorner<ImageDisplacement::kTerms, ImageDisplacement::kTerms>() +=
        w * row.transpose() * row;
    result.vector.tail<ImageDisplacement::kTerms>() -= w * c.row_error_px * row.transpose();
  }
  return result;
}

}  // namespace

std::optional<DisplacementEstimate> estimate_displacement(std::span<const DisplacementConstraint> points,
                                                          const DisplacementPrior& prior) {
  constexpr int kIterations = 8;
  constexpr double kConverged = 1e-3;  // px, rad, m
  Unknowns x = Unknowns::Zero();
  std::vector<Residuals> residuals(points.size());
  Eigen::LDLT<Information> factor;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::transform(points.begin(), points.end(), residuals.begin(),
                   [&](const auto& point) { return residuals_of(point, x); });
    const Equations equations = equations_of(points, residuals, prior);
    factor.compute(equations.information);
    if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0.0)) return std::nullopt;
    const Unknowns next = factor.solve(equations.vector);
    if (!next.allFinite()) return std::nullopt;
    const double step = (next - x).cwiseAbs().maxCoeff();
    x = next;
    if (step < kConverged) break;
  }
  const Information covariance = factor.solve(Information::Identity());
  DisplacementEstimate result;
  result.pose_change = x.head<kPose>();
  result.change = x.tail<ImageDisplacement::kTerms>();
  result.covariance = covariance.bottomRightCorner<ImageDisplacement::kTerms, ImageDisplacement::kTerms>();
  result.pose_by_displacement = result.covariance.ldlt()
                                    .solve(covariance.bottomLeftCorner<ImageDisplacement::kTerms, kPose>())
                                    .transpose();
  for (const auto& point : points) {
    const Residuals r = residuals_of(point, x);
    constexpr double kThreeSigma2 = 9.0;
    if (r.point2 < kChi2_3_99 && r.row2 < kThreeSigma2) ++result.agreeing;
  }
  return result;
}

}  // namespace stereo_slam
