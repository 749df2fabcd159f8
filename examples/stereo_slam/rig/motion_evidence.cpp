// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/motion_evidence.hpp"

#include <cstddef>

#include <Eigen/Cholesky>

#include <antipode/filters/robust_noise.hpp>
#include <antipode/filters/weighted_sums.hpp>

#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/rig/image_displacement.hpp"

namespace stereo_slam {
namespace {

constexpr int kMotion = 6;
constexpr int kShift = ImageDisplacement::kTerms;
constexpr int kField = PairGeometry::kTerms;
constexpr int kLens = LensResidual::kTerms;
constexpr int kErrors = CameraErrors::kTerms;
static_assert(kField + kLens == kErrors);

/// d z / d coefficients of a measurement.
[[nodiscard]] antipode::Matrix<double, 3, kErrors> derivative_of(const StereoPoint& z,
                                                                 const PairGeometry& geometry) {
  const Vector2<double> left_px = geometry.left_position(z);
  const Vector2<double> right_px = geometry.lens().in_image({z.x() - z.z(), z.y()});
  antipode::Matrix<double, 3, kErrors> result = antipode::Matrix<double, 3, kErrors>::Zero();
  result.block<1, kField>(2, 0) = geometry.basis(left_px).transpose();
  result.block<2, kLens>(0, kField) = geometry.lens().basis(left_px);
  result.block<1, kLens>(2, kField) =
      (geometry.lens().basis(left_px) - geometry.lens().basis(right_px)).row(0);
  return result;
}

enum class Rig { kRigid, kVibrating, kLate };

/// How the second right image may be displaced against the first: unknowns beside the motion.
template <Rig kRig>
constexpr int kOwnOf = kRig == Rig::kRigid       ? 0
                       : kRig == Rig::kVibrating ? kShift
                                                 : 3;

/// The evidence of the first numbers, if the last ones are known to a standard deviation each.
template <int kAll>
[[nodiscard]] antipode::GaussianInformation<double, kAll - 1 - LatePoint::kTerms> without_exposures(
    const antipode::GaussianInformation<double, kAll>& all,
    const antipode::Vector<double, 1 + LatePoint::kTerms>& sigma) {
  constexpr int kLate = 1 + LatePoint::kTerms, kRest = kAll - kLate;
  constexpr double kLeast = 1e-9;  // of a standard deviation, far below all that matters
  antipode::Matrix<double, kLate> late = all.information.template bottomRightCorner<kLate, kLate>();
  late.diagonal() += sigma.cwiseMax(kLeast).cwiseAbs2().cwiseInverse();
  const antipode::Matrix<double, kRest, kLate> cross =
      all.information.template topRightCorner<kRest, kLate>();
  const Eigen::LDLT<antipode::Matrix<double, kLate>> factor(late);
  return {all.information.template topLeftCorner<kRest, kRest>() - cross * factor.solve(cross.transpose()),
          all.vector.template head<kRest>() - cross * factor.solve(all.vector.template tail<kLate>())};
}

/// The evidence of the coefficients and of those of the field in the second frame alone, as one of the
/// coefficients and a displacement.
[[nodiscard]] ErrorTerms::EvidenceOfBoth with_displacement(
    const antipode::GaussianInformation<double, kErrors + kField>& all, const StereoCamera& camera) {
  Eigen::Matrix<double, kErrors + kField, ErrorTerms::kBoth> by =
      Eigen::Matrix<double, kErrors + kField, ErrorTerms::kBoth>::Zero();
  by.topLeftCorner<kErrors, kErrors>().setIdentity();
  by.bottomRightCorner<kField, kShift>() = DisplacementTerms(camera).disparity.topRows<kField>();
  return {by.transpose() * all.information * by, by.transpose() * all.vector};
}

/// Adds that hardly anything is known of the displacement.
template <Rig kRig, class Sums>
void add_unknown_displacement(const StereoCamera& camera, Sums& sums) {
  if constexpr (kRig != Rig::kRigid) {
    constexpr double kUnknown_px = 10.0;  // standard deviation
    const double unknown = kRig == Rig::kLate ? kUnknown_px / camera.fx : kUnknown_px;
    typename Sums::Square prior = Sums::Square::Zero();
    prior.diagonal().template tail<kOwnOf<kRig>>().setConstant(1.0 / (unknown * unknown));
    sums.add_prior(prior, Sums::Tangent::Zero(), 0.0);
  }
}

/// The motion is the state, with the displacement unless the rig is rigid. The errors of the cameras are
/// considered: those in both frames, then those of the field in the second frame alone, and the exposures of
/// late right images.
template <Rig kRig>
[[nodiscard]] std::optional<MotionEvidence> evidence_of(const SeenMotion& motion,
                                                        const PairGeometry& geometry,
                                                        const StereoCamera& camera) {
  constexpr int kState = kMotion + kOwnOf<kRig>;
  constexpr int kLate = 1 + (kRig == Rig::kLate ? LatePoint::kTerms : 0);  // a delay, exposures
  constexpr int kConsidered = kErrors + kField + kLate;
  using Sums = antipode::WeightedSums<double, kState, kConsidered, antipode::CauchyLoss<double>>;
  Sums sums(kOutlierLoss);
  add_unknown_displacement<kRig>(camera, sums);
  for (std::size_t i = 0; i < motion.points.size(); ++i) {
    const TwoFramePoint& c = motion.points[i];
    antipode::Matrix<double, 3, kState> J = antipode::Matrix<double, 3, kState>::Zero();
    J.template leftCols<kMotion>() = c.J_pose;
    if constexpr (kRig == Rig::kVibrating) {
      const Vector2<double> right_px(c.second.x() - c.second.z(), c.second.y());
      J.row(2).template tail<kShift>() = -ImageDisplacement::basis(right_px, camera).row(0);
    }
    const antipode::Matrix<double, 3, kErrors> second = derivative_of(c.second, geometry);
    antipode::Matrix<double, 3, kConsidered> K;
    K.template leftCols<kErrors + kField + 1>() << c.J_first * derivative_of(c.first, geometry) - second,
        -second.leftCols<kField>(), c.by_delay;
    if constexpr (kRig == Rig::kLate) {
      J.template rightCols<kOwnOf<kRig>>() = motion.late[i].by_second_turn;
      K.template rightCols<LatePoint::kTerms>() = motion.late[i].by_exposures;
    }
    sums.template add<3>(c.innovation, c.S_inverse, J, K);
  }
  const auto root = sums.root();
  if (!root) return std::nullopt;
  const auto derivative = sums.sensitivity(*root);
  const auto evidence = sums.evidence(*root);
  MotionEvidence result;
  result.derivative = derivative.template topLeftCorner<kMotion, kErrors>();
  result.derivative_by_displacement = derivative.template block<kMotion, kField>(0, kErrors) *
                                      DisplacementTerms(camera).disparity.topRows<kField>();
  constexpr int kBoth = kErrors + kField;
  result.evidence = with_displacement(
      {evidence.information.template topLeftCorner<kBoth, kBoth>(), evidence.vector.template head<kBoth>()},
      camera);
  if constexpr (kRig == Rig::kLate) {
    const Eigen::Matrix<double, kMotion, kLate> by_exposures =
        derivative.template topRightCorner<kMotion, kLate>();
    const Eigen::Matrix<double, kMotion, kLate> by_sigma = by_exposures * motion.sigma_late.asDiagonal();
    result.derivative_by_delay = by_exposures.col(0);
    result.exposure_covariance = by_sigma * by_sigma.transpose();
    result.evidence = with_displacement(
        without_exposures<kConsidered>({evidence.information, evidence.vector}, motion.sigma_late), camera);
  }
  return result;
}

}  // namespace

std::optional<MotionEvidence> evidence_of_motion(const SeenMotion& motion, const PairGeometry& geometry,
                                                 const CameraErrors::Coefficients& applied,
                                                 const StereoCamera& camera, bool vibrates) {
  auto result = !motion.late.empty() ? evidence_of<Rig::kLate>(motion, geometry, camera)
                : vibrates           ? evidence_of<Rig::kVibrating>(motion, geometry, camera)
                                     : evidence_of<Rig::kRigid>(motion, geometry, camera);
  // The sums are about the coefficients applied, the evidence is on the coefficients themselves.
  if (!result) return std::nullopt;
  result->evidence.vector += result->evidence.information.leftCols<kErrors>() * applied;
  result->applied = applied;
  result->vibrates = vibrates;
  return result;
}

}  // namespace stereo_slam
