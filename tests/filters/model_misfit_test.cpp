// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <type_traits>

#include <antipode/filters/detail/model_misfit.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// quadratic_update, compiled once.
[[nodiscard]] PoseUpdateResult<double> updated(const PoseGaussian<double>& prior,
                                               const AnyLogLikelihood<double>& log_likelihood) {
  return quadratic_update(prior, log_likelihood);
}

}  // namespace

TEST_CASE("A function of the distance alone is quadratic on one sphere, and not called converged for that",
          "[quadratic][status]") {
  const PoseGaussian<double> prior{{}, 0.01 * Matrix6<double>::Identity()};
  const auto dead_zone = [](double width, double sigma) {
    return [=](const DualQuaternion<double>& x) {
      const double outside = std::max(0.0, x.log().norm() - width) / sigma;
      return -0.5 * outside * outside;
    };
  };
  for (const double sigma : {0.001, 0.01, 0.05}) {
    CAPTURE(sigma);
    const auto result = updated(prior, dead_zone(0.2, sigma));
    CHECK(result.status != UpdateStatus::kConverged);
    CHECK(result.residual > 0.4);
    CHECK(std::sqrt(result.posterior.covariance(0, 0)) > 0.05);  // the true one is 0.066 to 0.083
  }
  for (const double slope : {30.0, 100.0, 1000.0}) {
    CAPTURE(slope);
    const auto result =
        updated(prior, [=](const DualQuaternion<double>& x) { return -slope * x.log().norm(); });
    CHECK(result.status == UpdateStatus::kNotGaussian);
  }
  // The same if the prior knows half of the axes, exactly or nearly.
  PoseGaussian<double> certain = prior, nearly = prior;
  certain.covariance.topLeftCorner<3, 3>().setZero();
  nearly.covariance.topLeftCorner<3, 3>() *= 1e-12;
  for (const double sigma : {0.001, 0.01}) {
    CAPTURE(sigma);
    CHECK(updated(certain, dead_zone(0.2, sigma)).status != UpdateStatus::kConverged);
  }
  for (const double slope : {30.0, 100.0, 1000.0}) {
    CAPTURE(slope);
    const auto cone = [=](const DualQuaternion<double>& x) { return -slope * x.log().norm(); };
    const auto result = updated(certain, cone), expected = updated(nearly, cone);
    CHECK(result.status == UpdateStatus::kNotGaussian);
    CHECK(expected.status == UpdateStatus::kNotGaussian);
    CHECK(result.residual == Approx(expected.residual).epsilon(1e-3));
    CHECK(result.posterior.covariance(3, 3) == Approx(expected.posterior.covariance(3, 3)).epsilon(1e-3));
  }
}

TEST_CASE("The check of a model costs 17 poses, and a second fit only if it fails", "[quadratic]") {
  const PoseGaussian<double> prior{{}, 0.01 * Matrix6<double>::Identity()};
  const auto gaussian =
      updated(prior, [](const DualQuaternion<double>& x) { return -50.0 * x.log().squaredNorm(); });
  CHECK(gaussian.steps == 1);
  CHECK(gaussian.evaluations == 57 + 17);
  // Likelihoods that take 57 poses at once and no other number get the 17 among 57.
  const auto of_57 = [](const Matrix<double, 8, 57>& poses, Vector<double, 57>& values) {
    for (int k = 0; k < 57; ++k) {
      values[k] = -50.0 * DualQuaternion<double>::unchecked(poses.col(k)).log().squaredNorm();
    }
  };
  const auto batched = quadratic_update(prior, of_57);
  CHECK(batched.status == UpdateStatus::kConverged);
  CHECK(batched.posterior.covariance == gaussian.posterior.covariance);
  CHECK(batched.residual == gaussian.residual);
}

TEST_CASE("The points of the check have the moments of the Gaussian", "[quadratic]") {
  const auto moments_match = []<int N>(std::integral_constant<int, N>) {
    const auto samples = detail::CheckPoints<N>::template standard<double>();
    CAPTURE(N);
    double expected = 1.0;  // E[r^(2 k)] = N (N + 2) ... (N + 2 k - 2)
    for (int k = 0; k <= 4; ++k) {
      double sum = 0.0;
      for (int i = 0; i < samples.weights.size(); ++i) {
        sum += samples.weights[i] * std::pow(samples.points.col(i).squaredNorm(), k);
      }
      CHECK(sum == Approx(expected).epsilon(1e-12));
      expected *= N + 2 * k;
    }
    const Vector<double, N> mean = samples.points * samples.weights;
    CHECK(mean.cwiseAbs().maxCoeff() <= 1e-14);
    const Matrix<double, N> second =
        samples.points * samples.weights.asDiagonal() * samples.points.transpose();
    CHECK((second - Matrix<double, N>::Identity()).cwiseAbs().maxCoeff() <= 1e-14 * N);
    CHECK(samples.weights.minCoeff() > 0.0);
  };
  moments_match(std::integral_constant<int, 1>{});
  moments_match(std::integral_constant<int, 3>{});
  moments_match(std::integral_constant<int, 6>{});
  moments_match(std::integral_constant<int, 9>{});
}
