// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/distributions/detail/pose_seeding.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/distributions/detail/tangent_moments.hpp>
#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// Smallest standard deviations of a fitted component.
template <class Scalar>
struct CovarianceFloor {
  Vector6<Scalar> sigma;

  CovarianceFloor(Scalar sigma_u, Scalar sigma_t) {
    sigma << Vector3<Scalar>::Constant(sigma_u), Vector3<Scalar>::Constant(sigma_t);
  }

  /// The covariance with eigenvalues of at least 1 in units of these deviations.
  [[nodiscard]] Matrix6<Scalar> raise(const Matrix6<Scalar>& Sigma) const {
    Matrix6<Scalar> scaled;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) scaled(i, j) = Sigma(i, j) / sigma[i] / sigma[j];
    }
    if (cholesky_factor<Scalar, 6>(scaled - Matrix6<Scalar>::Identity())) return Sigma;
    const auto eigen = symmetric_eigen(scaled);
    const Vector6<Scalar> raised = eigen.values.cwiseMax(Scalar(1));
    scaled = scaled_square<Scalar, 6, 6>(eigen.vectors, raised);
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) scaled(i, j) *= sigma[i] * sigma[j];
    }
    return scaled;
  }
};

/// Expectation maximisation for a mixture of push-forward Gaussians (MPG sec. IV). The tangent points are the
/// modes, to within |u| = 1e-3.
///
/// The paper's E-step compares values of Gaussians on different tangent spaces. Here the densities are
/// compared, which all refer to the measure of S^3 x R^3: N(y_ij; mu_i, Sigma_i) (1 + |u_ij|^2)^2 / 2.
template <class Scalar>
class MixtureEm {
  using Block = TangentBlock<Scalar>;

 public:
  struct Component {
    Scalar weight;
    Vector4<Scalar> q;
    TangentGaussian<Scalar> y;
    Matrix4<Scalar> to_chart;   ///< r = q* q_k
    Matrix6<Scalar> L_inverse;  ///< inverse of L, with L L^T = covariance
    Scalar log_peak;            ///< log of weight times density at the mode
  };

  MixtureEm(const PoseSample<Scalar>& sample, const CovarianceFloor<Scalar>& floor,
            const std::vector<std::size_t>& clusters, std::size_t count)
      : sample_(sample), floor_(floor), components_(count) {
    responsibilities_.setZero(sample.size(), static_cast<Eigen::Index>(count));
    for (std::size_t k = 0; k < clusters.size(); ++k) {
      responsibilities_(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(clusters[k])) =
          sample.weights[static_cast<Eigen::Index>(k)];
    }
    for (std::size_t i = 0; i < count; ++i) {
      const auto column = responsibilities_.col(static_cast<Eigen::Index>(i));
      components_[i].q = mean_rotation<Scalar>(sample, column);
      components_[i].y.mean = centered_mean(mean_translation<Scalar>(sample, column));
    }
    reseeds_left_ = count;
    (void)maximize();
  }

  [[nodiscard]] const std::vector<Component>& components() const { return components_; }
  [[nodiscard]] int reseeded() const { return reseeded_; }

  /// E-step: computes the responsibilities for the current parameters, multiplied by the weights of the
  /// samples. Returns the log-likelihood of the parameters.
  [[nodiscard]] Scalar expect() {
    using Array = typename Block::Array;
    constexpr Scalar kInfinity = std::numeric_limits<Scalar>::infinity();
    const Scalar kLeast = std::exp(Scalar(-kNegligible));
    responsibilities_.resize(sample_.size(), static_cast<Eigen::Index>(components_.size()));
    log_densities_.resize(sample_.size());
    Scalar log_likelihood(0);
    std::vector<Array> values(components_.size());
    for (Eigen::Index first = 0; first < sample_.size(); first += Block::kSize) {
      const Eigen::Index count = std::min(Block::kSize, sample_.size() - first);
      Array largest = Array::Constant(count, -kInfinity);
      for (std::size_t i = 0; i < components_.size(); ++i) {
        values[i] = log_densities(components_[i], first);
        largest = largest.max(values[i]);
      }
      // Where no component has a density, -infinity minus -infinity would be NaN.
      largest = (largest > -kInfinity).select(largest, Scalar(0));
      Array sum = Array::Zero(count);
      for (Array& value : values) {
        // Negligible values become exactly zero.
        value = (value - largest).max(Scalar(-kNegligible)).exp() - kLeast;
        sum += value;
      }
      const auto weights = sample_.weights.segment(first, count).array();
      const Array log_density = largest + sum.log();
      log_densities_.segment(first, count) = log_density.matrix();
      log_likelihood += (weights > Scalar(0)).select(weights * log_density, Scalar(0)).sum();
      const Array scale = (sum > Scalar(0)).select(weights / sum, Scalar(0));
      for (std::size_t i = 0; i < components_.size(); ++i) {
        responsibilities_.col(static_cast<Eigen::Index>(i)).segment(first, count) =
            (scale * values[i]).matrix();
      }
    }
    return log_likelihood;
  }

  /// M-step: computes weights, tangent points, means and covariances for the current responsibilities.
  /// Components with too few samples start again where the mixture is worst. After as many new starts as
  /// there were components, they are removed instead. Returns whether no tangent point moved; the
  /// log-likelihood then cannot fall.
  [[nodiscard]] bool maximize() {
    bool stayed = true;
    for (std::size_t i = 0; i < components_.size();) {
      const auto column = responsibilities_.col(static_cast<Eigen::Index>(i));
      const Scalar sum = column.sum();
      const Scalar effective = sum > Scalar(0) ? sum * sum / column.squaredNorm() : Scalar(0);
      if (effective >= Scalar(kMinSamples) || components_.size() == 1) {
        stayed = update(components_[i], column) && stayed;
      } else if (reseeds_left_ > 0 && log_densities_.size() == sample_.size()) {
        --reseeds_left_;
        reseed(components_[i]);
        stayed = false;
      } else {
        remove(i);
        stayed = false;
        continue;
      }
      ++i;
    }
    Scalar weights(0);
    for (const Component& component : components_) weights += component.weight;
    for (Component& component : components_) {
      component.weight /= weights;
      component.log_peak += std::log(component.weight);
    }
    return stayed;
  }

 private:
  static constexpr double kNegligible = 30.0;  // responsibilities below e^-30 count as none
  static constexpr double kMinSamples = 7.0;   // needed for a covariance in six dimensions
  static constexpr double kStay = 1e-3;        // |u| of the mean up to which the tangent point stays

  /// log of weight times density, for up to kSize consecutive samples.
  [[nodiscard]] typename Block::Array log_densities(const Component& component, Eigen::Index first) const {
    using Array = typename Block::Array;
    constexpr Scalar kEquator = Scalar(1e-12);
    const Block block(component.to_chart, component.y.mean, sample_, first, kEquator);
    Array square = Array::Zero(block.r0.size());
    for (int i = 0; i < 6; ++i) {
      Array z = component.L_inverse(i, 0) * block.y[0];
      for (int j = 1; j <= i; ++j) z += component.L_inverse(i, j) * block.y[static_cast<std::size_t>(j)];
      square += z * z;
    }
    // (1 + |u|^2)^2 = r_0^-4.
    const Array value = component.log_peak - Scalar(0.5) * square - Scalar(4) * block.r0.log();
    return (block.r0 < kEquator).select(-std::numeric_limits<Scalar>::infinity(), value);
  }

  /// Sets the component to the moments of the samples in its tangent space. If their mean is more than kStay
  /// from the tangent point, the tangent point moves there first. Returns whether it stayed.
  [[nodiscard]] bool update(Component& component, const Weights<Scalar>& weights) {
    TangentMoments<Scalar> moments(component.q, sample_, weights, component.y.mean);
    const Vector3<Scalar> u = moments.density.mean.template head<3>();
    const Scalar distance = u.norm();
    if (distance > Scalar(kStay)) {
      component.q = central_projection<Scalar>(component.q, u * std::min(Scalar(1), Scalar(0.5) / distance));
      Vector6<Scalar> reference = moments.density.mean;
      reference.template head<3>().setZero();
      moments = TangentMoments<Scalar>(component.q, sample_, weights, reference);
    }
    component.y = moments.density;
    set(component, moments.weight);
    return distance <= Scalar(kStay);
  }

  /// A new start at the sample that the mixture explains worst, with the spread of all samples.
  void reseed(Component& component) {
    Eigen::Index worst = 0;
    log_densities_.minCoeff(&worst);
    component.q = sample_.rotation(worst);
    component.y.mean = centered_mean(sample_.translation(worst));
    const TangentMoments<Scalar> all(component.q, sample_, sample_.weights, component.y.mean);
    component.y.covariance = all.density.covariance;
    log_densities_[worst] = std::numeric_limits<Scalar>::infinity();  // not chosen again in this M-step
    set(component, sample_.weights.sum() / Scalar(components_.size()));
    ++reseeded_;
  }

  void set(Component& component, Scalar weight) {
    component.weight = weight;
    component.y.covariance = floor_.raise(component.y.covariance);
    auto L = cholesky_factor(component.y.covariance);
    for (Scalar lift = std::numeric_limits<Scalar>::epsilon(); !L; lift *= Scalar(4)) {
      component.y.covariance.diagonal() *= Scalar(1) + lift;  // ill-conditioned for the scalar type
      L = cholesky_factor(component.y.covariance);
    }
    component.L_inverse = solve_lower<Scalar, 6, 6>(*L, Matrix6<Scalar>::Identity());
    component.to_chart = left_matrix(conjugate(component.q));
    component.log_peak = gaussian_log_peak(*L) - std::numbers::ln2_v<Scalar>;
  }

  void remove(std::size_t i) {
    const auto column = static_cast<Eigen::Index>(i),
               last = static_cast<Eigen::Index>(components_.size()) - 1;
    responsibilities_.col(column).swap(responsibilities_.col(last));
    std::swap(components_[i], components_.back());
    components_.pop_back();
    responsibilities_.conservativeResize(Eigen::NoChange, last);
    if (last == 1) restart_alone();
  }

  /// The only component left is fitted to all samples.
  void restart_alone() {
    components_[0].q = mean_rotation<Scalar>(sample_, sample_.weights);
    components_[0].y.mean = centered_mean(mean_translation<Scalar>(sample_, sample_.weights));
    responsibilities_ = sample_.weights;
    (void)update(components_[0], sample_.weights);
  }

  const PoseSample<Scalar>& sample_;
  const CovarianceFloor<Scalar>& floor_;
  std::vector<Component> components_;
  Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> responsibilities_;  // samples x components
  Vector<Scalar, Eigen::Dynamic> log_densities_;
  std::size_t reseeds_left_ = 0;
  int reseeded_ = 0;
};

}  // namespace antipode::detail
