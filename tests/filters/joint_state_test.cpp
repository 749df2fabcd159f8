// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <cstddef>
#include <new>
#include <tuple>
#include <vector>

#include <antipode/filters/pose_filter.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/extended_pose.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Point = Vector3<double>;
/// A pose and the velocity of its position.
using Moving = ProductChart<SplitChart<double>, VectorChart<double, 3>>;
using StateDensity = StateGaussian<Moving>;
using Square = Matrix<double, 9>;

[[nodiscard]] StateDensity random_density(Rng& rng) {
  return {{random_pose<double>(rng), random_matrix<double, 3, 1>(rng)},
          Square(0.01 * random_covariance<double, 9>(rng, 0.1))};
}

[[nodiscard]] auto position(const Point& z, double sigma) {
  return GaussianMeasurements(
      std::vector<NoisyMeasurement<double, 3>>{{z, Matrix3<double>::Identity() * (sigma * sigma)}},
      [](const Moving::Point& x, std::size_t) -> Point { return std::get<0>(x).translation(); });
}

}  // namespace

TEST_CASE("A state that nothing was said of is the identity and zero, whatever the memory held", "[joint]") {
  alignas(StateDensity) std::array<std::byte, sizeof(StateDensity)> memory;
  memory.fill(std::byte{0x5a});
  const auto* state = new (memory.data()) StateDensity;
  CHECK(std::get<0>(state->state).coeffs() == Pose::identity().coeffs());
  CHECK(std::get<1>(state->state) == Point::Zero());
  CHECK(state->covariance.isZero(0.0));
}

TEST_CASE("A position updates the velocity that it is correlated with", "[joint]") {
  Rng rng(1);
  const StateDensity prior = random_density(rng);
  const Point z = std::get<0>(prior.state).translation() + Point(0.1, -0.05, 0.02);
  StateFilter<Moving> filter(prior);
  const auto result = filter.update(position(z, 0.03));
  CHECK(result.status == UpdateStatus::kConverged);
  // Linear in this chart: Kalman's gain.
  const Matrix<double, 9, 3> PH = prior.covariance.middleCols<3>(3);
  const Matrix3<double> S = prior.covariance.block<3, 3>(3, 3) + 9e-4 * Matrix3<double>::Identity();
  const Matrix<double, 9, 3> K = PH * S.inverse();
  const Vector<double, 9> step = K * Point(0.1, -0.05, 0.02);
  CHECK((Moving::local(prior.state, result.posterior.state) - step).norm() <= 1e-9);
  const Square covariance = prior.covariance - K * PH.transpose();
  CHECK(max_difference(result.posterior.covariance.bottomRightCorner<6, 6>(),
                       covariance.bottomRightCorner<6, 6>()) <= 1e-9);
  CHECK(max_difference(filter.belief().covariance, result.posterior.covariance) == 0.0);
}

TEST_CASE("A joint state is predicted through its points and through its Jacobian", "[joint]") {
  Rng rng(2);
  const StateDensity state = random_density(rng);
  const double dt = 0.1;
  const auto move = [=](const Moving::Point& x) {
    const auto& [pose, velocity] = x;
    Vector6<double> step = Vector6<double>::Zero();
    step.tail<3>() = dt * velocity;
    return Moving::Point(SplitChart<double>::retract(pose, step), velocity);
  };
  Square F = Square::Identity();
  F.block<3, 3>(3, 6) = dt * Matrix3<double>::Identity();
  const Square Q = 1e-4 * Square::Identity();
  const StateDensity sampled = predict(state, move, Q);
  const StateDensity closed = predict_closed_form(state, move, F, Q);
  // The mean of the points is iterated until it moves by a thousandth of their spread, 0.1.
  CHECK(max_difference(sampled.covariance, closed.covariance) <= 1e-6);
  CHECK(Moving::local(sampled.state, closed.state).norm() <= 1e-6);
  StateFilter<Moving> filter(state);
  filter.predict(move, F, Q);
  CHECK(max_difference(filter.belief().covariance, closed.covariance) == 0.0);
  CHECK_THROWS_AS(filter.predict(move, F, Square(-Q)), std::invalid_argument);
  CHECK(max_difference(filter.belief().covariance, closed.covariance) == 0.0);
}

TEST_CASE("Jacobians serve joint states, too", "[joint]") {
  using Navigation = ExtendedPoseChart<double>;
  constexpr int kTrials = 200;
  double sum = 0.0;
  const auto position_of = [](const Navigation::Point& x, std::size_t, Matrix<double, 3, 9>& J) {
    J << Matrix<double, 3, 6>::Zero(), x.pose.rotation_matrix();
    return Point(x.pose.translation());
  };
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    Rng rng(seed);
    std::normal_distribution<double> noise(0.0, 0.1);
    const StateGaussian<Navigation> prior{{random_pose<double>(rng), random_matrix<double, 3, 1>(rng)},
                                          Square(0.01 * random_covariance<double, 9>(rng, 0.1))};
    const auto truth = draw(rng, prior);
    const Point z = truth.pose.translation() + Point(noise(rng), noise(rng), noise(rng));
    const std::vector<NoisyMeasurement<double, 3>> measurements{{z, 0.01 * Matrix3<double>::Identity()}};
    const auto result = gauss_newton_update(prior, measurements, position_of);
    CHECK(result.status == UpdateStatus::kConverged);
    sum += nees(result.posterior, truth);
  }
  CHECK(std::abs(sum / kTrials - 9.0) <= 3.0 * std::sqrt(18.0 / kTrials));
}
