// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/quaternion.hpp>
#include <antipode/sampling/bingham_rules.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Deterministic samples of a pose density, the columns [q; p]. They contain the coupling of translation and
/// orientation. E[q q^T], E[t] and Cov(t | q) are exact; Cov(t) and Cov(t, tau) are exact if the
/// orientations' fourth moments are. moment_match gives the density back.
namespace antipode {

/// All pairs of an orientation and a translation sample (DQV-SLAM Alg. 1), weights multiplied.
template <class OrientationRule, GaussianRule TranslationRule>
requires(OrientationRule::kDim == 4 && TranslationRule::kDim == 3) struct CartesianPoseRule {
  static constexpr int kCount = OrientationRule::kCount * TranslationRule::kCount;  ///< number of points

  OrientationRule orientation{};  ///< samples the marginal of q
  TranslationRule translation{};  ///< samples t given q
};

/// The 57 points of Mysovskikh's rule in R^6, three coordinates for the orientation (laid out as in
/// GnomonicRule) and three for the translation: exact to the same degree as the 225 pairs of RichPoseRule,
/// with a quarter of the points.
struct JointPoseRule {
  static constexpr int kCount = MysovskikhRule<6>::kCount;  ///< number of points
};

/// 7 x 7 = 49 points: the sampling of DQV-SLAM.
using PaperPoseRule = CartesianPoseRule<BinghamBaseRule, UnscentedRule<3>>;
/// 15 x 15 = 225 points, exact to degree 5 where the orientation is concentrated.
using RichPoseRule = CartesianPoseRule<BinghamGnomonicRule, Degree5Rule<3>>;

namespace detail {

/// [q; p] with p = 1/2 (0, t) q.
template <class Scalar>
[[nodiscard]] Vector8<Scalar> pose_coefficients(const Vector4<Scalar>& q, const Vector3<Scalar>& t) {
  Vector8<Scalar> x;
  x << q, Scalar(0.5) * hamilton_product(Vector4<Scalar>(Scalar(0), t[0], t[1], t[2]), q);
  return x;
}

}  // namespace detail

/// The poses of the rule, the columns [q; p], and their weights.
template <class OrientationRule, GaussianRule TranslationRule, std::floating_point Scalar>
[[nodiscard]] WeightedSamples<Scalar, 8, CartesianPoseRule<OrientationRule, TranslationRule>::kCount> sample(
    const CartesianPoseRule<OrientationRule, TranslationRule>& rule, const BinghamGaussian<Scalar>& density) {
  const auto orientations = sample(rule.orientation, density.orientation());
  const auto standard = rule.translation.template standard<Scalar>();
  Matrix<Scalar, 3, TranslationRule::kCount> residuals;
  for (int j = 0; j < standard.size(); ++j) {
    const Vector3<Scalar> g = standard.points.col(j);
    residuals.col(j) = density.conditional_sqrt_factor() * g;
  }
  WeightedSamples<Scalar, 8, CartesianPoseRule<OrientationRule, TranslationRule>::kCount> samples;
  int count = 0;
  for (int i = 0; i < orientations.size(); ++i) {
    const Vector4<Scalar> q = orientations.points.col(i);
    const Vector3<Scalar> mean = density.conditional_mean(q);
    for (int j = 0; j < standard.size(); ++j) {
      samples.points.col(count) = detail::pose_coefficients<Scalar>(q, mean + residuals.col(j));
      samples.weights[count++] = orientations.weights[i] * standard.weights[j];
    }
  }
  return samples;
}

/// The poses of the rule, the columns [q; p], and their weights.
template <std::floating_point Scalar>
[[nodiscard]] WeightedSamples<Scalar, 8, JointPoseRule::kCount> sample(
    const JointPoseRule&, const BinghamGaussian<Scalar>& density) {
  using std::sqrt;
  static const auto standard = MysovskikhRule<6>{}.template standard<Scalar>();
  const Vector4<Scalar> spread = density.orientation().second_moments().cwiseSqrt();
  WeightedSamples<Scalar, 8, JointPoseRule::kCount> samples;
  for (int k = 0; k < samples.size(); ++k) {
    const Vector6<Scalar> g = standard.points.col(k);
    const Vector4<Scalar> y = detail::tangent_point<Scalar, 4>(spread, g.template head<3>());
    const Scalar square = y.squaredNorm();
    const Vector4<Scalar> x = density.orientation().axes() * y;
    const Vector4<Scalar> q = x / sqrt(square);
    const Vector3<Scalar> residual = density.conditional_sqrt_factor() * g.template tail<3>();
    samples.points.col(k) = detail::pose_coefficients<Scalar>(q, density.conditional_mean(q) + residual);
    samples.weights[k] = standard.weights[k] * square;
  }
  return samples;
}

}  // namespace antipode
