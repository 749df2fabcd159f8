// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <vector>

#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/pose_filter.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Model = std::function<std::optional<Vector3<double>>(const Pose&, std::size_t)>;
using Measurements = GaussianMeasurements<double, 3, Model>;

[[nodiscard]] Measurements measure(Rng& rng, const Pose& truth, int count) {
  const auto scene = StereoScene<double>::random(rng, truth, count);
  std::vector<NoisyMeasurement<double, 3>> measurements;
  for (const auto& z : scene.measurements) {
    measurements.push_back({z, Matrix3<double>(scene.sigma.cwiseAbs2().asDiagonal())});
  }
  return {measurements, [camera = scene.camera, landmarks = scene.landmarks](const Pose& x, std::size_t i) {
            return camera(x, landmarks[i]);
          }};
}

[[nodiscard]] const PoseGaussian<double>& as_pose_gaussian(const PoseGaussian<double>& density) {
  return density;
}
[[nodiscard]] PoseGaussian<double> as_pose_gaussian(const BinghamGaussian<double>& density) {
  return to_pose_gaussian(density);
}

constexpr int kSteps = 20;

/// The mean NEES over drives of kSteps steps, with odometry of the given standard deviation.
template <class Filter>
[[nodiscard]] double mean_nees_of_drives(unsigned drives, int landmarks, double sigma_rad) {
  const auto as_density = [](const PoseGaussian<double>& density) {
    if constexpr (std::is_constructible_v<Filter, PoseGaussian<double>>) {
      return density;
    } else {
      return to_bingham_gaussian(density);
    }
  };
  double sum = 0.0;
  for (unsigned seed = 0; seed < drives; ++seed) {
    Rng rng(seed);
    const PoseGaussian<double> start{random_pose<double>(rng), pose_covariance<double>(0.02, 0.2)};
    const PoseGaussian<double> noise{Pose::identity(), pose_covariance<double>(sigma_rad, 10.0 * sigma_rad)};
    Vector6<double> ahead;
    ahead << 0, 0.05, 0, 0, 0, 1;
    Pose truth = draw(rng, start);
    Filter filter(as_density(start));
    for (int k = 0; k < kSteps; ++k) {
      truth = draw(rng, PoseGaussian<double>{truth * Pose::exp(ahead), noise.covariance});
      filter.predict(Pose::exp(ahead), as_density(noise));
      const auto result = filter.update(measure(rng, truth, landmarks));
      CHECK(result.status == UpdateStatus::kConverged);
      sum += nees(as_pose_gaussian(filter.belief()), truth);
    }
  }
  return sum / (drives * kSteps);
}

}  // namespace

TEST_CASE("Filters of other densities, rules and updates are used alike, and are honest", "[filter]") {
  // Three standard deviations; steps of a drive are nearly independent, since its updates are much sharper
  // than its predictions.
  const auto tolerance = [](unsigned drives) { return 3.0 * std::sqrt(12.0 / (drives * kSteps)); };
  CHECK(std::abs(mean_nees_of_drives<QuadraticPoseFilter<double>>(10, 20, 0.005) - 6.0) <= tolerance(10));
  CHECK(std::abs(mean_nees_of_drives<LinearizedPoseFilter<double>>(10, 20, 0.005) - 6.0) <= tolerance(10));
  // Reweighting takes finite steps: a few per cent too confident.
  CHECK(std::abs(mean_nees_of_drives<RichPoseFilter<double>>(2, 20, 0.005) - 6.0) <= 1.5 * tolerance(2));
}

TEST_CASE("The paper's filter is overconfident", "[filter]") {
  CHECK(mean_nees_of_drives<PaperPoseFilter<double>>(1, 30, 0.035) > 12.0);
}

TEST_CASE("A failed update leaves the belief alone", "[filter]") {
  const PoseGaussian<double> start{Pose::identity(), pose_covariance<double>(0.02, 0.2)};
  QuadraticPoseFilter<double> filter(start);
  CHECK(filter.update([](const Pose&) { return std::nan(""); }).status == UpdateStatus::kNotFinite);
  CHECK(filter.belief().covariance == start.covariance);
  CHECK(filter.belief().pose.coeffs() == start.pose.coeffs());
}

TEST_CASE("A density that collapsed under steps that were too long is not taken over", "[filter]") {
  const PoseGaussian<double> start{{}, 0.01 * Matrix6<double>::Identity()};
  RichPoseFilter<double> filter(to_bingham_gaussian(start));
  const auto result = filter.update(
      [](const Pose& x) { return -0.5e10 * (x.log() - Vector6<double>::Constant(0.1)).squaredNorm(); });
  CHECK(result.status == UpdateStatus::kDiverged);
  CHECK(filter.belief().pose().is_approx(start.pose, 1e-12));
}

TEST_CASE("A prediction with an impossible noise is refused", "[filter]") {
  const PoseGaussian<double> start{Pose::identity(), pose_covariance<double>(0.02, 0.2)};
  QuadraticPoseFilter<double> filter(start);
  CHECK(error_message([&] {
          filter.predict(Pose::identity(), {Pose::identity(), -Matrix6<double>::Identity()});
        }).starts_with("pose covariance has a negative eigenvalue"));
  CHECK(filter.belief().covariance == start.covariance);
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
  CHECK(GaussianMeasurements(measurements.measurements(), nothing, -5.0)(Pose::identity()) == -5.0);

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
