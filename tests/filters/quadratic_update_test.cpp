// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/models.hpp"
#include "filters/progressive_reference.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// z = H log(origin^-1 x) + v, v ~ N(0, R): linear in the tangent space of the origin.
template <class Scalar>
struct LinearMeasurement {
  DualQuaternion<Scalar> origin;
  Matrix6<double> H, R;
  Vector6<double> z;

  [[nodiscard]] Scalar operator()(const DualQuaternion<Scalar>& x) const {
    const Vector6<double> error = z - H * x.boxminus(origin).template cast<double>();
    const Matrix6<double> root = detail::cholesky_factor(R).value();
    return static_cast<Scalar>(-0.5 * detail::solve_lower(root, error).squaredNorm());
  }

  /// `rows` measurements, each of the order of one where rotations are of the order of rotation_scale; the
  /// others tell nothing.
  [[nodiscard]] static LinearMeasurement random(Rng& rng, const DualQuaternion<Scalar>& origin, int rows,
                                                double rotation_scale) {
    LinearMeasurement m{origin, random_matrix<double, 6>(rng), random_covariance<double, 6>(rng, 0.05),
                        random_matrix<double, 6, 1>(rng)};
    m.H.template leftCols<3>() /= rotation_scale;
    for (int i = rows; i < 6; ++i) {
      m.H.row(i).setZero();
      m.z[i] = 0.0;
      for (int j = 0; j < 6; ++j) m.R(i, j) = m.R(j, i) = i == j ? 1.0 : 0.0;
    }
    return m;
  }
};

/// Kalman's update of N(0, P) on the tangent space.
struct KalmanUpdate {
  Vector6<double> mean;
  Matrix6<double> covariance;
  double log_evidence;

  template <class Scalar>
  KalmanUpdate(const Matrix6<double>& P, const LinearMeasurement<Scalar>& m) {
    const Matrix6<double> HP = m.H * P;
    const Matrix6<double> S = detail::congruence<double, 6, 6>(m.H, P) + m.R;
    const Matrix6<double> root = detail::cholesky_factor(S).value();
    const Matrix6<double> R_root = detail::cholesky_factor(m.R).value();
    const Matrix6<double> gain = detail::solve_lower(root, HP).transpose();  // of the whitened innovation
    const Vector6<double> whitened = detail::solve_lower(root, m.z);
    mean = gain * whitened;
    covariance = P - detail::scaled_square<double, 6, 6>(gain, Vector6<double>::Ones());
    log_evidence = -0.5 * whitened.squaredNorm();
    for (int i = 0; i < 6; ++i) log_evidence -= std::log(root(i, i) / R_root(i, i));
  }
};

/// quadratic_update, compiled once for each scalar.
template <class Scalar>
[[nodiscard]] PoseUpdateResult<Scalar> update(
    const PoseGaussian<Scalar>& prior, const std::type_identity_t<AnyLogLikelihood<Scalar>>& log_likelihood,
    const std::type_identity_t<QuadraticUpdateOptions<Scalar>>& options = {}) {
  return quadratic_update(prior, log_likelihood, options);
}

/// The largest difference of two covariances, relative to the standard deviations of the second.
[[nodiscard]] double relative_difference(const Matrix6<double>& a, const Matrix6<double>& b) {
  double largest = 0.0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      largest = std::max(largest, std::abs(a(i, j) - b(i, j)) / std::sqrt(b(i, i) * b(j, j)));
    }
  }
  return largest;
}
/// The largest entry of a vector, relative to the standard deviations of a covariance.
[[nodiscard]] double in_sigmas(const Vector6<double>& a, const Matrix6<double>& covariance) {
  double largest = 0.0;
  for (int i = 0; i < 6; ++i) largest = std::max(largest, std::abs(a[i]) / std::sqrt(covariance(i, i)));
  return largest;
}

}  // namespace

TEMPLATE_TEST_CASE("One step for a linear measurement is the Kalman update", "[quadratic]", float, double) {
  constexpr double kRotationScale = 0.1;
  for (unsigned seed = 0; seed < 30; ++seed) {
    const int rows = 1 + static_cast<int>(seed) % 6;
    CAPTURE(seed, rows);
    Rng rng(seed);
    Matrix6<double> P = random_covariance<double, 6>(rng, 0.05);
    P.topRows<3>() *= kRotationScale;
    P.leftCols<3>() *= kRotationScale;
    const PoseGaussian<TestType> prior{random_pose<TestType>(rng), P.cast<TestType>()};
    const auto measurement = LinearMeasurement<TestType>::random(rng, prior.pose, rows, kRotationScale);
    const KalmanUpdate kalman(P, measurement);
    const auto result = update(prior, measurement, {});
    CHECK(result.status == UpdateStatus::kConverged);
    CHECK(result.steps == 1);

    // The posterior's covariance is in the tangent space of its own mean.
    const Vector6<double> mean = result.posterior.pose.boxminus(prior.pose).template cast<double>();
    const Matrix6<double> J = se3_right_jacobian_inverse(mean);
    const Matrix6<double> covariance =
        detail::congruence<double, 6, 6>(J, result.posterior.covariance.template cast<double>());
    const double tolerance = 4.5e5 * kEpsilon<TestType>;  // 1e-10 in double
    CHECK(in_sigmas(mean - kalman.mean, kalman.covariance) <= tolerance);
    CHECK(relative_difference(covariance, kalman.covariance) <= tolerance);
    CHECK(std::abs(static_cast<double>(result.log_evidence) - kalman.log_evidence) <= tolerance);
    CHECK(static_cast<double>(result.residual) <= tolerance);
  }
}

TEST_CASE("A few fits reach the true posterior", "[quadratic][reference]") {
  for (const auto& c : progressive_cases()) {
    if (c.prior.orientation().second_moments()[2] > 0.04 && c.name.starts_with("exact"))
      continue;  // not Gaussian
    CAPTURE(c.name);
    const auto result = update(to_pose_gaussian(c.prior), c.log_likelihood);
    const Score score = c.score(to_bingham_gaussian(result.posterior));
    CHECK(result.status == UpdateStatus::kConverged);
    CHECK_FALSE(result.limit_hit);
    CHECK(result.steps <= (c.weak_prior ? 8 : 4));
    CHECK(score.rotation_error <= 0.1);
    CHECK(score.translation_error <= 0.15);
    const double tolerance = c.weak_prior ? 0.06 : 0.02;
    CHECK(std::abs(score.rotation_variance_ratio - 1.0) <= tolerance);
    CHECK(std::abs(score.translation_variance_ratio - 1.0) <= tolerance);
    CHECK(std::abs(result.log_evidence - c.truth.log_evidence) <= (c.weak_prior ? 0.2 : 0.02));
  }
}

TEST_CASE("The covariance matches the error", "[quadratic]") {
  constexpr int kTrials = 60;
  double sum = 0.0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    Rng rng(seed);
    const auto prior = prior_at_random_pose(rng, 0.03, 0.5);
    const auto truth = draw(rng, prior);
    const auto scene = StereoScene<double>::random(rng, truth, 30);
    const auto result = update(prior, scene);
    CHECK(result.status == UpdateStatus::kConverged);
    sum += nees(result.posterior, truth);
  }
  // chi^2(6 n)/n has the mean 6 and the standard deviation sqrt(12/n).
  CHECK(std::abs(sum / kTrials - 6.0) <= 3.0 * std::sqrt(12.0 / kTrials));
}

TEST_CASE("A capped likelihood ignores a third of wrong measurements", "[quadratic]") {
  constexpr int kTrials = 60;
  double sum = 0.0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    Rng rng(seed);
    const auto prior = prior_at_random_pose(rng, 0.002, 0.02);
    const auto truth = draw(rng, prior);
    auto scene = StereoScene<double>::random(rng, truth, 60);
    for (std::size_t i = 0; i < 20; ++i) scene.measurements[i] += 40.0 * random_unit<double, 3>(rng);
    scene.cap = 0.5 * 16.27;  // the 0.999 quantile of chi^2(3)
    sum += nees(update(prior, scene).posterior, truth);
  }
  CHECK(std::abs(sum / kTrials - 6.0) <= 3.0 * std::sqrt(12.0 / kTrials));
}

TEST_CASE("With a cap tighter than the prior's spread most runs stay consistent", "[quadratic]") {
  // Most of the prior sees most measurements capped.
  constexpr int kTrials = 40;
  double sum = 0.0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto prior = prior_at_random_pose(rng, 0.005, 0.05);
    const auto truth = draw(rng, prior);
    auto scene = StereoScene<double>::random(rng, truth, 60);
    scene.cap = 0.5 * 16.27;
    sum += nees(update(prior, scene).posterior, truth);
  }
  CHECK(sum / kTrials <= 12.0);
}

TEST_CASE("The update converges with landmarks behind some samples of a wide prior", "[quadratic]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto prior = prior_at_random_pose(rng, 0.44, 2.0);  // 25 degrees
    auto scene = StereoScene<double>::random(rng, draw(rng, prior), 20);
    scene.behind = -std::numeric_limits<double>::infinity();
    const auto impossible = update(prior, scene);
    // There may be no sample that sees all.
    CHECK(impossible.status != UpdateStatus::kNotFinite);
    CHECK(impossible.posterior.covariance.allFinite());
    // Unlikely instead of impossible: no quadratic describes these cliffs, and models of them may lead away
    // beyond all measure.
    scene.behind = -100.0;
    const auto unlikely = update(prior, scene);
    CHECK(unlikely.status != UpdateStatus::kNoSupport);
    CHECK(unlikely.posterior.covariance.allFinite());
    CHECK(unlikely.steps <= 100);
  }
}

TEMPLATE_TEST_CASE("A constant log-likelihood changes nothing", "[quadratic][law]", float, double) {
  Rng rng(2);
  const PoseGaussian<TestType> prior{random_pose<TestType>(rng), pose_covariance<TestType>(0.1, 1.0)};
  const auto result = update(prior, [](const DualQuaternion<TestType>&) { return TestType(-7); });
  CHECK(result.status == UpdateStatus::kConverged);
  CHECK(max_difference(result.posterior.covariance, prior.covariance) <= 10 * kEpsilon<TestType>);
  CHECK(result.posterior.pose.is_approx(prior.pose, TestType(10 * kEpsilon<TestType>)));
  CHECK(static_cast<double>(result.log_evidence) == Approx(-7.0).epsilon(10 * kEpsilon<TestType>));
}

TEMPLATE_TEST_CASE("Exchanging q and -q of the prior changes nothing", "[quadratic][law]", float, double) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const PoseGaussian<TestType> prior{random_pose<TestType>(rng), pose_covariance<TestType>(0.02, 0.2)};
    const auto scene = StereoScene<TestType>::random(rng, draw(rng, prior), 30);
    const auto a = update(prior, scene);
    const auto b = update(PoseGaussian<TestType>{antipode_of(prior.pose), prior.covariance}, scene);
    CHECK(a.steps == b.steps);
    CHECK(max_difference(a.posterior.covariance, b.posterior.covariance) == 0.0);
    CHECK(max_difference(a.posterior.pose.coeffs(), -b.posterior.pose.coeffs()) == 0.0);
  }
}

TEST_CASE("Moving the world moves the quadratic posterior", "[quadratic][law]") {
  Rng rng(3);
  const auto prior = prior_at_random_pose(rng, 0.02, 0.2);
  const auto scene = StereoScene<double>::random(rng, draw(rng, prior), 30);
  const auto y = random_pose<double>(rng, 100.0);
  const auto moved = [&](const DualQuaternion<double>& x) { return scene(y.inverse() * x); };
  const auto a = update(prior, scene);
  const auto b = update(PoseGaussian<double>{y * prior.pose, prior.covariance}, moved);
  // Translations of 100 m leave 1e-14 m, projected at 700 pixels a radian: 1e-9 of a sigma.
  CHECK(in_sigmas(b.posterior.pose.boxminus(y * a.posterior.pose), a.posterior.covariance) <= 1e-7);
  CHECK(relative_difference(b.posterior.covariance, a.posterior.covariance) <= 1e-7);
}

TEST_CASE("Directions the prior is certain of stay fixed", "[quadratic]") {
  Rng rng(4);
  Matrix6<double> planar = Matrix6<double>::Zero();  // turns about y, moves in x and z
  planar(1, 1) = 4e-4;
  planar(3, 3) = planar(5, 5) = 0.04;
  const PoseGaussian<double> prior{random_pose<double>(rng), planar};
  const auto truth = prior.pose.boxplus(Vector6<double>(0.0, 0.02, 0.0, 0.1, 0.0, -0.2));
  const auto scene = StereoScene<double>::random(rng, truth, 30);
  const auto result = update(prior, scene);
  CHECK(result.status == UpdateStatus::kConverged);
  const Vector6<double> error = truth.boxminus(result.posterior.pose);
  CHECK(std::abs(error[1]) <= 0.002);
  CHECK(error.tail<3>().norm() <= 0.05);
  CHECK(result.posterior.covariance.diagonal()[0] <= 1e-6);
}

TEST_CASE("Invalid values of the likelihood are reported in the status", "[quadratic]") {
  Rng rng(5);
  const auto prior = prior_at_random_pose(rng, 0.02, 0.2);
  const auto scene = StereoScene<double>::random(rng, draw(rng, prior), 30);
  const auto check = [&](const auto& likelihood, UpdateStatus status) {
    const auto result = update(prior, likelihood);
    CHECK(result.status == status);
    CHECK(max_difference(result.posterior.pose.coeffs(), prior.pose.coeffs()) == 0.0);
    CHECK(max_difference(result.posterior.covariance, prior.covariance) == 0.0);
  };
  constexpr double infinity = std::numeric_limits<double>::infinity();
  using Pose = DualQuaternion<double>;
  check([](const Pose&) { return std::nan(""); }, UpdateStatus::kNotFinite);
  check([](const Pose&) { return infinity; }, UpdateStatus::kNotFinite);
  check([](const Pose&) { return -infinity; }, UpdateStatus::kNoSupport);
  check([](const Pose& x) { return -1e300 * x.translation().squaredNorm(); }, UpdateStatus::kNotFinite);
  int calls = 0;
  check([&](const Pose& x) { return ++calls > 100 ? std::nan("") : scene(x); }, UpdateStatus::kNotFinite);
  CHECK(update(prior, scene, {.min_log_likelihood = 1.0}).status == UpdateStatus::kDiverged);
}

TEST_CASE("The steps of the surrogate are bounded", "[quadratic]") {
  Rng rng(6);
  const auto prior = prior_at_random_pose(rng, 0.4, 2.0);
  const auto scene = StereoScene<double>::random(rng, draw(rng, prior), 20);
  const auto result = update(prior, scene, {.max_steps = 2});
  CHECK(result.steps <= 2);
  CHECK(result.limit_hit);
}

TEST_CASE("A likelihood that is flat at the posterior does not restore the prior", "[quadratic]") {
  const PoseGaussian<double> prior{{}, 0.01 * Matrix6<double>::Identity()};
  for (double steepness : {1e4, 1e6}) {
    CAPTURE(steepness);
    const auto result = update(prior, [=](const DualQuaternion<double>& x) {
      const double short_of_wall = std::min(0.0, x.translation()[0] - 0.05);
      return -steepness * short_of_wall * short_of_wall;
    });
    CHECK((result.status != UpdateStatus::kConverged || result.posterior.pose.translation()[0] > 0.05));
  }
}

TEST_CASE("A log-likelihood that curves upwards is not fitted, and the residual reports it", "[quadratic]") {
  const PoseGaussian<double> prior{{}, 0.01 * Matrix6<double>::Identity()};
  const auto result =
      update(prior, [](const DualQuaternion<double>& x) { return 40.0 * x.translation().squaredNorm(); });
  CHECK(result.residual > 0.5);
}

TEST_CASE("Invalid priors and options of the surrogate are refused with the value", "[quadratic]") {
  Rng rng(7);
  const auto prior = prior_at_random_pose(rng, 0.02, 0.2);
  const auto message = [&](const PoseGaussian<double>& density,
                           const QuadraticUpdateOptions<double>& options) {
    return error_message([&] {
      return update(
                 density, [](const DualQuaternion<double>&) { return 0.0; }, options)
          .steps;
    });
  };
  CHECK(contains(message(prior, {.max_residual = 0.0}), "max_residual is not positive: 0"));
  CHECK(contains(message(prior, {.max_steps = 0}), "max_steps is not positive: 0"));
  CHECK(contains(message(prior, {.tolerance = 0.0}), "tolerance is not positive: 0"));
  CHECK(contains(message(prior, {.min_log_likelihood = std::nan("")}), "min_log_likelihood is not a number"));
  PoseGaussian<double> broken = prior;
  broken.covariance(2, 2) = -1.0;
  CHECK(contains(message(broken, {}), "pose covariance has a negative eigenvalue"));
  broken.covariance(2, 2) = std::nan("");
  CHECK(contains(message(broken, {}), "pose covariance is not finite or not symmetric"));
}

TEST_CASE("A prior whose samples overflow is returned, and the status says so", "[quadratic][status]") {
  Rng rng(8);
  PoseGaussian<double> prior = prior_at_random_pose(rng, 0.02, 0.2);
  prior.covariance(2, 2) = 1e308;
  const auto result = update(prior, [](const DualQuaternion<double>&) { return 0.0; }, {});
  CHECK(result.status == UpdateStatus::kNotFinite);
  CHECK(result.posterior.covariance == prior.covariance);
}

TEST_CASE("Conversion of a concentrated pose density and back is exact", "[quadratic]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const double scale = std::pow(10.0, uniform<double>(rng, -12.0, -4.0));
    const PoseGaussian<double> density{random_pose<double>(rng), scale * random_covariance<double, 6>(rng)};
    const auto back = to_pose_gaussian(to_bingham_gaussian(density));
    CHECK(back.pose.is_approx(density.pose, 1e-12));
    // Rotation moments of 2.5e-15 are raised to 1e-14.
    CHECK((back.covariance - density.covariance).norm() <= 1e-9 * density.covariance.norm() + 8e-14);
  }
}

TEMPLATE_TEST_CASE("An outlier so far away that rounding hides the slope is not called converged",
                   "[quadratic][error]", float, double) {
  using Scalar = TestType;
  const SplitPoseGaussian<Scalar> prior{{}, pose_covariance<Scalar>(0.1, 1.0)};
  const Scalar rounding = std::numeric_limits<Scalar>::epsilon();
  for (const Scalar distance : {Scalar(1) / rounding, Scalar(1000) / rounding}) {
    CAPTURE(distance);
    const auto result = quadratic_update(prior, [=](const DualQuaternion<Scalar>& x) {
      const Scalar error = (x.translation()[0] - distance) / Scalar(0.1);
      return Scalar(-0.5) * error * error;
    });
    CHECK(result.status == UpdateStatus::kNotFinite);
    CHECK(result.posterior.covariance == prior.covariance);
  }
}
