// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/motion_evidence.hpp"

#include <antipode/filters/robust_noise.hpp>
#include <antipode/filters/weighted_sums.hpp>

#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/rig/image_displacement.hpp"

namespace stereo_slam {
namespace {

constexpr int kMotion = 6;
constexpr int kShift = ImageDisplacement::kTerms;
constexpr int kField = RectificationResidual::kTerms;
constexpr int kLens = LensResidual::kTerms;
constexpr int kErrors = CameraErrors::kTerms;
static_assert(kField + kLens == kErrors);

/// d z / d coefficients of a measurement.
[[nodiscard]] antipode::Matrix<double, 3, kErrors> derivative_of(const StereoPoint& z,
                                                                 const RectificationResidual& residual) {
  const Vector2<double> left_px = residual.left_position(z);
  const Vector2<double> right_px = residual.lens().in_image({z.x() - z.z(), z.y()});
  antipode::Matrix<double, 3, kErrors> result = antipode::Matrix<double, 3, kErrors>::Zero();
  result.block<1, kField>(2, 0) = residual.basis(left_px).transpose();
  result.block<2, kLens>(0, kField) = residual.lens().basis(left_px);
  result.block<1, kLens>(2, kField) =
      (residual.lens().basis(left_px) - residual.lens().basis(right_px)).row(0);
  return result;
}

/// The motion is the state, with the displacement if the rig vibrates. The errors of the cameras are
/// considered: those in both frames, then those of the field in the second frame alone, and a delay of the
/// right images.
template <bool Vibrates>
[[nodiscard]] std::optional<MotionEvidence> evidence_of(std::span<const TwoFramePoint> points,
                                                        const RectificationResidual& residual,
                                                        const StereoCamera& camera) {
  constexpr int kState = Vibrates ? kMotion + kShift : kMotion;
  constexpr int kConsidered = kErrors + kField + 1;
  using Sums = antipode::WeightedSums<double, kState, kConsidered, antipode::CauchyLoss<double>>;
  Sums sums(kOutlierLoss);
  if constexpr (Vibrates) {
    constexpr double kUnknown_px = 10.0;  // standard deviation of the displacement
    typename Sums::Square prior = Sums::Square::Zero();
    prior.diagonal().template tail<kShift>().setConstant(1.0 / (kUnknown_px * kUnknown_px));
    sums.add_prior(prior, Sums::Tangent::Zero(), 0.0);
  }
  for (const auto& c : points) {
    antipode::Matrix<double, 3, kState> J = antipode::Matrix<double, 3, kState>::Zero();
    J.template leftCols<kMotion>() = c.J_pose;
    if constexpr (Vibrates) {
      const Vector2<double> right_px(c.second.x() - c.second.z(), c.second.y());
      J.row(2).template tail<kShift>() = -ImageDisplacement::basis(right_px, camera).row(0);
    }
    const antipode::Matrix<double, 3, kErrors> second = derivative_of(c.second, residual);
    antipode::Matrix<double, 3, kConsidered> K;
    K << c.J_first * derivative_of(c.first, residual) - second, -second.leftCols<kField>(), c.by_delay;
    sums.template add<3>(c.innovation, c.S_inverse, J, K);
  }
  const auto root = sums.root();
  if (!root) return std::nullopt;
  const auto derivative = sums.sensitivity(*root);
  const auto evidence = sums.evidence(*root);
  constexpr int kDelay = kConsidered - 1;
  MotionEvidence result;
  result.derivative = derivative.template topLeftCorner<kMotion, kErrors>();
  result.derivative_by_delay = derivative.template topRightCorner<kMotion, 1>();
  result.evidence = {evidence.information.template topLeftCorner<kErrors, kErrors>(),
                     evidence.vector.template head<kErrors>()};
  result.delay_cross = evidence.information.template block<kErrors, 1>(0, kDelay);
  result.delay.information(0, 0) = evidence.information(kDelay, kDelay);
  result.delay.vector[0] = evidence.vector[kDelay];
  result.derivative_by_second.leftCols<kField>() = derivative.template block<kMotion, kField>(0, kErrors);
  return result;
}

}  // namespace

std::optional<MotionEvidence> evidence_of_motion(std::span<const TwoFramePoint> points,
                                                 const RectificationResidual& residual,
                                                 const CameraErrors::Coefficients& applied,
                                                 const StereoCamera& camera, bool vibrates) {
  auto result =
      vibrates ? evidence_of<true>(points, residual, camera) : evidence_of<false>(points, residual, camera);
  // The sums are about the coefficients applied, the evidence is on the coefficients themselves.
  if (!result) return std::nullopt;
  result->evidence.vector += result->evidence.information * applied;
  result->applied = applied;
  result->vibrates = vibrates;
  return result;
}

std::optional<Matrix6<double>> motion_by_parameters(
    std::span<const TwoFramePoint> points, std::span<const Eigen::Matrix<double, 3, 6>> by_parameters) {
  antipode::WeightedSums<double, kMotion, 6, antipode::CauchyLoss<double>> sums(kOutlierLoss);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const antipode::Matrix<double, 3, kMotion> J = points[i].J_pose;
    const antipode::Matrix<double, 3, 6> K = by_parameters[i];
    sums.template add<3>(points[i].innovation, points[i].S_inverse, J, K);
  }
  const auto root = sums.root();
  if (!root) return std::nullopt;
  return Matrix6<double>(sums.sensitivity(*root));
}

}  // namespace stereo_slam
