// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>

#include <antipode/distributions/detail/agreement.hpp>
#include <antipode/distributions/mixture_queries.hpp>
#include <antipode/distributions/projected_gaussian_conversions.hpp>
#include <antipode/filters/mixture_filter.hpp>
#include <antipode/filters/predict.hpp>
#include <antipode/filters/update_status.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Filter = MixtureFilter<double>;
using Pose = DualQuaternion<double>;

/// A body drives a circle; every measurement sees its pose, or the same turned by a quarter about the
/// vertical, as a camera does that cannot tell the sides of a box apart.
struct Drive {
  Matrix6<double> noise, measurement_noise;
  Pose step, quarter_turn;

  Drive() {
    Vector6<double> xi, turn = Vector6<double>::Zero(), sigma;
    xi << 0.0, 0.0, 0.1, 0.5, 0.0, 0.0;
    turn[2] = std::numbers::pi / 2.0;
    step = Pose::exp(xi);
    quarter_turn = Pose::exp(turn);
    sigma << Vector3<double>::Constant(0.01), Vector3<double>::Constant(0.02);
    noise = sigma.cwiseAbs2().asDiagonal();
    measurement_noise = 9.0 * noise;
  }

  [[nodiscard]] PoseComponent at(const Pose& pose, const Matrix6<double>& covariance) const {
    return to_projected_gaussian(PoseGaussian<double>{pose, covariance});
  }
  [[nodiscard]] Pose perturbed(const Pose& pose, const Matrix6<double>& covariance, Rng& rng) const {
    return at(pose, covariance).sample(rng);
  }
  /// What the camera says: two sides, equally likely.
  [[nodiscard]] PoseMixture measurement(const Pose& truth, Rng& rng) const {
    const Pose seen = perturbed(truth, measurement_noise, rng);
    return PoseMixture(
        {{0.5, at(seen, measurement_noise)}, {0.5, at(seen * quarter_turn, measurement_noise)}});
  }
};

}  // namespace

TEST_CASE("The filter finds the side of a box from its motion", "[filter]") {
  const Drive drive;
  for (unsigned seed = 0; seed < 5; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    Pose truth = random_pose<double>(rng);
    // Two sides to start with, and odometry that only one of them drives along with.
    Filter filter(drive.measurement(truth, rng));
    double squared_error = 0.0;
    constexpr int kSteps = 30;
    for (int k = 0; k < kSteps; ++k) {
      truth = truth * drive.step;
      filter.predict(drive.at(drive.perturbed(drive.step, drive.noise, rng), drive.noise));
      const auto step = filter.update(drive.measurement(truth, rng));
      CHECK(step.status == UpdateStatus::kConverged);
      CHECK(std::isfinite(step.log_evidence));
      CHECK(filter.belief().size() <= 10);
      const auto& heaviest = filter.belief().heaviest().density;
      if (k < 10) continue;
      const Vector6<double> error = heaviest.coordinates(truth) - heaviest.mean();
      squared_error += detail::solve_lower<double, 6, 1>(heaviest.sqrt_factor(), error).squaredNorm() /
                       (6.0 * (kSteps - 10));
    }
    CHECK(filter.belief().heaviest().weight > 0.99);
    // Noise and measurements settle at standard deviations of 0.017 rad and 0.035 m about and along each
    // axis: 0.067 in the norm. A quarter-turn would be 1.6.
    CHECK(truth.boxminus(mode(filter.belief()).pose).norm() < 0.2);
    // Of 120 values, in part correlated: about five standard errors either way.
    CHECK(squared_error > 0.4);
    CHECK(squared_error < 1.9);
  }
}

TEST_CASE("With one component the filter is a Kalman filter", "[filter]") {
  Rng rng(1);
  const Drive drive;
  const Matrix6<double> small = 1e-6 * drive.noise;
  Pose truth = random_pose<double>(rng);
  Filter filter{PoseMixture(drive.at(truth, small))};
  PoseGaussian<double> belief{truth, small};
  for (int k = 0; k < 20; ++k) {
    truth = truth * drive.step;
    const Pose moved = drive.perturbed(drive.step, small, rng), seen = drive.perturbed(truth, small, rng);
    filter.predict(drive.at(moved, small));
    filter.update(drive.at(seen, small));

    belief = predict_closed_form(belief, moved, {Pose::identity(), small});
    const Matrix6<double> K = detail::right_divide<double>(
        belief.covariance, *detail::cholesky_factor<double, 6>(belief.covariance + small));
    const Vector6<double> innovation = K * seen.boxminus(belief.pose);
    belief.pose = belief.pose.boxplus(innovation);
    belief.covariance = (Matrix6<double>::Identity() - K) * belief.covariance;
  }
  const auto filtered = to_pose_gaussian(filter.belief()[0].density);
  // Both linearise, at poses that are 1e-5 apart.
  CHECK(filtered.pose.boxminus(belief.pose).norm() <= 1e-8);
  CHECK(max_difference(filtered.covariance, belief.covariance) <=
        1e-3 * belief.covariance.cwiseAbs().maxCoeff());
}

TEST_CASE("Motions may be certain, single or mixed", "[filter]") {
  Rng rng(2);
  const Drive drive;
  const auto start = random_mixture(rng, 3, random_pose<double>(rng));
  Filter certain(start), uncertain(start), mixed(start);
  const auto motion = drive.at(drive.step, drive.noise);
  CHECK(certain.predict(drive.step).reduction_bound == 0.0);
  uncertain.predict(motion);
  mixed.predict(PoseMixture({{0.8, motion}, {0.2, drive.at(Pose::identity(), drive.noise)}}));
  CHECK(certain.belief().size() == 3);
  CHECK(uncertain.belief().size() == 3);
  CHECK(mixed.belief().size() == 6);
  CHECK(certain.belief()[0].density.pose().is_approx(start[0].density.pose() * drive.step, 1e-12));
  CHECK(uncertain.belief()[0].density.covariance().trace() >
        certain.belief()[0].density.covariance().trace());
}

TEST_CASE("A measurement of something else leaves the belief as it was", "[filter]") {
  Rng rng(3);
  const auto start = random_mixture(rng, 3, random_pose<double>(rng));
  Vector6<double> half_turn = Vector6<double>::Zero();
  half_turn[0] = 3.0;
  Filter filter(start);
  const auto step = filter.update(compose(start, Pose::exp(half_turn)));
  CHECK(step.status == UpdateStatus::kNoSupport);
  CHECK(step.rejected_weight == 1.0);
  REQUIRE(filter.belief().size() == 3);
  CHECK(filter.belief()[1].density.covariance() == start[1].density.covariance());
}

TEST_CASE("A wide measurement that is right passes the gate", "[filter][random]") {
  // A body whose pose is known up to a half-turn, and a measurement of the same kind, both to .2 rad: the two
  // differ by more than 30 degrees in one of thirteen cases.
  Vector6<double> sigma, half_turn = Vector6<double>::Zero();
  sigma << Vector3<double>::Constant(0.2), Vector3<double>::Constant(0.1);
  half_turn[2] = std::numbers::pi;
  const Matrix6<double> covariance = sigma.cwiseAbs2().asDiagonal();
  const Drive drive;
  const auto either_way = [&](const Pose& pose) {
    return PoseMixture(
        {{0.5, drive.at(pose, covariance)}, {0.5, drive.at(pose * Pose::exp(half_turn), covariance)}});
  };
  constexpr int kTrials = 2000;
  int dropped = 0;
  Rng rng(5);
  for (int trial = 0; trial < kTrials; ++trial) {
    const Pose truth = random_pose<double>(rng);
    Filter filter(either_way(drive.perturbed(truth, covariance, rng)));
    const auto step = filter.update(either_way(drive.perturbed(truth, covariance, rng)));
    dropped += step.status != UpdateStatus::kConverged;
  }
  // One of a thousand: two expected, and less than nine but for one run of 5000.
  CHECK(dropped <= 8);
}

TEST_CASE("Disagreement is chi-square with six degrees for narrow components, and less for wide ones",
          "[filter][random]") {
  constexpr int kTrials = 4000;
  Rng rng(11);
  for (const double sigma_u : {0.01, 0.1, 0.2, 0.3}) {
    CAPTURE(sigma_u);
    Vector6<double> sigma;
    sigma << Vector3<double>::Constant(sigma_u), Vector3<double>::Constant(0.1);
    const Matrix6<double> covariance = sigma.cwiseAbs2().asDiagonal();
    double sum = 0.0;
    int rejected = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const PoseComponent truth(random_pose<double>(rng), covariance);
      const PoseComponent a(truth.sample(rng), covariance), b(truth.sample(rng), covariance);
      const double d2 = detail::disagreement_squared(a, b);
      CHECK(std::abs(d2 - detail::disagreement_squared(b, a)) <= 1e-9 * (1.0 + d2));
      sum += d2;
      rejected += d2 > 22.46;
    }
    const double error = std::sqrt(12.0 / kTrials);  // standard error of the mean
    CHECK(sum / kTrials < 6.0 + 4.0 * error);
    if (sigma_u == 0.01) CHECK(sum / kTrials > 6.0 - 4.0 * error);
    CHECK(rejected <= 13);  // four of 4000 expected at most; more than 13 once in 10 000 runs
  }
}

TEST_CASE("Components half a turn apart are as far apart as their angle", "[filter]") {
  const Matrix6<double> covariance = 0.04 * Matrix6<double>::Identity();
  Vector6<double> turn = Vector6<double>::Zero();
  turn[2] = std::numbers::pi;
  const PoseComponent a(Pose::identity(), covariance), b(Pose::exp(turn), covariance);
  // Half a rotation vector of pi/2, and two variances of .04.
  CHECK(detail::disagreement_squared(a, b) == Approx(std::pow(std::numbers::pi / 2, 2) / 0.08).epsilon(1e-9));
  Filter filter{Filter::Belief(a)};
  CHECK(filter.update(b).status == UpdateStatus::kNoSupport);
  // Where both are certain about different positions, they do not agree, and nothing throws.
  Matrix6<double> flat = covariance;
  flat.row(3).setZero();
  flat.col(3).setZero();
  const Pose shifted = Pose::from_rotation_translation(Pose::exp(turn).rotation(), Vector3<double>(1, 0, 0));
  Filter certain{Filter::Belief(PoseComponent(Pose::identity(), flat))};
  CHECK(certain.update(PoseComponent(shifted, flat)).status == UpdateStatus::kNoSupport);
}

TEST_CASE("A measurement so far away that the mass underflows is no support", "[filter]") {
  const Filter::Component near(Vector4<double>(1, 0, 0, 0), Vector6<double>::Zero(),
                               0.01 * Matrix6<double>::Identity());
  const Filter::Component far(Vector4<double>(1, 0, 0, 0), Vector6<double>(0, 0, 0, 1e154, 0, 0),
                              0.01 * Matrix6<double>::Identity());
  Filter filter{Filter::Belief(near)};
  const auto step = filter.update(far);
  CHECK(step.status == UpdateStatus::kNoSupport);
  CHECK(step.rejected_weight == 1.0);
  CHECK(filter.belief()[0].density.covariance() == near.covariance());
}

TEST_CASE("The belief keeps to its number of components, and the filter reports the bound of the error",
          "[filter]") {
  Rng rng(4);
  const auto pose = random_pose<double>(rng);
  Filter filter(random_mixture(rng, 6, pose), {.reduction = {.max_components = 4}});
  const auto step = filter.update(random_mixture(rng, 5, pose));
  CHECK(filter.belief().size() == 4);
  CHECK(step.reduction_bound > 0.0);
  CHECK(step.linearization_bound > 0.0);
  CHECK(step.rejected_weight == 0.0);
}
