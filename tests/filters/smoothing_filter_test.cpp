// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <functional>
#include <stdexcept>
#include <vector>

#include <Eigen/Cholesky>

#include <antipode/distributions/pose_charts.hpp>
#include <antipode/distributions/pose_gaussian_queries.hpp>
#include <antipode/filters/pose_filter.hpp>
#include <antipode/filters/smoothing_filter.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

using Pose = DualQuaternion<double>;
using Belief = PoseGaussian<double>;
using Dense = Matrix<double, Eigen::Dynamic>;
using DenseVector = Vector<double, Eigen::Dynamic>;

/// The states that explain a list of residuals best, and the covariance of the vectors about them.
template <class Chart>
struct Batch {
  static constexpr int N = Chart::kDim;
  using States = std::vector<typename Chart::Point>;

  States states;
  Dense covariance;

  [[nodiscard]] Matrix<double, N> block(std::size_t k) const {
    const auto begin = static_cast<Eigen::Index>(k) * N;
    return covariance.block<N, N>(begin, begin);
  }
};

template <class Chart>
[[nodiscard]] typename Batch<Chart>::States moved(const typename Batch<Chart>::States& states,
                                                  const DenseVector& xi) {
  auto result = states;
  for (std::size_t k = 0; k < states.size(); ++k) {
    result[k] =
        Chart::retract(states[k], xi.segment<Chart::kDim>(static_cast<Eigen::Index>(k) * Chart::kDim).eval());
  }
  return result;
}

/// Gauss-Newton on all states at once, with the Jacobian of the whitened residuals by central differences.
template <class Chart>
[[nodiscard]] Batch<Chart> solve_batch(
    typename Batch<Chart>::States states,
    const std::function<DenseVector(const typename Batch<Chart>::States&)>& whitened) {
  const auto dim = static_cast<Eigen::Index>(states.size()) * Chart::kDim;
  Dense information;
  for (int iteration = 0; iteration < 20; ++iteration) {
    constexpr double kStep = 1e-5;
    const DenseVector r = whitened(states);
    Dense J(r.size(), dim);
    for (Eigen::Index i = 0; i < dim; ++i) {
      const DenseVector xi = kStep * DenseVector::Unit(dim, i);
      J.col(i) = (whitened(moved<Chart>(states, xi)) - whitened(moved<Chart>(states, -xi))) / (2 * kStep);
    }
    information = J.transpose() * J;
    const DenseVector step = -information.ldlt().solve(J.transpose() * r);
    states = moved<Chart>(states, step);
    if (step.norm() < 1e-10) break;
  }
  return {states, information.ldlt().solve(Dense::Identity(dim, dim))};
}

/// A body that goes round a bend and measures its position at every step.
struct Bend {
  static constexpr std::size_t kSteps = 6;

  Bend(Rng& rng, double scale) {
    Vector6<double> prior_sigma, motion_sigma, step;
    prior_sigma << 1, 1, 1, 20, 20, 20;
    motion_sigma << 0.5, 0.5, 0.5, 5, 5, 5;
    step << 0.02, -0.05, 0.3, 1, 0.1, -0.05;
    prior = {random_pose<double>(rng), (scale * prior_sigma).cwiseAbs2().asDiagonal()};
    noise = {Pose::identity(), (scale * motion_sigma).cwiseAbs2().asDiagonal()};
    position_sigma = 10 * scale;
    motion = Pose::exp(step);
    const auto draw = [&](const Belief& density) { return sample(density, rng); };
    truth.push_back(draw(prior));
    for (std::size_t k = 0; k < kSteps; ++k) {
      truth.push_back(truth.back() * motion * draw(noise));
      measured.push_back(truth.back().translation() +
                         position_sigma * detail::standard_normal<double, 3>(rng));
    }
  }

  [[nodiscard]] auto measurement(std::size_t k) const {
    const std::vector<NoisyMeasurement<double, 3>> z = {
        {measured[k], position_sigma * position_sigma * Matrix3<double>::Identity()}};
    return GaussianMeasurements(
        z, +[](const Pose& x, std::size_t) { return Vector3<double>(x.translation()); });
  }
  template <class Filter>
  [[nodiscard]] auto smoothed() const {
    SmoothingFilter<Filter> filter{Filter(prior)};
    for (std::size_t k = 0; k < kSteps; ++k) {
      filter.predict(motion, noise);
      REQUIRE(filter.update(measurement(k)).status == UpdateStatus::kConverged);
    }
    return filter.smoothed();
  }
  [[nodiscard]] DenseVector residuals(const std::vector<Pose>& x) const {
    DenseVector r(6 + 9 * static_cast<Eigen::Index>(kSteps));
    const Vector6<double> prior_sigma = prior.covariance.diagonal().cwiseSqrt();
    const Vector6<double> motion_sigma = noise.covariance.diagonal().cwiseSqrt();
    r.head<6>() = x[0].boxminus(prior.pose).cwiseQuotient(prior_sigma);
    for (std::size_t k = 0; k < kSteps; ++k) {
      const auto begin = 6 + 9 * static_cast<Eigen::Index>(k);
      r.segment<6>(begin) = x[k + 1].boxminus(x[k] * motion).cwiseQuotient(motion_sigma);
      r.segment<3>(begin + 6) = (measured[k] - x[k + 1].translation()) / position_sigma;
    }
    return r;
  }

  Belief prior, noise;
  Pose motion;
  double position_sigma;
  std::vector<Pose> truth;
  std::vector<Vector3<double>> measured;
};

/// The position and velocity of a body on a line, which has no chart but the vectors themselves.
using Line = VectorChart<double, 2>;

}  // namespace

TEST_CASE("Smoothing a linear problem is solving it as a whole", "[filters][smoothing]") {
  constexpr std::size_t kSteps = 12;
  Matrix2<double> F, Q, P;
  F << 1, 0.5, 0, 1;
  Q << 0.02, 0.03, 0.03, 0.09;
  P << 4, 0.5, 0.5, 1;
  constexpr double kSigma = 0.3;
  SmoothingFilter<StateFilter<Line>> filter{StateFilter<Line>({Vector2<double>(1, -1), P})};
  std::vector<double> measured;
  for (std::size_t k = 0; k < kSteps; ++k) {
    measured.push_back(std::sin(0.7 * static_cast<double>(k)));
    filter.predict([&](const Vector2<double>& x) { return Vector2<double>(F * x); }, F, Q);
    const std::vector<NoisyMeasurement<double, 1>> z = {
        {Vector<double, 1>(measured.back()), Matrix<double, 1>(kSigma * kSigma)}};
    const GaussianMeasurements position(
        z, [](const Vector2<double>& x, std::size_t) { return Vector<double, 1>(x[0]); });
    REQUIRE(filter.update(position).status == UpdateStatus::kConverged);
  }
  const Matrix2<double> L_P = P.llt().matrixL(), L_Q = Q.llt().matrixL();
  const auto batch = solve_batch<Line>(std::vector<Vector2<double>>(kSteps + 1, Vector2<double>::Zero()),
                                       [&](const auto& x) {
                                         DenseVector r(2 + 3 * static_cast<Eigen::Index>(kSteps));
                                         r.head<2>() = L_P.inverse() * (x[0] - Vector2<double>(1, -1));
                                         for (std::size_t k = 0; k < kSteps; ++k) {
                                           const auto begin = 2 + 3 * static_cast<Eigen::Index>(k);
                                           r.segment<2>(begin) = L_Q.inverse() * (x[k + 1] - F * x[k]);
                                           r[begin + 2] = (measured[k] - x[k + 1][0]) / kSigma;
                                         }
                                         return r;
                                       });
  const auto smoothed = filter.smoothed();
  REQUIRE(smoothed.size() == kSteps + 1);
  for (std::size_t k = 0; k <= kSteps; ++k) {
    CAPTURE(k);
    // Differences over a step of 1e-5 have rounding errors of 1e-11, the condition of the problem is 1e3.
    CHECK(max_difference(smoothed[k].state, batch.states[k]) < 1e-8);
    CHECK(max_difference(smoothed[k].covariance, batch.block(k)) < 1e-8);
  }
}

TEMPLATE_TEST_CASE("Smoothing poses comes as near to the batch solution as errors are small",
                   "[filters][smoothing]", LinearizedPoseFilter<double>, LinearizedSplitPoseFilter<double>) {
  // Rotations are known to `scale`. What is left out is of that order beside the standard deviations.
  using Chart = typename TestType::Belief::Chart;
  for (const double scale : {1e-2, 1e-3}) {
    Rng rng(21);
    const Bend bend(rng, scale);
    const auto smoothed = bend.smoothed<TestType>();
    const auto batch =
        solve_batch<ScrewChart<double>>(bend.truth, [&](const auto& x) { return bend.residuals(x); });
    for (std::size_t k = 0; k <= Bend::kSteps; ++k) {
      CAPTURE(scale, k);
      const Belief expected{batch.states[k], batch.block(k)};
      CHECK(std::sqrt(mahalanobis_squared(expected, smoothed[k].pose)) < 5 * scale);
      const Matrix6<double> L = expected.covariance.llt().matrixL();
      const Matrix6<double> L_inverse = L.inverse();
      const Belief screw = in_chart<ScrewChart<double>>(typename TestType::Belief(smoothed[k]));
      CHECK((L_inverse * screw.covariance * L_inverse.transpose() - Matrix6<double>::Identity()).norm() <
            30 * scale);
      STATIC_REQUIRE(Chart::kDim == 6);
    }
  }
}

TEST_CASE("The covariance of smoothed poses is as large as their errors", "[filters][smoothing]") {
  constexpr int kRuns = 100;
  double first = 0, middle = 0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    Rng rng(seed + 100);
    const Bend bend(rng, 0.02);
    const auto smoothed = bend.smoothed<LinearizedPoseFilter<double>>();
    first += nees(smoothed[0], bend.truth[0]) / kRuns;
    middle += nees(smoothed[Bend::kSteps / 2], bend.truth[Bend::kSteps / 2]) / kRuns;
  }
  const double band = 4 * std::sqrt(2 * 6.0 / kRuns);  // four standard errors
  CHECK(std::abs(first - 6) < band);
  CHECK(std::abs(middle - 6) < band);
}

TEST_CASE("Without predictions there is nothing to smooth, and without measurements nothing changes",
          "[filters][smoothing]") {
  Rng rng(4);
  const Bend bend(rng, 0.02);
  SmoothingFilter<LinearizedPoseFilter<double>> filter{LinearizedPoseFilter<double>(bend.prior)};
  REQUIRE(filter.smoothed().size() == 1);
  CHECK(filter.smoothed()[0].covariance == bend.prior.covariance);
  std::vector<Belief> predicted{filter.belief()};
  for (int k = 0; k < 3; ++k) {
    filter.predict(bend.motion, bend.noise);
    predicted.push_back(filter.belief());
  }
  const auto smoothed = filter.smoothed();
  REQUIRE(smoothed.size() == 4);
  for (std::size_t k = 0; k < 4; ++k) {
    CHECK(smoothed[k].pose.is_approx(predicted[k].pose, 1e-12));
    CHECK(smoothed[k].covariance.isApprox(predicted[k].covariance, 1e-9));
  }
}

TEST_CASE("What a singular covariance says is exact stays exact when smoothed", "[filters][smoothing]") {
  // A body in the plane: heading and two coordinates vary.
  Vector6<double> prior_sigma, motion_sigma;
  prior_sigma << 0, 0, 0.02, 0.5, 0.5, 0;
  motion_sigma << 0, 0, 0.01, 0.1, 0.1, 0;
  const Belief noise{Pose::identity(), motion_sigma.cwiseAbs2().asDiagonal()};
  Vector6<double> step;
  step << 0, 0, 0.2, 1, 0, 0;
  SmoothingFilter<LinearizedPoseFilter<double>> filter{
      LinearizedPoseFilter<double>({Pose::identity(), prior_sigma.cwiseAbs2().asDiagonal()})};
  Pose truth;
  for (int k = 0; k < 5; ++k) {
    filter.predict(Pose::exp(step), noise);
    truth = truth * Pose::exp(step);
    const std::vector<NoisyMeasurement<double, 3>> z = {
        {truth.translation() + Vector3<double>(0.05, -0.02, 0), 0.01 * Matrix3<double>::Identity()}};
    const auto h = [](const Pose& x, std::size_t) { return Vector3<double>(x.translation()); };
    REQUIRE(filter.update(GaussianMeasurements(z, h)).status == UpdateStatus::kConverged);
  }
  for (const Belief& belief : filter.smoothed()) {
    CHECK(std::abs(belief.pose.translation().z()) < 1e-12);
    for (const int fixed : {0, 1, 5}) CHECK(std::abs(belief.covariance(fixed, fixed)) < 1e-15);
    CHECK(belief.covariance(2, 2) > 0);
    CHECK_NOTHROW(LinearizedPoseFilter<double>(belief));
  }
  CHECK(filter.smoothed()[0].covariance.trace() < 0.1 * prior_sigma.squaredNorm());
}

TEST_CASE("A recorded prediction with one triangle of a covariance is refused",
          "[filters][smoothing][error]") {
  const Matrix6<double> full = Matrix6<double>::Identity();
  Matrix6<double> triangle = full;
  triangle(0, 3) = 0.25;
  const Belief good{Pose(), full}, bad{Pose(), triangle};
  using Recorded = RecordedPrediction<Belief>;
  const Recorded step{good, good, full, full};
  CHECK_NOTHROW((void)smooth(step, good));
  CHECK_THROWS_AS(smooth(step, bad), std::invalid_argument);
  CHECK_THROWS_AS(smooth(Recorded{bad, good, full, full}, good), std::invalid_argument);
  CHECK_THROWS_AS(smooth(Recorded{good, bad, full, full}, good), std::invalid_argument);
  CHECK_THROWS_AS(smooth(Recorded{good, good, full, triangle}, good), std::invalid_argument);
}

}  // namespace antipode::test
