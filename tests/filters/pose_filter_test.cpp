// SPDX-License-Identifier: MIT
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/pose_filter.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using LandmarkModel = std::function<std::optional<Vector3<double>>(const Pose&, std::size_t)>;
using LandmarkMeasurements = GaussianMeasurements<double, 3, LandmarkModel>;

[[nodiscard]] LandmarkMeasurements measure(Rng& rng, const Pose& truth, int count) {
  const auto scene = StereoScene<double>::random(rng, truth, count);
  std::vector<NoisyMeasurement<double, 3>> measurements;
  for (const auto& z : scene.measurements) {
    measurements.push_back({z, Matrix3<double>(scene.sigma.cwiseAbs2().asDiagonal())});
  }
  return {measurements, [camera = scene.camera, landmarks = scene.landmarks](const Pose& x, std::size_t i) {
            return camera(x, landmarks[i]);
          }};
}

constexpr int kSteps = 20;

/// The mean NEES over drives of kSteps steps, with odometry of the given standard deviation.
template <class Filter>
[[nodiscard]] double mean_nees_of_drives(unsigned drives, int landmarks, double sigma_rad) {
  double sum = 0.0;
  for (unsigned seed = 0; seed < drives; ++seed) {
    Rng rng(seed);
    const PoseGaussian<double> start{random_pose<double>(rng), pose_covariance<double>(0.02, 0.2)};
    const PoseGaussian<double> noise{Pose::identity(), pose_covariance<double>(sigma_rad, 10.0 * sigma_rad)};
    Vector6<double> ahead;
    ahead << 0, 0.05, 0, 0, 0, 1;
    Pose truth = draw(rng, start);
    Filter filter(start);
    for (int k = 0; k < kSteps; ++k) {
      truth = draw(rng, PoseGaussian<double>{truth * Pose::exp(ahead), noise.covariance});
      filter.predict(Pose::exp(ahead), noise);
      const auto result = filter.update(measure(rng, truth, landmarks));
      CHECK(result.status == UpdateStatus::kConverged);
      sum += nees(filter.belief(), truth);
    }
  }
  return sum / (drives * kSteps);
}

}  // namespace

TEST_CASE("All filters have the same interface, and consistent covariances (NEES)", "[filter]") {
  // Three standard deviations; steps of a drive are nearly independent, since its updates are much sharper
  // than its predictions.
  const auto tolerance = [](unsigned drives) { return 3.0 * std::sqrt(12.0 / (drives * kSteps)); };
  CHECK(std::abs(mean_nees_of_drives<QuadraticPoseFilter<double>>(10, 20, 0.005) - 6.0) <= tolerance(10));
  CHECK(std::abs(mean_nees_of_drives<LinearizedPoseFilter<double>>(10, 20, 0.005) - 6.0) <= tolerance(10));
  // Reweighting takes finite steps: a few per cent too confident.
  CHECK(std::abs(mean_nees_of_drives<RichPoseFilter<double>>(2, 20, 0.005) - 6.0) <= 1.5 * tolerance(2));
}

/// README's example: the state is T_world_camera, `frames` of 20 landmarks, any filter.
template <class Filter>
[[nodiscard]] PoseGaussian<double> follow_moving_camera(Pose& T_world_camera) {
  Rng rng(7);
  const PoseGaussian<double> start{T_world_camera, pose_covariance<double>(0.01, 0.1)};
  const Matrix6<double> Q = pose_covariance<double>(0.005, 0.05);
  Vector6<double> step;
  step << 0, 0.05, 0, 0, 0, 1;
  T_world_camera = draw(rng, start);
  Filter filter(start);
  for (int k = 0; k < 5; ++k) {
    const Pose T_before_now = Pose::exp(step);
    T_world_camera = draw(rng, PoseGaussian<double>{T_world_camera * T_before_now, Q});
    const auto scene = StereoScene<double>::random(rng, T_world_camera, 20);
    filter.predict(T_before_now, {Pose::identity(), Q});
    const AnyLogLikelihood<double> log_likelihood = [&](const Pose& x) {
      double sum = 0.0;
      for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
        const auto z = scene.camera(x, scene.landmarks[i]);
        sum -= z ? 0.5 * (scene.measurements[i] - *z).cwiseQuotient(scene.sigma).squaredNorm() : 1e4;
      }
      return sum;
    };
    const PoseUpdateResult<double> result = filter.update(log_likelihood);
    CHECK(result.status == UpdateStatus::kConverged);
    CHECK(result.steps > 0);
    CHECK(result.evaluations > 0);
    CHECK(std::isfinite(result.log_evidence));
    CHECK(result.log_likelihood > -100.0);
    CHECK(result.posterior.pose.coeffs() == filter.belief().pose.coeffs());
    CHECK(result.posterior.covariance == filter.belief().covariance);
  }
  return filter.belief();
}

TEMPLATE_TEST_CASE("Every filter of log-likelihoods runs the README's example", "[filter]",
                   QuadraticPoseFilter<double>, RichPoseFilter<double>, PaperPoseFilter<double>) {
  Pose T_world_camera;
  const PoseGaussian<double> belief = follow_moving_camera<TestType>(T_world_camera);
  // The measurements fix the position to 2 cm; 10 cm are beyond the paper's overconfidence, too.
  CHECK((belief.pose.translation() - T_world_camera.translation()).norm() < 0.1);
  CHECK(belief.covariance.diagonal().tail<3>().maxCoeff() < 0.05 * 0.05);
}

TEMPLATE_TEST_CASE("Every filter starts from any pose density and reports the same belief", "[filter]",
                   QuadraticPoseFilter<double>, LinearizedPoseFilter<double>, RichPoseFilter<double>,
                   PaperPoseFilter<double>) {
  Rng rng(5);
  const auto pose = random_pose<double>(rng);
  const Matrix6<double> P = pose_covariance<double>(0.01, 0.1);
  const TestType from_parts({pose, P});
  const TestType from_gaussian(PoseGaussian<double>{pose, P});
  const TestType from_bingham(to_bingham_gaussian(PoseGaussian<double>{pose, P}));
  for (const TestType* filter : {&from_parts, &from_gaussian, &from_bingham}) {
    // Conversion to a Bingham density and back is exact to the square of the rotation's variance.
    CHECK(filter->belief().pose.is_approx(pose, 1e-12));
    CHECK(filter->belief().covariance.isApprox(P, 1e-3));
  }
  CHECK_THROWS_AS(TestType({pose, -P}), std::invalid_argument);
}

TEST_CASE("A filter that linearises the measurement does not accept a log-likelihood", "[filter]") {
  using L = AnyLogLikelihood<double>;
  STATIC_REQUIRE(QuadraticPoseFilter<double>::kTakes<L>);
  STATIC_REQUIRE(PaperPoseFilter<double>::kTakes<L>);
  STATIC_REQUIRE(LinearizedPoseFilter<double>::kTakes<LandmarkMeasurements>);
  STATIC_REQUIRE_FALSE(LinearizedPoseFilter<double>::kTakes<L>);
  STATIC_REQUIRE_FALSE(PaperPoseFilter<double>::kTakes<int>);
}

TEST_CASE("The paper's filter is overconfident", "[filter]") {
  CHECK(mean_nees_of_drives<PaperPoseFilter<double>>(1, 30, 0.035) > 12.0);
}

TEST_CASE("A failed update leaves the belief unchanged", "[filter]") {
  const PoseGaussian<double> start{Pose::identity(), pose_covariance<double>(0.02, 0.2)};
  QuadraticPoseFilter<double> filter(start);
  CHECK(filter.update([](const Pose&) { return std::nan(""); }).status == UpdateStatus::kNotFinite);
  CHECK(filter.belief().covariance == start.covariance);
  CHECK(filter.belief().pose.coeffs() == start.pose.coeffs());
}

TEST_CASE("A density that collapsed under too long steps is not accepted", "[filter]") {
  const PoseGaussian<double> start{{}, 0.01 * Matrix6<double>::Identity()};
  RichPoseFilter<double> filter(start);
  const auto result = filter.update(
      [](const Pose& x) { return -0.5e10 * (x.log() - Vector6<double>::Constant(0.1)).squaredNorm(); });
  CHECK(result.status == UpdateStatus::kDiverged);
  CHECK(filter.belief().pose.is_approx(start.pose, 1e-12));
}

TEST_CASE("A prediction with an impossible noise is refused", "[filter]") {
  const PoseGaussian<double> start{Pose::identity(), pose_covariance<double>(0.02, 0.2)};
  QuadraticPoseFilter<double> filter(start);
  CHECK(error_message([&] {
          filter.predict(Pose::identity(), {Pose::identity(), -Matrix6<double>::Identity()});
        }).starts_with("pose covariance has a negative eigenvalue"));
  CHECK(filter.belief().covariance == start.covariance);
}

TEMPLATE_TEST_CASE("A prediction that overflows is refused, and the belief stays", "[filter][error]",
                   QuadraticPoseFilter<double>, SplitPoseFilter<double>, RichPoseFilter<double>) {
  const Matrix6<double> narrow = 0.01 * Matrix6<double>::Identity();
  TestType filter(PoseGaussian<double>{Pose::identity(), narrow});
  const auto before = filter.belief();
  const auto far = Pose::from_rotation_translation(Vector4<double>(1, 0, 0, 0), Vector3<double>(1e200, 0, 0));
  const PoseGaussian<double> noise{Pose::identity(), narrow};
  CHECK(contains(error_message([&] { filter.predict(far, noise); }), "is not finite"));
  CHECK(contains(error_message([&] { filter.predict(far, to_bingham_gaussian(noise)); }), "is not finite"));
  CHECK(filter.belief().covariance == before.covariance);
  CHECK(filter.belief().pose.coeffs() == before.pose.coeffs());
}

TEST_CASE("A linearised filter may start from a certain pose", "[filter]") {
  Rng rng(4);
  const auto pose = random_pose<double>(rng);
  LinearizedPoseFilter<double> filter({pose, Matrix6<double>::Zero()});
  CHECK(filter.update(measure(rng, pose, 20)).status == UpdateStatus::kConverged);
  CHECK(filter.belief().covariance.isZero());
}

TEST_CASE("Gaussian measurements are a log-likelihood", "[filter]") {
  Matrix3<double> R;
  R << 4, 1, 0, 1, 2, 0, 0, 0, 9;
  const Vector3<double> z(1, 2, 3);
  const auto identity = [](const Pose& x, std::size_t) { return x.translation(); };
  const GaussianMeasurements measurements(std::vector<NoisyMeasurement<double, 3>>{{z, R}, {2 * z, R}},
                                          identity);
  CHECK(measurements(Pose::identity()) == Approx(-0.5 * 5.0 * z.dot(R.inverse() * z)));
  const auto nothing = [](const Pose&, std::size_t) { return std::optional<Vector3<double>>(); };
  CHECK(GaussianMeasurements(measurements.measurements(), nothing)(Pose::identity()) ==
        -std::numeric_limits<double>::infinity());
  CHECK(GaussianMeasurements(measurements.measurements(), nothing, 3.0)(Pose::identity()) == -9.0);

  R(0, 0) = -1;
  CHECK(error_message([&] {
          (void)GaussianMeasurements(std::vector<NoisyMeasurement<double, 3>>{{z, R}}, identity);
        }).starts_with("covariance of a measurement is not positive definite"));
  CHECK(error_message([&] {
          (void)GaussianMeasurements(
              std::vector<NoisyMeasurement<double, 3>>{{z * std::nan(""), Matrix3<double>::Identity()}},
              identity);
        }).starts_with("measurement is not finite"));
}
