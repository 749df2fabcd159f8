// SPDX-License-Identifier: MIT
#include <cmath>
#include <tuple>
#include <vector>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/filters/marginal_update.hpp>
#include <antipode/filters/pose_filter.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/no_allocation.hpp"

namespace antipode::test {
namespace {

/// Pose, velocity, gravity; biases; a time offset.
using Inertial = ProductChart<ExtendedPoseChart<double, 3>, VectorChart<double, 6>, VectorChart<double, 1>>;
using InertialDensity = StateGaussian<Inertial>;
constexpr int kStateDim = Inertial::kDim;
using StateSquare = Matrix<double, kStateDim>;

[[nodiscard]] InertialDensity random_inertial(Rng& rng, double sigma) {
  InertialDensity x;
  auto& [navigation, biases, offset] = x.state;
  navigation.pose = random_pose<double>(rng, 1.0);
  navigation.velocity = random_matrix<double, 3, 1>(rng);
  navigation.vectors = 9.81 * random_unit<double, 3>(rng);
  biases = random_matrix<double, 6, 1>(rng, 0.1);
  offset = random_matrix<double, 1, 1>(rng, 0.01);
  x.covariance = sigma * sigma * random_covariance<double, kStateDim>(rng, 0.1);
  return x;
}

[[nodiscard]] PoseGaussian<double> random_posterior(Rng& rng, const PoseGaussian<double>& prior) {
  const Vector6<double> d = std::sqrt(prior.covariance.trace() / 6) * random_matrix<double, 6, 1>(rng);
  return {prior.pose.boxplus(d), 0.1 * prior.covariance};
}

/// Points about the origin, measured from the pose with a noise of a centimetre.
[[nodiscard]] std::vector<Vector3<double>> points_about_origin() {
  Rng rng(99);
  std::vector<Vector3<double>> points;
  points.reserve(6);
  for (int i = 0; i < 6; ++i) points.push_back(random_matrix<double, 3, 1>(rng, 4.0));
  return points;
}
constexpr double kPointSigma_m = 0.01;

[[nodiscard]] std::vector<NoisyMeasurement<double, 3>> measured_from(const DualQuaternion<double>& pose,
                                                                     Rng& rng) {
  std::normal_distribution<double> noise(0.0, kPointSigma_m);
  std::vector<NoisyMeasurement<double, 3>> z;
  for (const auto& point : points_about_origin()) {
    Vector3<double> seen = pose.inverse() * point;
    for (double& entry : seen) entry += noise(rng);
    z.push_back({seen, kPointSigma_m * kPointSigma_m * Matrix3<double>::Identity()});
  }
  return z;
}
struct SeenPoints {
  std::vector<Vector3<double>> points = points_about_origin();
  [[nodiscard]] Vector3<double> operator()(const DualQuaternion<double>& x, std::size_t i) const {
    return x.inverse() * points[i];
  }
};
using SeenFilter =
    PoseFilter<InertialDensity, MysovskikhRule<6>, PoseMarginalUpdate<PosteriorLinearization<double>>>;

}  // namespace

TEST_CASE("A state with another marginal has exactly that marginal", "[marginal_update][law]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto state = random_inertial(rng, 0.3);
    const auto posterior = random_posterior(rng, pose_marginal(state));
    const auto all = with_marginal(state, posterior);
    REQUIRE(all.status == MarginalStatus::kUpdated);
    const auto again = pose_marginal(all.posterior);
    CHECK(again.pose.boxminus(posterior.pose).norm() <= 1e-13);
    CHECK(max_difference(again.covariance, posterior.covariance) <= 1e-14);
    CHECK(detail::cholesky_factor<double, kStateDim>(all.posterior.covariance).has_value());
    // The prior's own marginal changes nothing.
    const auto same = with_marginal(state, pose_marginal(state));
    CHECK(Inertial::local(state.state, same.posterior.state).norm() <= 1e-14);
    CHECK(max_difference(same.posterior.covariance, state.covariance) <= 1e-14);
  }
}

TEST_CASE("A measured position updates the rest as Kalman's gain does", "[marginal_update]") {
  using Moving = ProductChart<SplitChart<double>, VectorChart<double, 3>>;
  Rng rng(1);
  const StateGaussian<Moving> prior{{random_pose<double>(rng), random_matrix<double, 3, 1>(rng)},
                                    Matrix<double, 9>(0.01 * random_covariance<double, 9>(rng, 0.1))};
  const Vector3<double> innovation(0.1, -0.05, 0.02);
  const std::vector<NoisyMeasurement<double, 3>> z{
      {std::get<0>(prior.state).translation() + innovation, 9e-4 * Matrix3<double>::Identity()}};
  const auto update = linearized_update(
      pose_marginal(prior), z,
      [](const DualQuaternion<double>& x, std::size_t) { return Vector3<double>(x.translation()); });
  REQUIRE(update.status == UpdateStatus::kConverged);
  const auto all = with_marginal(prior, update.posterior);
  REQUIRE(all.status == MarginalStatus::kUpdated);
  const Matrix<double, 9, 3> PH = prior.covariance.middleCols<3>(3);
  const Matrix3<double> S = prior.covariance.block<3, 3>(3, 3) + 9e-4 * Matrix3<double>::Identity();
  const Matrix<double, 9, 3> K = PH * S.inverse();
  CHECK((Moving::local(prior.state, all.posterior.state) - K * innovation).norm() <= 1e-9);
  const Matrix<double, 9> covariance = prior.covariance - K * PH.transpose();
  CHECK(max_difference(all.posterior.covariance.bottomRightCorner<6, 6>(),
                       covariance.bottomRightCorner<6, 6>()) <= 1e-9);
}

TEST_CASE("The update of the pose alone is that of the whole state", "[marginal_update]") {
  Rng rng(2);
  const auto prior = random_inertial(rng, 1e-3);  // so narrow that all is linear
  const auto z =
      measured_from(std::get<0>(prior.state).pose.boxplus(1e-3 * random_matrix<double, 6, 1>(rng)), rng);
  const SeenPoints model;
  const auto of_state = [&](const Inertial::Point& x, std::size_t i) {
    return model(std::get<0>(x).pose, i);
  };
  const auto whole = linearized_update(prior, z, of_state);
  SeenFilter filter(prior);
  const auto part = filter.update(GaussianMeasurements(z, model));
  REQUIRE(whole.status == UpdateStatus::kConverged);
  REQUIRE(part.status == UpdateStatus::kConverged);
  // Equal to first order: 1e-3 of the step of 1e-3.
  CHECK(Inertial::local(whole.posterior.state, part.posterior.state).norm() <= 1e-5);
  CHECK(max_difference(whole.posterior.covariance, part.posterior.covariance) <= 1e-3 * 1e-6);
  CHECK(max_difference(filter.belief().covariance, part.posterior.covariance) == 0.0);
  CHECK(part.nis == Approx(whole.nis).epsilon(1e-3));
}

TEST_CASE("The covariance of the rest is as large as its error", "[marginal_update][random]") {
  constexpr int kTrials = 300;
  double sum = 0.0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto prior = random_inertial(rng, 0.05);
    const auto truth = draw(rng, prior);
    SeenFilter filter(prior);
    const auto result =
        filter.update(GaussianMeasurements(measured_from(std::get<0>(truth).pose, rng), SeenPoints{}));
    REQUIRE(result.status == UpdateStatus::kConverged);
    sum += nees(filter.belief(), truth);
  }
  CHECK(std::abs(sum / kTrials - kStateDim) <= 3.0 * std::sqrt(2.0 * kStateDim / kTrials));
}

TEST_CASE("Further parts of the state can be in the marginal", "[marginal_update]") {
  Rng rng(3);
  const auto state = random_inertial(rng, 0.1);
  const auto marginal = pose_marginal<2>(state);
  CHECK(std::get<1>(marginal.state) == std::get<2>(state.state));
  CHECK(marginal.covariance(6, 6) == state.covariance(18, 18));
  CHECK(marginal.covariance(3, 6) == state.covariance(6, 18));
  // Its measurement: the offset itself.
  const std::vector<NoisyMeasurement<double, 1>> z{{Vector<double, 1>(0.05), Matrix<double, 1>(1e-6)}};
  const auto update = linearized_update(
      marginal, z, [](const auto& x, std::size_t) { return Vector<double, 1>(std::get<1>(x)); });
  const auto all = with_marginal<2>(state, update.posterior);
  REQUIRE(all.status == MarginalStatus::kUpdated);
  const auto last = state.covariance.col(18);
  const double innovation = 0.05 - std::get<2>(state.state)[0], S = last[18] + 1e-6;
  CHECK((Inertial::local(state.state, all.posterior.state) - last * innovation / S).norm() <= 1e-9);
  CHECK(all.posterior.covariance(18, 18) == Approx(1e-6 * last[18] / S).epsilon(1e-6));
  // The velocity's own error turns with the step of the rotation, and keeps its size.
  CHECK(all.posterior.covariance.block<3, 3>(12, 12).trace() ==
        Approx((state.covariance - last * last.transpose() / S).block<3, 3>(12, 12).trace()).epsilon(1e-6));
}

TEST_CASE("A filter updates the pose and a further part together", "[marginal_update]") {
  using Filter =
      PoseFilter<InertialDensity, Degree5Rule<7>, PoseMarginalUpdate<PosteriorLinearization<double>, 2>>;
  Rng rng(8);
  const auto prior = random_inertial(rng, 0.01);
  // Points are seen by a camera that is exposed later, by the offset, while the body turns.
  const Vector6<double> twist = random_matrix<double, 6, 1>(rng);
  const SeenPoints model;
  const auto seen_late = [&](const auto& x, std::size_t i) {
    const auto& [pose, offset] = x;
    return model(pose.boxplus(Vector6<double>(offset[0] * twist)), i);
  };
  const auto of_state = [&](const Inertial::Point& x, std::size_t i) {
    return seen_late(std::tuple(std::get<0>(x).pose, std::get<2>(x)), i);
  };
  const auto z = measured_from(std::get<0>(prior.state).pose, rng);
  Filter filter(prior);
  const auto part = filter.update(GaussianMeasurements(z, seen_late));
  const auto whole = linearized_update(prior, z, of_state);
  REQUIRE(part.status == UpdateStatus::kConverged);
  REQUIRE(whole.status == UpdateStatus::kConverged);
  // Equal to first order: a hundredth of the step of a hundredth.
  CHECK(Inertial::local(whole.posterior.state, part.posterior.state).norm() <= 1e-3);
  CHECK(max_difference(whole.posterior.covariance, part.posterior.covariance) <= 1e-2 * 1e-4);
}

TEST_CASE("A marginal that is known exactly cannot be updated, and says so", "[marginal_update][error]") {
  Rng rng(4);
  auto state = random_inertial(rng, 0.1);
  const auto posterior = random_posterior(rng, pose_marginal(state));
  const auto expect_singular = [&](const InertialDensity& x) {
    const auto all = with_marginal(x, posterior);
    CHECK(all.status == MarginalStatus::kSingular);
    CHECK(max_difference(all.posterior.covariance, x.covariance) == 0.0);
    CHECK(Inertial::local(all.posterior.state, x.state).norm() <= 1e-15);
    SeenFilter filter(x);
    Rng noise(5);
    const auto z = measured_from(std::get<0>(x.state).pose, noise);
    CHECK(filter.update(GaussianMeasurements(z, SeenPoints{})).status == UpdateStatus::kDiverged);
    CHECK(max_difference(filter.belief().covariance, x.covariance) == 0.0);
  };
  InertialDensity known = state;
  known.covariance.setZero();
  expect_singular(known);
  // The first coordinate of the position is ten times that of the rotation.
  StateSquare T = StateSquare::Identity();
  T.row(6) = 10.0 * StateSquare::Identity().row(0);
  known.covariance = detail::congruence<double, kStateDim, kStateDim>(T, state.covariance);
  expect_singular(known);
  // Small is not singular: in nanometres the same state is updated.
  InertialDensity small = state;
  small.covariance *= 1e-18;
  const auto all = with_marginal(small, {std::get<0>(small.state).pose, 1e-19 * posterior.covariance});
  CHECK(all.status == MarginalStatus::kUpdated);
}

TEST_CASE("A step too large to compute with leaves the state as it was", "[marginal_update][error]") {
  Rng rng(6);
  auto state = random_inertial(rng, 0.1);
  state.covariance.block<3, 3>(12, 12) *= 1e200;
  state.covariance.block<1, 1>(12, 6).setConstant(1e150);
  state.covariance.block<1, 1>(6, 12).setConstant(1e150);
  auto posterior = pose_marginal(state);
  posterior.pose = posterior.pose * DualQuaternion<double>::from_rotation_translation(
                                        Vector4<double>(1, 0, 0, 0), Vector3<double>(1e160, 0, 0));
  const auto all = with_marginal(state, posterior);
  CHECK(all.status == MarginalStatus::kNotFinite);
  CHECK(max_difference(all.posterior.covariance, state.covariance) == 0.0);
}

TEST_CASE("Regression on the marginal allocates nothing", "[marginal_update][allocation]") {
  Rng rng(7);
  const auto state = random_inertial(rng, 0.1);
  const auto posterior = random_posterior(rng, pose_marginal(state));
  const auto all = without_allocation([&] { return with_marginal(state, posterior); });
  CHECK(all.status == MarginalStatus::kUpdated);
}

}  // namespace antipode::test
