// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <antipode/distributions/gaussian_information.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/image_displacement.hpp"
#include "stereo_slam/rig/lens_residual.hpp"

/// @file
/// How the errors of the cameras change while driving: from one keyframe to the next the right image is
/// displaced a little further, a random walk.
namespace stereo_slam {

/// The errors of the cameras that only motions show: the disparity offset, which is the horizontal part of a
/// PairGeometry, and the lenses' LensResidual.
struct ErrorTerms {
  static constexpr int kOffset = 10;  ///< those of PairGeometry
  static constexpr int kAll = kOffset + LensResidual::kTerms;
  static constexpr int kBoth = kAll + ImageDisplacement::kTerms;  ///< with a displacement
  using Coefficients = antipode::Vector<double, kAll>;            ///< px; those of the lenses last
  using Covariance = antipode::Matrix<double, kAll>;              ///< px^2; or their information
  using Evidence = antipode::GaussianInformation<double, kAll>;   ///< of the coefficients: 1/px^2, 1/px
  using ByDisplacement = Eigen::Matrix<double, kAll, ImageDisplacement::kTerms>;

  /// Of the coefficients at the first frame of a motion, and of the displacement of the right image from
  /// there to its second frame.
  using EvidenceOfBoth = antipode::GaussianInformation<double, kBoth>;
};

/// The coefficients that a displacement amounts to, of the errors and of the rows.
struct DisplacementTerms {
  ErrorTerms::ByDisplacement disparity = ErrorTerms::ByDisplacement::Zero();
  Eigen::Matrix<double, ErrorTerms::kOffset, ImageDisplacement::kTerms> rows =
      Eigen::Matrix<double, ErrorTerms::kOffset, ImageDisplacement::kTerms>::Zero();

  explicit DisplacementTerms(const StereoCamera& camera);
};

/// What is known after a change by an error with this covariance.
template <int N>
[[nodiscard]] antipode::GaussianInformation<double, N> widened(
    const antipode::GaussianInformation<double, N>& before, const antipode::Matrix<double, N>& covariance) {
  using Square = antipode::Matrix<double, N>;
  const Square wider = before.information.ldlt().solve(Square::Identity()) + covariance;
  antipode::GaussianInformation<double, N> after{wider.ldlt().solve(Square::Identity())};
  after.vector = after.information * before.mean();
  return after;
}

/// What a motion tells of the errors of a rigid rig.
[[nodiscard]] inline ErrorTerms::Evidence of_rigid_rig(const ErrorTerms::EvidenceOfBoth& motion) {
  constexpr int kErrors = ErrorTerms::kAll;
  return {motion.information.topLeftCorner<kErrors, kErrors>(), motion.vector.head<kErrors>()};
}

/// A change of the errors between two motions by other causes, which are told.
struct ErrorChange {
  std::size_t motions = 0;                                             ///< before it
  ErrorTerms::Coefficients shift = ErrorTerms::Coefficients::Zero();   ///< px
  ErrorTerms::Covariance covariance = ErrorTerms::Covariance::Zero();  ///< of it, px^2
  bool only_forgets = false;  ///< nothing changes, but what is known was measured inexactly
};

/// What is known of the errors if the right image is displaced by coefficients with the standard deviation
/// `sigma_px` from one keyframe to the next; zero is a rigid rig.
class DriftHypothesis {
 public:
  DriftHypothesis(double sigma_px, const ErrorTerms::ByDisplacement& by_displacement,
                  const ErrorTerms::Evidence& begin)
      : sigma_px_(sigma_px), by_displacement_(by_displacement), everything_(begin) {}

  [[nodiscard]] double sigma_px() const noexcept { return sigma_px_; }
  /// What was known at the start and has been added since, for the errors of now.
  [[nodiscard]] const ErrorTerms::Evidence& everything() const noexcept { return everything_; }
  /// Covariance of what the errors have changed by since the start.
  [[nodiscard]] const ErrorTerms::Covariance& spread_px2() const noexcept { return spread_px2_; }
  /// log of the likelihood of the motions added, up to a constant that all hypotheses share.
  [[nodiscard]] double log_likelihood() const noexcept { return log_likelihood_; }
  /// The standard deviation of the displacement of each motion, px.
  [[nodiscard]] const std::vector<float>& sigmas_px() const noexcept { return sigmas_px_; }

  /// log of the likelihood of a motion, if `known` is known of the errors before it.
  [[nodiscard]] double log_likelihood_of(const ErrorTerms::EvidenceOfBoth& motion,
                                         const ErrorTerms::Evidence& known) const;
  /// Adds a motion, of which `log_likelihood` is the likelihood.
  void add(const ErrorTerms::EvidenceOfBoth& motion, double log_likelihood);
  /// Adds a motion whose displacement is measured otherwise.
  void add_displaced(const ErrorTerms::Evidence& motion);
  /// Adds a change by other causes.
  void change(const ErrorChange& change);

  /// Goes on from what another one knows, as less likely than that by `log_factor`.
  void continue_from(const DriftHypothesis& likelier, double log_factor);

 private:
  double sigma_px_;
  ErrorTerms::ByDisplacement by_displacement_;
  ErrorTerms::Evidence everything_;
  ErrorTerms::Covariance spread_px2_ = ErrorTerms::Covariance::Zero();
  double log_likelihood_ = 0.0;
  std::vector<float> sigmas_px_;
};

/// The errors of the cameras at the first frame of a motion, and the displacement until its second one.
struct ErrorsDuring {
  antipode::Vector<double, ErrorTerms::kBoth> mean = decltype(mean)::Zero();
  antipode::Matrix<double, ErrorTerms::kBoth> covariance = decltype(covariance)::Zero();

  [[nodiscard]] ErrorTerms::Coefficients coefficients() const { return mean.head<ErrorTerms::kAll>(); }
  [[nodiscard]] ImageDisplacement::Coefficients displacement() const {
    return mean.tail<ImageDisplacement::kTerms>();
  }
};

/// The errors during each of the motions, as all of them tell: by the smoother of Rauch, Tung and Striebel.
/// `drift_sigmas_px` are those of the motions' displacements, `begin` is known before the first one, and
/// `end` after the last one if nothing ever changed. The changes are in order.
[[nodiscard]] std::vector<ErrorsDuring> smoothed_errors(std::span<const ErrorTerms::EvidenceOfBoth> motions,
                                                        std::span<const float> drift_sigmas_px,
                                                        std::span<const ErrorChange> changes,
                                                        const ErrorTerms::ByDisplacement& by_displacement,
                                                        const ErrorTerms::Evidence& begin,
                                                        const ErrorTerms::Evidence& end);

}  // namespace stereo_slam
