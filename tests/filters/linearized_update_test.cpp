// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

template <class Scalar>
using AnyModel = std::function<std::optional<Vector3<Scalar>>(const DualQuaternion<Scalar>&, std::size_t)>;

/// linearized_update, compiled once for each scalar.
template <class Scalar>
[[nodiscard]] PoseUpdateResult<Scalar> update(const PoseGaussian<Scalar>& prior,
                                              const std::vector<NoisyMeasurement<Scalar, 3>>& measurements,
                                              const std::type_identity_t<AnyModel<Scalar>>& h,
                                              const LinearizedUpdateOptions<Scalar>& options = {}) {
  return linearized_update(prior, measurements, h, options);
}

[[nodiscard]] AnyModel<double> model_of(const StereoScene<double>& scene) {
  return [&scene](const DualQuaternion<double>& pose, std::size_t i) {
    return scene.camera(pose, scene.landmarks[i]);
  };
}

/// Mean NEES of updates of random scenes with 60 landmarks, of which the first `wrong` are wrong.
[[nodiscard]] double mean_nees(int trials, double rotation_sigma_rad, double translation_sigma_m,
                               std::size_t wrong, const LinearizedUpdateOptions<double>& options) {
  double sum = 0.0;
  for (int seed = 0; seed < trials; ++seed) {
    Rng rng(static_cast<unsigned>(seed));
    const auto prior = prior_at_random_pose(rng, rotation_sigma_rad, translation_sigma_m);
    const auto truth = draw(rng, prior);
    auto scene = StereoScene<double>::random(rng, truth, 60);
    for (std::size_t i = 0; i < wrong; ++i) scene.measurements[i] += 40.0 * random_unit<double, 3>(rng);
    const auto result = update(prior, measurements_of(scene), model_of(scene), options);
    CHECK(result.status == UpdateStatus::kConverged);
    CHECK_FALSE(result.limit_hit);
    sum += nees(result.posterior, truth);
  }
  return sum / trials;
}

/// Three standard deviations of the mean of that many chi^2(6).
[[nodiscard]] double nees_tolerance(int trials) { return 3.0 * std::sqrt(12.0 / trials); }

}  // namespace

TEMPLATE_TEST_CASE("One iteration for a linear model is the Kalman update", "[linearized]", float, double) {
  using Vec3 = Vector3<TestType>;
  constexpr double kRotationScale = 0.1;
  for (unsigned seed = 0; seed < 30; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    Matrix6<double> P = random_covariance<double, 6>(rng, 0.05);
    P.topRows<3>() *= kRotationScale;
    P.leftCols<3>() *= kRotationScale;
    const PoseGaussian<TestType> prior{random_pose<TestType>(rng), P.cast<TestType>()};
    Matrix6<double> H = random_matrix<double, 6>(rng);
    H.leftCols<3>() /= kRotationScale;
    const Vector6<double> z = random_matrix<double, 6, 1>(rng);
    Matrix6<double> R = Matrix6<double>::Zero();
    R.topLeftCorner<3, 3>() = random_covariance<double, 3>(rng, 0.05);
    R.bottomRightCorner<3, 3>() = random_covariance<double, 3>(rng, 0.05);
    const std::vector<NoisyMeasurement<TestType, 3>> measurements{
        {z.head<3>().cast<TestType>(), R.topLeftCorner<3, 3>().cast<TestType>()},
        {z.tail<3>().cast<TestType>(), R.bottomRightCorner<3, 3>().cast<TestType>()}};
    const auto h = [&](const DualQuaternion<TestType>& x, std::size_t i) -> std::optional<Vec3> {
      const Vector6<double> predicted = H * x.boxminus(prior.pose).template cast<double>();
      return Vec3(predicted.segment<3>(3 * static_cast<int>(i)).cast<TestType>());
    };
    const auto result = update<TestType>(prior, measurements, h, {.max_iterations = 1});

    const Matrix6<double> S = H * P * H.transpose() + R;
    const Eigen::LLT<Matrix6<double>> S_factor(S);
    const Matrix6<double> K = S_factor.solve(H * P).transpose();
    const Vector6<double> mean = result.posterior.pose.boxminus(prior.pose).template cast<double>();
    const Matrix6<double> J = se3_right_jacobian_inverse(mean);
    const Matrix6<double> covariance =
        J * result.posterior.covariance.template cast<double>() * J.transpose();
    const double tolerance = 4.5e5 * kEpsilon<TestType>;  // 1e-10 in double
    CHECK(max_difference(mean, K * z) <= tolerance);
    CHECK(max_difference(covariance, P - K * S * K.transpose()) <= tolerance);
    const double log_evidence =
        -0.5 * (z.dot(S_factor.solve(z)) + std::log(S.determinant() / R.determinant()));
    CHECK(std::abs(static_cast<double>(result.log_evidence) - log_evidence) <=
          tolerance * (1.0 + std::abs(log_evidence)));
    CHECK(static_cast<double>(result.residual) <= tolerance);
  }
}

TEST_CASE("The covariance of the linearised update matches its error", "[linearized]") {
  CHECK(std::abs(mean_nees(60, 0.003, 0.05, 0, {}) - 6.0) <= nees_tolerance(60));
  CHECK(std::abs(mean_nees(60, 0.03, 0.5, 0, {}) - 6.0) <= nees_tolerance(60));
}

TEST_CASE("Robust weights ignore a third of wrong measurements", "[linearized]") {
  for (const RobustWeight robust : {RobustWeight::kCauchy, RobustWeight::kHuber}) {
    const double robust_nees = mean_nees(60, 0.002, 0.02, 20, {.max_iterations = 50, .robust = robust});
    const double plain_nees = mean_nees(60, 0.002, 0.02, 20, {.max_iterations = 50});
    CHECK(robust_nees <= 0.05 * plain_nees);
    // Twenty outliers keep a pull of scale^2/d = 0.1 sigma each (Cauchy), or of scale (Huber).
    CHECK(robust_nees <= (robust == RobustWeight::kCauchy ? 8.0 : 80.0));
  }
}

TEST_CASE("A landmark behind the camera is ignored", "[linearized]") {
  Rng rng(3);
  const auto prior = prior_at_random_pose(rng, 0.02, 0.2);
  auto scene = StereoScene<double>::random(rng, draw(rng, prior), 40);
  const auto expected = update(prior, measurements_of(scene), model_of(scene));
  scene.landmarks.push_back(prior.pose * Vector3<double>(0.0, 0.0, -5.0));
  scene.measurements.push_back(Vector3<double>(600.0, 180.0, 10.0));
  const auto result = update(prior, measurements_of(scene), model_of(scene));
  CHECK(max_difference(result.posterior.pose.coeffs(), expected.posterior.pose.coeffs()) == 0.0);
  CHECK(max_difference(result.posterior.covariance, expected.posterior.covariance) == 0.0);
}

TEST_CASE("Measurements that are impossible or not a number leave the prior", "[linearized][error]") {
  Rng rng(4);
  const auto prior = prior_at_random_pose(rng, 0.02, 0.2);
  const auto scene = StereoScene<double>::random(rng, draw(rng, prior), 10);
  const auto measurements = measurements_of(scene);
  const auto is_prior = [&](const PoseUpdateResult<double>& result) {
    return result.posterior.pose.coeffs() == prior.pose.coeffs() &&
           result.posterior.covariance == prior.covariance;
  };
  const auto nothing = update(prior, measurements,
                              [](const auto&, std::size_t) -> std::optional<Vector3<double>> { return {}; });
  CHECK(nothing.status == UpdateStatus::kNoSupport);
  CHECK(is_prior(nothing));
  const auto empty = update(prior, {}, model_of(scene));
  CHECK(empty.status == UpdateStatus::kConverged);
  CHECK(is_prior(empty));
  auto broken = measurements;
  broken[3].z[1] = std::numeric_limits<double>::quiet_NaN();
  CHECK(update(prior, broken, model_of(scene)).status == UpdateStatus::kNotFinite);
  broken = measurements;
  broken[3].R(2, 2) = -1.0;
  const auto indefinite = update(prior, broken, model_of(scene));
  CHECK(indefinite.status == UpdateStatus::kNotFinite);
  CHECK(is_prior(indefinite));
}

TEST_CASE("Invalid options and covariances are refused", "[linearized][error]") {
  Rng rng(5);
  const auto prior = prior_at_random_pose(rng, 0.02, 0.2);
  const auto scene = StereoScene<double>::random(rng, prior.pose, 10);
  const auto message = [&](const PoseGaussian<double>& density,
                           const LinearizedUpdateOptions<double>& options) {
    return error_message([&] { return update(density, measurements_of(scene), model_of(scene), options); });
  };
  CHECK(contains(message(prior, {.max_iterations = 0}), "max_iterations is not positive: 0"));
  CHECK(contains(message(prior, {.robust_scale = 0.0}), "robust_scale is not positive: 0"));
  auto bad = prior;
  bad.covariance(0, 0) = -1.0;
  CHECK(contains(message(bad, {}), "negative eigenvalue"));
  CHECK(contains(message(prior, {.tolerance = std::nan("")}), "tolerance is not positive: nan"));
  // Certain in one direction: it stays certain.
  bad = prior;
  bad.covariance.row(2).setZero();
  bad.covariance.col(2).setZero();
  const auto stays = update(bad, measurements_of(scene), model_of(scene));
  CHECK(stays.status == UpdateStatus::kConverged);
  CHECK(std::abs(stays.posterior.covariance(2, 2)) <= 1e-12);
}
