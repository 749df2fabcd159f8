// SPDX-License-Identifier: MIT
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include <antipode/filters/pose_filter.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Split = SplitPoseGaussian<double>;
using Point = Vector3<double>;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kTrials = 300;

/// A measurement of up to three numbers with independent errors.
struct Sensor {
  const char* name;
  int dim;
  std::function<Point(const Pose&)> h;
  double sigma;
  bool curved = false;  ///< the posterior is bent by more than the noise: reported as not Gaussian
};

[[nodiscard]] std::vector<Sensor> sensors() {
  const Point beacon(300, 100, 50), far_landmark(200, -150, 250);
  return {
      {"altimeter", 1, [](const Pose& x) { return Point(x.translation()[2], 0, 0); }, 0.1},
      {"GPS with a lever arm", 3, [](const Pose& x) { return x * Point(1, 0.5, -0.3); }, 0.1},
      {"range", 1, [=](const Pose& x) { return Point((x.translation() - beacon).norm(), 0, 0); }, 0.5},
      {"range, a shell", 1,
       [=](const Pose& x) { return Point((x.translation() - beacon / 10.0).norm(), 0, 0); }, 0.05, true},
      {"bearing", 3, [=](const Pose& x) { return Point((x.inverse() * far_landmark).normalized()); }, 0.01}};
}

/// The mean NEES of updates by one measurement of a true pose drawn from the prior in the split chart.
template <int Dim, class Update>
[[nodiscard]] double anees(const Sensor& sensor, double rotation_deg, double position_m, Update update) {
  double sum = 0.0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    Rng rng(seed);
    const Split prior{random_pose<double>(rng), pose_covariance<double>(rotation_deg * kDegree, position_m)};
    const Pose truth = draw(rng, prior);
    std::normal_distribution<double> normal(0.0, sensor.sigma);
    Vector<double, Dim> z = sensor.h(truth).template head<Dim>();
    for (double& entry : z) entry += normal(rng);
    const Matrix<double, Dim> R = Matrix<double, Dim>::Identity() * (sensor.sigma * sensor.sigma);
    const GaussianMeasurements measurement(
        std::vector<NoisyMeasurement<double, Dim>>{{z, R}},
        [&](const Pose& x, std::size_t) -> Vector<double, Dim> { return sensor.h(x).template head<Dim>(); });
    const auto result = update(prior, measurement);
    CHECK((result.status == UpdateStatus::kConverged) == !sensor.curved);
    sum += nees(result.posterior, truth);
  }
  return sum / kTrials;
}

template <class Update>
[[nodiscard]] double anees(const Sensor& sensor, double rotation_deg, double position_m, Update update) {
  return sensor.dim == 1 ? anees<1>(sensor, rotation_deg, position_m, update)
                         : anees<3>(sensor, rotation_deg, position_m, update);
}

}  // namespace

TEST_CASE("Positions measured under a wide attitude leave a consistent density", "[split]") {
  const auto linearized = [](const Split& prior, const auto& measurement) {
    return PosteriorLinearization<double>{}(prior, measurement, MysovskikhRule<6>{});
  };
  for (const Sensor& sensor : sensors()) {
    CAPTURE(sensor.name);
    const double mean = anees(sensor, 10.0, 10.0, linearized);
    // Three standard deviations of the mean of 300 chi^2(6) are 0.6.
    CHECK(mean >= 5.3);
    CHECK(mean <= 6.7);
  }
}

TEST_CASE("What is linear in the split chart takes one fit and is the Kalman update", "[split]") {
  const Split prior{Pose::identity(), pose_covariance<double>(10.0 * kDegree, 10.0)};
  const auto result = quadratic_update(prior, [](const Pose& x) {
    const double error = (x.translation()[2] - 3.0) / 0.1;
    return -0.5 * error * error;
  });
  CHECK(result.status == UpdateStatus::kConverged);
  CHECK(result.steps == 1);
  CHECK(result.residual <= 1e-10);
  const double S = 100.01;
  CHECK(result.posterior.pose.translation()[2] == Approx(3.0 * 100.0 / S).epsilon(1e-10));
  CHECK(std::sqrt(result.posterior.covariance(3, 3)) == Approx(10.0).epsilon(1e-10));
  CHECK(std::sqrt(result.posterior.covariance(5, 5)) == Approx(0.1 * 10.0 / std::sqrt(S)).epsilon(1e-8));
  CHECK(result.log_evidence == Approx(-0.5 * 9.0 / S - std::log(std::sqrt(S) / 0.1)).epsilon(1e-10));
}

TEST_CASE("The prediction in the split chart is that of sampled motions", "[split]") {
  Rng rng(5);
  const Split state{random_pose<double>(rng), pose_covariance<double>(0.02, 3.0)};
  const PoseGaussian<double> noise{Pose::identity(), pose_covariance<double>(0.01, 0.05)};
  const auto motion = random_pose<double>(rng);
  const Split closed = predict_closed_form(state, motion, noise);
  const Split sampled = predict(state, motion, noise, CubatureRule<12>{});
  CHECK((closed.pose.translation() - sampled.pose.translation()).norm() <= 3e-3);
  CHECK(max_difference(closed.covariance, sampled.covariance) <= 5e-3);
  const PoseGaussian<double> screw{state.pose, pose_covariance<double>(0.02, 3.0)};
  const auto there = in_chart<SplitChart<double>>(predict_closed_form(screw, motion, noise));
  CHECK(there.covariance.diagonal().isApprox(
      predict_closed_form(in_chart<SplitChart<double>>(screw), motion, noise).covariance.diagonal(), 0.01));
}

TEST_CASE("A filter in the split chart stays consistent under odometry, altimeter and GPS",
          "[split][filter]") {
  constexpr int kRuns = 40, kSteps = 20;
  double sum = 0.0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    Rng rng(seed);
    std::normal_distribution<double> normal;
    const Split start{random_pose<double>(rng), pose_covariance<double>(10.0 * kDegree, 10.0)};
    const PoseGaussian<double> noise{Pose::identity(), pose_covariance<double>(0.5 * kDegree, 0.05)};
    Vector6<double> step;
    step << 0, 0, 0.1, 1, 0, 0;
    Pose truth = draw(rng, start);
    SplitPoseFilter<double> filter(start);
    for (int k = 0; k < kSteps; ++k) {
      truth = draw(rng, PoseGaussian<double>{truth * Pose::exp(step), noise.covariance});
      filter.predict(Pose::exp(step), noise);
      const Point z = truth.translation() + 0.1 * Point(normal(rng), normal(rng), normal(rng));
      const bool with_gps = k % 2 == 0;
      const auto result = filter.update([&](const Pose& x) {
        const Point error = (z - x.translation()) / 0.1;
        return -0.5 * (with_gps ? error.squaredNorm() : error[2] * error[2]);
      });
      CHECK(result.status == UpdateStatus::kConverged);
    }
    sum += nees(filter.belief(), truth);
  }
  CHECK(std::abs(sum / kRuns - 6.0) <= 3.0 * std::sqrt(12.0 / kRuns));
}

TEST_CASE("A filter starts from a density in either chart", "[split][filter]") {
  Rng rng(6);
  const PoseGaussian<double> screw{random_pose<double>(rng), pose_covariance<double>(0.01, 0.1)};
  const auto split = in_chart<SplitChart<double>>(screw);
  CHECK(SplitPoseFilter<double>(screw).belief().covariance == split.covariance);
  CHECK(SplitPoseFilter<double>(split).belief().covariance == split.covariance);
  CHECK(QuadraticPoseFilter<double>(split).belief().covariance.isApprox(screw.covariance, 1e-3));
  CHECK(SplitPoseFilter<double>(to_bingham_gaussian(screw))
            .belief()
            .covariance.isApprox(split.covariance, 1e-3));
  CHECK_THROWS_AS(SplitPoseFilter<double>({screw.pose, -screw.covariance}), std::invalid_argument);
}

TEST_CASE("A negative variance of the rotation is refused beside large ones of the position",
          "[filter][error]") {
  Matrix6<double> P = pose_covariance<double>(0.01, 100.0);
  P(0, 0) = -1e-6;
  CHECK_THROWS_AS(QuadraticPoseFilter<double>({Pose::identity(), P}), std::invalid_argument);
  CHECK_THROWS_AS(LinearizedPoseFilter<double>({Pose::identity(), P}), std::invalid_argument);
  CHECK_THROWS_AS(RichPoseFilter<double>({Pose::identity(), P}), std::invalid_argument);
}
