// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <optional>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/filters/unscented_update.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Landmark = Gaussian<double, 3>;
using PoseModel = AnyPairModel<double>;

}  // namespace

TEMPLATE_TEST_CASE("A linear model gives the Kalman update, however often iterated", "[unscented][law]",
                   float, double) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    using Vec = Vector3<TestType>;
    using Mat = Matrix3<TestType>;
    const Gaussian<TestType, 3> prior(random_matrix<TestType, 3, 1>(rng),
                                      random_covariance<TestType, 3>(rng, 0.05));
    const Mat H = random_matrix<TestType, 3>(rng);
    const Mat R = random_covariance<TestType, 3>(rng, 0.05);
    const Vec z = random_matrix<TestType, 3, 1>(rng);
    const auto pose = random_pose<TestType>(rng);
    const AnyPairModel<TestType> h = [&](const DualQuaternion<TestType>& x, const Vec& l) -> Vec {
      return H * (x * l);
    };
    // With S = C C^T and W = C^-1 H P the gain is W^T C^-1, and the covariance shrinks by W^T W.
    const Mat H_l = H * pose.rotation_matrix();
    const Mat C =
        detail::cholesky_factor<TestType, 3>(detail::congruence<TestType, 3, 3>(H_l, prior.covariance()) + R)
            .value();
    const Mat C_inverse = detail::solve_lower<TestType, 3, 3>(C, Mat::Identity());
    const Mat W_transposed = detail::solve_lower<TestType, 3, 3>(C, H_l * prior.covariance()).transpose();
    const Mat K = W_transposed * C_inverse;
    const Vec mean = prior.mean() + K * (z - *h(pose, prior.mean()));
    const Mat covariance =
        prior.covariance() - detail::scaled_square<TestType, 3, 3>(W_transposed, Vec::Ones());
    for (int iterations : {1, 3}) {
      CAPTURE(seed, iterations);
      const auto result = unscented_update(prior, pose, h, {z, R}, {.iterations = iterations});
      const double tolerance = 1e4 * kEpsilon<TestType>;  // condition number of S, up to 1e3
      CHECK(max_difference(result.posterior.mean(), mean) <= tolerance);
      CHECK(max_difference(result.posterior.covariance(), covariance) <= tolerance);
      CHECK(max_difference(result.gain, K) <= tolerance);
    }
  }
}

TEST_CASE("A singular prior moves only where it is uncertain", "[unscented]") {
  const StereoModel<double> camera;
  const Pose pose;
  const Vector3<double> direction = Vector3<double>(1.0, 1.0, 10.0).normalized();
  Matrix3<double> along_the_ray = Matrix3<double>::Zero();
  detail::add_outer_product(0.5, direction, direction, along_the_ray);
  const Landmark prior(20.0 * direction, along_the_ray);
  const Vector3<double> z = *camera(pose, 20.7 * direction);
  const auto result =
      unscented_update(prior, pose, PoseModel(camera), {z, 0.25 * Matrix3<double>::Identity()});
  CHECK(result.status == UnscentedUpdateStatus::kUpdated);
  const Vector3<double> moved = result.posterior.mean() - prior.mean();
  CHECK(moved.cross(direction).norm() <= 1e-12);
  CHECK(moved.dot(direction) == Approx(0.7).margin(0.3));
  CHECK(detail::symmetric_eigen(result.posterior.covariance()).values[1] <= 1e-14);
}

TEST_CASE("The posterior covariance is positive definite and below the prior", "[unscented][law]") {
  const StereoModel<double> camera;
  for (unsigned seed = 0; seed < 200; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Pose pose = random_pose<double>(rng);
    const Vector3<double> z(uniform<double>(rng, 0.0, 1241.0), uniform<double>(rng, 0.0, 376.0),
                            uniform<double>(rng, 8.0, 100.0));
    const Vector3<double> l = camera.back_project(pose, z);
    const double depth = camera.fx * camera.baseline / z[2];
    const double scale = std::pow(10.0, uniform<double>(rng, -8.0, -2.0));
    const Landmark prior(l, scale * depth * depth * random_covariance<double, 3>(rng, 1e-6));
    const Matrix3<double> R =
        std::pow(10.0, uniform<double>(rng, -6.0, 1.0)) * random_covariance<double, 3>(rng);
    const auto result = unscented_update(prior, pose, PoseModel(camera), {z, R});
    REQUIRE(result.status == UnscentedUpdateStatus::kUpdated);
    const Matrix3<double> P = result.posterior.covariance();
    CHECK(max_difference(P, P.transpose()) == 0.0);
    const Matrix3<double> whitening =
        detail::solve_lower<double, 3, 3>(prior.sqrt_factor(), Matrix3<double>::Identity());
    const auto relative = detail::symmetric_eigen(detail::congruence<double, 3, 3>(whitening, P));
    CHECK(relative.values[0] > 0.0);
    CHECK(relative.values[2] <= 1.0 + 1e-9);
  }
}

TEST_CASE("q and -q of the pose, and one sample in place of a known pose, measure the same",
          "[unscented][law]") {
  const PoseModel h = StereoModel<double>{};
  const Pose pose;
  const Landmark prior({2.0, 1.0, 15.0}, 0.2 * Matrix3<double>::Identity());
  const Vector3<double> z = *h(pose, Vector3<double>(2.1, 0.9, 14.5));
  const Matrix3<double> R = Matrix3<double>::Identity();
  const auto expected = unscented_update(prior, pose, h, {z, R});
  const auto antipodal = unscented_update(prior, antipode_of(pose), h, {z, R});
  CHECK(max_difference(antipodal.posterior.mean(), expected.posterior.mean()) == 0.0);
  CHECK(max_difference(antipodal.posterior.covariance(), expected.posterior.covariance()) == 0.0);
  // All samples but the first have no weight, and see nothing.
  const Pose turned = Pose::exp(Vector6<double>(3.1, 0.0, 0.0, 0.0, 0.0, 0.0));
  WeightedSamples<double, 8, PaperPoseRule::kCount> samples;
  for (int k = 0; k < samples.size(); ++k) {
    samples.points.col(k) = k == 0 ? pose.coeffs() : turned.coeffs();
    samples.weights[k] = k == 0 ? 1.0 : 0.0;
  }
  const auto sampled = unscented_update(prior, samples, h, {z, R});
  CHECK(max_difference(sampled.posterior.mean(), expected.posterior.mean()) <= 1e-13);
  CHECK(max_difference(sampled.posterior.covariance(), expected.posterior.covariance()) <= 1e-13);
}

TEST_CASE("An uncertain pose reduces a landmark's gain", "[unscented]") {
  const PoseModel h = StereoModel<double>{};
  const Landmark prior({2.0, 1.0, 15.0}, 0.2 * Matrix3<double>::Identity());
  const Vector3<double> z = *h(Pose{}, Vector3<double>(2.1, 0.9, 14.5));
  const Matrix3<double> R = Matrix3<double>::Identity();
  const auto density = to_bingham_gaussian(PoseGaussian<double>{{}, pose_covariance<double>(0.01, 0.1)});
  const auto known = unscented_update(prior, Pose{}, h, {z, R});
  const auto uncertain = unscented_update(prior, sample(PaperPoseRule{}, density), h, {z, R});
  CHECK(uncertain.posterior.covariance().trace() > known.posterior.covariance().trace());
  CHECK(uncertain.nis < known.nis);
}

TEST_CASE("A landmark that cannot be measured is reported and stays unchanged", "[unscented]") {
  const Matrix3<double> R = Matrix3<double>::Identity();
  const Landmark behind({0.0, 0.0, -5.0}, 0.01 * Matrix3<double>::Identity());
  const Landmark half_behind({0.0, 0.0, 1.0}, Matrix3<double>::Identity());
  const PoseModel camera = StereoModel<double>{};
  const PoseModel nowhere = [](const Pose&, const Vector3<double>&) -> std::optional<Vector3<double>> {
    return Vector3<double>::Constant(std::numeric_limits<double>::quiet_NaN());
  };
  for (const auto& [prior, h] : {std::pair{behind, camera}, {half_behind, camera}, {behind, nowhere}}) {
    CHECK_FALSE(project_gaussian(prior, Pose{}, h).has_value());
    const auto result = unscented_update(prior, Pose{}, h, {Vector3<double>(600.0, 200.0, 10.0), R});
    CHECK(result.status == UnscentedUpdateStatus::kNotObservable);
    CHECK(result.iterations == 0);
    CHECK(max_difference(result.posterior.mean(), prior.mean()) == 0.0);
    CHECK(max_difference(result.posterior.covariance(), prior.covariance()) == 0.0);
  }
}

TEST_CASE("What is no number or too large to compute with is not an update", "[unscented]") {
  const Landmark prior(Vector3<double>(1, 2, 3), Matrix3<double>::Identity());
  const PoseModel identity = [](const Pose&, const Vector3<double>& x) { return std::optional(x); };
  const PoseModel nan = [](const Pose&, const Vector3<double>&) {
    return std::optional<Vector3<double>>(Vector3<double>::Constant(std::nan("")));
  };
  const PoseModel jump = [](const Pose&, const Vector3<double>& x) {
    return std::optional<Vector3<double>>((x[0] > 1.0 ? 1e300 : 1.0) * x);
  };
  for (const double far : {1e155, 1e200, 1e308}) {
    for (const PoseModel& h : {identity, nan, jump}) {
      const auto result = unscented_update(prior, Pose::identity(), h,
                                           {Vector3<double>(far, -far, far), Matrix3<double>::Identity()});
      CHECK(result.status == UnscentedUpdateStatus::kNotObservable);
      CHECK(result.posterior.mean() == prior.mean());
      CHECK(result.nis == 0.0);
    }
  }
}

TEST_CASE("Where rounding leaves the posterior without a root it is a covariance nevertheless",
          "[unscented]") {
  Rng rng(7);
  const PoseModel identity = [](const Pose&, const Vector3<double>& x) { return std::optional(x); };
  for (int trial = 0; trial < 200; ++trial) {
    Matrix3<double> root = random_matrix<double, 3, 3>(rng, 1.0);
    for (auto row : root.rowwise()) row *= std::pow(10.0, uniform<double>(rng, -10.0, 15.0));
    const Landmark prior(Vector3<double>::Zero(), root * root.transpose());
    for (const double variance : {1e-20, 1e-10, 1.0}) {
      const auto result =
          unscented_update(prior, Pose::identity(), identity,
                           {Vector3<double>(1, 2, 3), variance * Matrix3<double>::Identity()});
      CHECK(result.status == UnscentedUpdateStatus::kUpdated);
      CHECK((result.posterior.covariance().diagonal().array() >= 0.0).all());
    }
  }
}

TEST_CASE("A residual far above the noise leaves a covariance, or is not used", "[unscented]") {
  Rng rng(11);
  const Landmark prior(Vector3<double>::Zero(), Matrix3<double>::Identity());
  for (int trial = 0; trial < 2000; ++trial) {
    const double curvature = std::pow(10.0, uniform<double>(rng, 0.0, 16.0));
    const double noise = std::pow(10.0, uniform<double>(rng, -20.0, 0.0));
    const PoseModel h = [&](const Pose&, const Vector3<double>& x) {
      const double square = curvature * x[0] * x[0];
      return std::optional<Vector3<double>>({square, square + x[0], square + x[1]});
    };
    const auto result = unscented_update(prior, Pose::identity(), h,
                                         {Vector3<double>(1, 2, 3), noise * Matrix3<double>::Identity()});
    CHECK((result.posterior.covariance().diagonal().array() >= 0.0).all());
  }
}

TEST_CASE("An iteration that leaves the view keeps the one before", "[unscented]") {
  const PoseModel h = [](const Pose&, const Vector3<double>& l) -> std::optional<Vector3<double>> {
    if (l[2] > 12.0) return std::nullopt;
    return l;
  };
  const Landmark prior({0.0, 0.0, 10.0}, Matrix3<double>::Identity());
  const Vector3<double> z(0.0, 0.0, 13.0);
  const Matrix3<double> R = 0.1 * Matrix3<double>::Identity();
  const auto once = unscented_update(prior, Pose{}, h, {z, R}, {.iterations = 1});
  const auto result = unscented_update(prior, Pose{}, h, {z, R}, {.iterations = 5});
  CHECK(result.status == UnscentedUpdateStatus::kUpdated);
  CHECK(result.iterations == 1);
  CHECK(max_difference(result.posterior.mean(), once.posterior.mean()) == 0.0);
}

TEST_CASE("Invalid measurements, noise and options are refused with the value", "[unscented]") {
  const Landmark prior({2.0, 1.0, 15.0}, Matrix3<double>::Identity());
  const PoseModel h = StereoModel<double>{};
  const auto message = [&](const Vector3<double>& z, const Matrix3<double>& R,
                           const UnscentedUpdateOptions& options) {
    return error_message([&] { return unscented_update(prior, Pose{}, h, {z, R}, options).nis; });
  };
  const Vector3<double> z(600.0, 200.0, 25.0);
  const Matrix3<double> R = Matrix3<double>::Identity();
  CHECK(contains(message({600.0, std::nan(""), 25.0}, R, {}), "measurement is not finite: [600; nan; 25]"));
  CHECK(contains(message(z, -R, {}), "measurement noise is not positive definite: [-1"));
  CHECK(contains(message(z, Matrix3<double>::Zero(), {}), "measurement noise is not positive definite: [0"));
  Matrix3<double> skewed = R;
  skewed(0, 1) = 0.5;
  CHECK(contains(message(z, skewed, {}), "measurement noise is not finite or not symmetric"));
  CHECK(contains(message(z, R, {.iterations = 0}), "iterations is not positive: 0"));
  CHECK(contains(message(z, R, {.kappa = -1.0}), "kappa of the unscented rule is not in [0, inf): -1"));
}
