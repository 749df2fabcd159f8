// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <vector>

#include <antipode/distributions/pose_gaussian_queries.hpp>
#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/pose_filter.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"

// Priors that know some axes exactly: a robot in the plane, a camera on a rail.

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;

/// The landmark in the axes of the body.
struct LandmarkInBody {
  std::vector<Vector3<double>> landmarks;

  [[nodiscard]] Vector3<double> operator()(const Pose& x, std::size_t i) const {
    return x.inverse() * landmarks[i];
  }
  [[nodiscard]] Vector3<double> operator()(const Pose& x, std::size_t i, Matrix<double, 3, 6>& J) const {
    Vector3<double> seen = (*this)(x, i);
    J << skew(seen), -Matrix3<double>::Identity();
    return seen;
  }
};

}  // namespace

TEST_CASE("What a prior knows exactly has the posterior of what it knows to a nanometre",
          "[singular][random]") {
  const LandmarkInBody h{{{5, 5, 1}, {-5, 3, 2}, {2, -6, -1}, {3, 1, 8}}};
  for (unsigned seed = 0; seed < 30; ++seed) {
    const int rank = 1 + static_cast<int>(seed % 5);
    CAPTURE(seed, rank);
    Rng rng(seed);
    Matrix6<double> root = random_matrix<double, 6, 6>(rng, 0.3);
    root.rightCols(6 - rank).setZero();
    root.topRows<3>() *= 0.3;  // rad
    const PoseGaussian<double> prior{random_pose<double>(rng), root * root.transpose()};
    auto regular = prior;
    regular.covariance += 1e-18 * Matrix6<double>::Identity();
    const Pose truth = sample(prior, rng);
    std::vector<NoisyMeasurement<double, 3>> seen;
    for (std::size_t i = 0; i < h.landmarks.size(); ++i) {
      const Vector3<double> error = 0.01 * random_unit<double, 3>(rng);
      seen.push_back({h(truth, i) + error, 1e-4 * Matrix3<double>::Identity()});
    }
    const auto compare = [&](const auto& singular, const auto& expected) {
      CHECK(singular.status == UpdateStatus::kConverged);
      CHECK(singular.steps > 1);
      const Matrix6<double> spread = expected.posterior.covariance;
      const Vector6<double> error = singular.posterior.pose.boxminus(expected.posterior.pose);
      for (int i = 0; i < 6; ++i) {
        const double sigma = std::sqrt(spread(i, i));
        CHECK(std::abs(error[i]) <= 0.005 * sigma + 1e-8);
        CHECK(std::sqrt(singular.posterior.covariance(i, i)) == Approx(sigma).epsilon(0.005).margin(1e-8));
      }
      CHECK(singular.nis == Approx(expected.nis).epsilon(1e-3).margin(1e-3));
      CHECK(singular.log_evidence == Approx(expected.log_evidence).margin(0.01));
    };
    compare(gauss_newton_update(prior, seen, h), gauss_newton_update(regular, seen, h));
    compare(linearized_update(prior, seen, h), linearized_update(regular, seen, h));
    const GaussianMeasurements likelihood(seen, h);
    compare(quadratic_update(prior, likelihood), quadratic_update(regular, likelihood));
  }
}

TEMPLATE_TEST_CASE("A robot in the plane knows three axes, and every filter converges", "[filter]",
                   SplitPoseFilter<double>, RichPoseFilter<double>, QuadraticPoseFilter<double>) {
  const std::vector<Vector3<double>> landmarks{{5, 5, 0}, {-5, 3, 0}, {2, -6, 0}};
  Vector6<double> ahead, drift;
  ahead << 0, 0, 0.1, 1, 0, 0;
  drift << 0, 0, 0.01, 0.02, 0.01, 0;
  const PoseGaussian<double> noise{Pose::identity(), drift.cwiseAbs2().asDiagonal()};
  for (const double known : {0.0, 1e-6, 2e-5, 3e-5, 1e-4}) {  // rad and m
    for (const double sigma : {0.1, 0.01}) {
      CAPTURE(known, sigma);
      Rng rng(1);
      Vector6<double> deviations;
      deviations << known, known, 0.1, 0.5, 0.5, known;
      const PoseGaussian<double> start{Pose::identity(), deviations.cwiseAbs2().asDiagonal()};
      Pose truth = sample(start, rng);
      TestType filter(start);
      LinearizedPoseFilter<double> linearized(start);
      for (int k = 0; k < 5; ++k) {
        truth = truth * Pose::exp(ahead) * sample(noise, rng);
        filter.predict(Pose::exp(ahead), noise);
        linearized.predict(Pose::exp(ahead), noise);
        std::vector<NoisyMeasurement<double, 3>> seen;
        for (const auto& landmark : landmarks) {
          Vector3<double> error = random_unit<double, 3>(rng);
          error[2] = 0.0;  // in the plane
          seen.push_back(
              {truth.inverse() * landmark + sigma * error, sigma * sigma * Matrix3<double>::Identity()});
        }
        const GaussianMeasurements measurements(seen, [&](const Pose& x, std::size_t i) -> Vector3<double> {
          return x.inverse() * landmarks[i];
        });
        const auto result = filter.update(measurements);
        CHECK(result.status == UpdateStatus::kConverged);
        const auto expected = linearized.update(measurements).posterior;
        CHECK(result.posterior.covariance(2, 2) == Approx(expected.covariance(2, 2)).epsilon(0.1));
        CHECK(std::abs(result.posterior.pose.boxminus(expected.pose)[2]) <=
              0.1 * std::sqrt(expected.covariance(2, 2)));
      }
    }
  }
}
