// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include <antipode/distributions/pose_gaussian_fit.hpp>
#include <antipode/distributions/pose_gaussian_queries.hpp>

#include "distributions/random_projected_gaussians.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Columns = Matrix<double, 8, Eigen::Dynamic>;
using Weights = Eigen::VectorXd;

template <class Chart>
[[nodiscard]] Columns draws_of(const PoseGaussian<double, Chart>& x, int count, Rng& rng) {
  Columns columns(8, count);
  for (int k = 0; k < count; ++k) columns.col(k) = sample(x, rng).coeffs();
  return columns;
}

/// The largest change of a mean in standard deviations, and of a correlation.
template <class Chart>
[[nodiscard]] double change(const PoseGaussian<double, Chart>& a, const PoseGaussian<double, Chart>& b) {
  const Vector6<double> sigma = b.covariance.diagonal().cwiseSqrt();
  const Vector6<double> step = Chart::local(b.pose, a.pose).cwiseQuotient(sigma);
  const Matrix6<double> covariance =
      sigma.cwiseInverse().asDiagonal() * (a.covariance - b.covariance) * sigma.cwiseInverse().asDiagonal();
  return std::max(step.cwiseAbs().maxCoeff(), covariance.cwiseAbs().maxCoeff());
}

}  // namespace

TEST_CASE("A fit of draws is the density they come from, in either chart", "[fit][random]") {
  constexpr int kDraws = 20000;
  const double tolerance = 5.0 * std::sqrt(2.0 / kDraws);  // five standard errors of a variance
  for (unsigned seed = 0; seed < 3; ++seed) {
    for (const double position_m : {1e-3, 1.0, 1e3}) {
      CAPTURE(seed, position_m);
      Rng rng(seed);
      const PoseGaussian<double> screw{random_pose<double>(rng, 100.0),
                                       random_tangent_covariance<double>(rng, 0.6, position_m)};
      const Weights equal = Weights::Constant(kDraws, 3.0);
      CHECK(change(fit_pose_gaussian(draws_of(screw, kDraws, rng), equal), screw) <= tolerance);
      const SplitPoseGaussian<double> split{screw.pose, screw.covariance};
      CHECK(change(fit_pose_gaussian<SplitChart>(draws_of(split, kDraws, rng), equal), split) <= tolerance);
    }
  }
}

TEST_CASE("A fit balances the vectors to its samples, whatever their signs and repeated or weighted",
          "[fit][law]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const PoseGaussian<double> x{random_pose<double>(rng, 100.0),
                                 random_tangent_covariance<double>(rng, 0.5, 300.0)};
    const Columns columns = draws_of(x, 20, rng);
    Weights weights(20);
    for (double& weight : weights) weight = std::floor(uniform<double>(rng, 0.0, 4.0));
    const auto fit = fit_pose_gaussian(columns, weights);
    Vector6<double> sum = Vector6<double>::Zero();
    for (int k = 0; k < 20; ++k) {
      sum += weights[k] / weights.sum() * Pose::from_coefficients(columns.col(k)).boxminus(fit.pose);
    }
    CHECK(sum.cwiseQuotient(fit.covariance.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff() <= 1e-9);
    Columns repeated(8, static_cast<int>(weights.sum()));
    int column = 0;
    for (int k = 0; k < 20; ++k) {
      for (int copy = 0; copy < static_cast<int>(weights[k]); ++copy) {
        repeated.col(column) = (column % 2 == 0 ? 1.0 : -1.0) * columns.col(k);
        ++column;
      }
    }
    CHECK(change(fit_pose_gaussian(repeated, Weights::Ones(repeated.cols())), fit) <= 1e-8);
  }
}

TEST_CASE("Equal samples are certain, and few samples have a singular covariance", "[fit]") {
  Rng rng(1);
  const Pose x = random_pose<double>(rng, 1e6);
  Columns columns(8, 3);
  for (int k = 0; k < 3; ++k) columns.col(k) = x.coeffs();
  const auto certain = fit_pose_gaussian(columns, Weights::Ones(3));
  CHECK(certain.pose.is_approx(x, 1e-9));
  CHECK(certain.covariance.norm() <= 1e-15);
  const auto one = fit_pose_gaussian(columns.leftCols(1), Weights::Ones(1));
  CHECK(one.pose.is_approx(x, 1e-9));
  columns.col(1) = x.boxplus(random_twist<double>(rng, 0.1, 1.0)).coeffs();
  const auto few = fit_pose_gaussian(columns, Weights::Ones(3));
  CHECK_NOTHROW(sample(few, rng));
}

TEST_CASE("Samples without a mean, bad poses and bad weights are refused", "[fit][error]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Rng rng(2);
  Columns columns(8, 4);
  for (int k = 0; k < 4; ++k) columns.col(k) = random_pose<double>(rng).coeffs();
  const auto message = [&](const Weights& weights) {
    return error_message([&] { (void)fit_pose_gaussian(columns, weights); });
  };
  CHECK(contains(message(Weights::Ones(3)), "one weight per sample"));
  CHECK(contains(message(Weights::Zero(4)), "positive sum"));
  CHECK(contains(message(Eigen::Vector4d(1, 1, -1, 1)), "non-negative"));
  CHECK(contains(message(Eigen::Vector4d(1, nan, 1, 1)), "not finite"));
  columns(2, 1) = nan;
  CHECK(message(Weights::Ones(4)) != "nothing thrown");
  CHECK(error_message([&] { (void)fit_pose_gaussian(Columns(8, 0), Weights()); }) != "nothing thrown");
}
