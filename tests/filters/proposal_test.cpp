// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <random>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include <antipode/distributions/pose_gaussian_queries.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/filters/mixture_filter.hpp>
#include <antipode/filters/pose_filter.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

using Pose = DualQuaternion<double>;
using Belief = PoseGaussian<double>;
using Joint = ProductChart<SplitChart<double>, VectorChart<double, 3>>;

[[nodiscard]] Belief start() {
  Vector6<double> sigma;
  sigma << 0.05, 0.05, 0.05, 1, 1, 1;
  return {Pose::identity(), sigma.cwiseAbs2().asDiagonal()};
}
[[nodiscard]] Belief motion_noise() { return {Pose::identity(), 1e-4 * Matrix6<double>::Identity()}; }

struct Position {
  Vector3<double> operator()(const Pose& x, std::size_t) const { return x.translation(); }
  Vector3<double> operator()(const Joint::Point& x, std::size_t) const {
    return std::get<0>(x).translation();
  }
};
[[nodiscard]] auto position_at(double x) {
  const std::vector<NoisyMeasurement<double, 3>> z = {
      {Vector3<double>(x, 0, 0), 0.25 * Matrix3<double>::Identity()}};
  return GaussianMeasurements(z, Position{});
}

[[nodiscard]] bool same(const Belief& a, const Belief& b) {
  return a.pose.coeffs() == b.pose.coeffs() && a.covariance == b.covariance;
}

}  // namespace

TEMPLATE_TEST_CASE("A proposal that is committed is an update", "[filters][proposal]",
                   LinearizedPoseFilter<double>, RichPoseFilter<double>) {
  TestType updated(start()), proposed(start());
  const auto result = updated.update(position_at(0.5));
  const auto proposal = std::as_const(proposed).propose(position_at(0.5));
  CHECK(same(proposed.belief(), TestType(start()).belief()));  // nothing has changed yet
  CHECK(proposal.status == UpdateStatus::kConverged);
  CHECK(proposal.nis == result.nis);
  CHECK(same(proposal.posterior, result.posterior));
  CHECK(proposed.commit(proposal));
  CHECK(same(proposed.belief(), updated.belief()));
}

TEST_CASE("A measurement that fails the gate leaves no trace", "[filters][proposal]") {
  LinearizedPoseFilter<double> filter(start()), without(start());
  constexpr double kGate = 16.27;  // chi-square, three degrees of freedom, one in a thousand
  for (const double x : {0.3, 50.0, -0.2}) {
    const auto proposal = filter.propose(position_at(x));
    CHECK((proposal.nis > kGate) == (x == 50.0));
    if (proposal.nis <= kGate) CHECK(filter.commit(proposal));
    if (x != 50.0) without.update(position_at(x));
  }
  CHECK(same(filter.belief(), without.belief()));
}

TEST_CASE("A proposal of an earlier belief is refused", "[filters][proposal][error]") {
  LinearizedPoseFilter<double> filter(start());
  const auto refused = [&](const auto& proposal) {
    return contains(error_message([&] { (void)filter.commit(proposal); }), "of an earlier belief");
  };
  auto proposal = filter.propose(position_at(0.5));
  filter.predict(Pose::identity(), motion_noise());
  CHECK(refused(proposal));
  proposal = filter.propose(position_at(0.5));
  const auto second = filter.propose(position_at(0.5));
  CHECK(filter.commit(proposal));
  CHECK(refused(second));    // it would count the prior alone
  CHECK(refused(proposal));  // twice
  proposal = filter.propose(position_at(0.5));
  filter.update(position_at(0.4));
  CHECK(refused(proposal));
}

TEST_CASE("A proposal that has not converged is not committed", "[filters][proposal]") {
  QuadraticPoseFilter<double> filter(start());
  const auto proposal = filter.propose([](const Pose&) { return std::nan(""); });
  CHECK(proposal.status == UpdateStatus::kNotFinite);
  CHECK_FALSE(filter.commit(proposal));
  CHECK(same(filter.belief(), start()));
}

TEST_CASE("A mixture filter proposes what its update would do", "[filters][proposal][mixture]") {
  using Filter = MixtureFilter<double>;
  const auto at = [](double x) {
    const Pose pose = Pose::from_rotation_translation(Vector4<double>(1, 0, 0, 0), Vector3<double>(x, 0, 0));
    return Filter::Belief(ProjectedGaussian<double>(pose, 0.04 * Matrix6<double>::Identity()));
  };
  Filter updated(at(0)), proposed(at(0));
  const auto step = updated.update(at(0.3));
  const auto proposal = std::as_const(proposed).propose(at(0.3));
  CHECK(proposal.log_evidence == step.log_evidence);
  const auto x_of = [](const Filter::Belief& belief) {
    return belief.heaviest().density.pose().translation().x();
  };
  CHECK(x_of(proposed.belief()) == 0.0);
  CHECK(x_of(proposal.posterior()) == x_of(updated.belief()));
  CHECK(proposed.commit(proposal));
  CHECK(x_of(proposed.belief()) == x_of(updated.belief()));
  CHECK(contains(error_message([&] { (void)proposed.commit(proposal); }), "of an earlier belief"));
  const Pose backwards =
      Pose::from_rotation_translation(Vector4<double>(0, 0, 0, 1), Vector3<double>::Zero());
  const auto rejected =
      proposed.propose(ProjectedGaussian<double>(backwards, 0.04 * Matrix6<double>::Identity()));
  CHECK(rejected.status == UpdateStatus::kNoSupport);
  CHECK_FALSE(proposed.commit(rejected));
  CHECK(x_of(proposed.belief()) == x_of(updated.belief()));
}

TEST_CASE("The NEES of draws of a joint state is its dimension on average", "[filters][nees]") {
  Rng rng(12);
  const Matrix<double, 9> A = random_matrix<double, 9, 9>(rng, 0.1);
  const Matrix<double, 9> P = A * A.transpose() + 1e-4 * Matrix<double, 9>::Identity();
  const StateGaussian<Joint> belief{{random_pose<double>(rng), Vector3<double>(1, 2, 3)}, P};
  const Matrix<double, 9> L = detail::cholesky_factor<double, 9>(P).value();
  constexpr int kDraws = 2000;
  double sum = 0;
  for (int i = 0; i < kDraws; ++i) {
    const Vector<double, 9> xi = L * detail::standard_normal<double, 9>(rng);
    sum += nees(belief, Joint::retract(belief.state, xi));
  }
  CHECK(std::abs(sum / kDraws - 9) < 4 * std::sqrt(2 * 9.0 / kDraws));  // four standard errors
  CHECK(nees(belief, belief.state) == 0);
  StateGaussian<Joint> broken = belief;
  broken.covariance(0, 8) += 0.01;
  CHECK_THROWS_AS(nees(broken, belief.state), std::invalid_argument);
  broken.covariance.setZero();
  CHECK_THROWS_AS(nees(broken, belief.state), std::domain_error);
}

}  // namespace antipode::test
