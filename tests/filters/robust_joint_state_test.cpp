// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <random>
#include <tuple>
#include <vector>

#include <antipode/filters/pose_filter.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/robust_likelihood.hpp>
#include <antipode/geometry/chart.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// A pose and the velocity of its position.
using Moving = ProductChart<SplitChart<double>, VectorChart<double, 3>>;
using Landmarks = std::vector<Vector3<double>>;

/// Landmarks seen from a moving body at two times, .5 s apart, a share of them wrong by metres.
struct OutlierDrive {
  StateGaussian<Moving> prior;
  Moving::Point truth;
  Landmarks landmarks;
  std::vector<NoisyMeasurement<double, 3>> seen;

  OutlierDrive(unsigned seed, double share) {
    Rng rng(seed);
    std::normal_distribution<double> normal;
    Vector<double, 9> sigma;
    sigma << 0.1, 0.1, 0.1, 1, 1, 1, 0.5, 0.5, 0.5;
    prior = {{random_pose<double>(rng), random_matrix<double, 3, 1>(rng)}, sigma.cwiseAbs2().asDiagonal()};
    truth = draw(rng, prior);
    for (std::size_t i = 0; i < 24; ++i) {
      landmarks.push_back(random_matrix<double, 3, 1>(rng, 5.0));
      Vector3<double> z = predicted(truth, i);
      const double error = uniform<double>(rng, 0, 1) < share ? 3.0 : 0.05;
      for (double& entry : z) entry += error * normal(rng);
      seen.push_back({z, 0.0025 * Matrix3<double>::Identity()});
    }
  }

  /// The i-th landmark in the axes of the body: at first, and .5 s later.
  [[nodiscard]] Vector3<double> predicted(const Moving::Point& x, std::size_t i) const {
    const auto& [pose, velocity] = x;
    const Vector3<double> moved = landmarks[i] - (i % 2 == 0 ? 0.0 : 0.5) * velocity;
    return pose.inverse() * moved;
  }
  [[nodiscard]] auto model() const {
    return [this](const Moving::Point& x, std::size_t i) { return predicted(x, i); };
  }
};

/// The update of a prior N(0, I) on R^N by its first coordinate, measured as z with a variance of 1.
template <int N>
[[nodiscard]] auto update_first_coordinate(double z) {
  const StateGaussian<VectorChart<double, N>> prior{Vector<double, N>::Zero(), Matrix<double, N>::Identity()};
  return quadratic_update(prior, [=](const Vector<double, N>& x) { return -0.5 * (x[0] - z) * (x[0] - z); });
}
template <int N>
void check_first_coordinate() {
  CAPTURE(N);
  const auto result = update_first_coordinate<N>(2.0);
  CHECK(result.status == UpdateStatus::kConverged);
  Vector<double, N> mean = Vector<double, N>::Zero();
  mean[0] = 1.0;
  Matrix<double, N> covariance = Matrix<double, N>::Identity();
  covariance(0, 0) = 0.5;
  CHECK(max_difference(result.posterior.state, mean) <= 1e-12);
  CHECK(max_difference(result.posterior.covariance, covariance) <= 1e-12);
  CHECK(result.nis == Approx(2.0).epsilon(1e-12));
}

}  // namespace

TEST_CASE("States of one to eighteen dimensions have a default rule", "[joint][quadratic]") {
  check_first_coordinate<1>();
  check_first_coordinate<6>();
  check_first_coordinate<7>();
  check_first_coordinate<9>();
  check_first_coordinate<15>();
  check_first_coordinate<18>();
}

TEST_CASE("A robust likelihood updates a joint state, with a right covariance", "[joint][robust][random]") {
  constexpr int kTrials = 100;
  int converged = 0;
  double sum = 0.0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    const OutlierDrive drive(seed, 0.15);
    const RobustMeasurements likelihood(drive.seen, drive.model(), StudentT<double>{});
    const auto result = quadratic_update(drive.prior, likelihood);
    if (result.status != UpdateStatus::kConverged) continue;
    ++converged;
    sum += nees(result.posterior, drive.truth);
  }
  CHECK(converged >= 95);
  // Nine, for errors that the Student-t describes well; four standard errors either way.
  CHECK(std::abs(sum / converged - 9.0) <= 4.0 * std::sqrt(18.0 / converged));
}

TEST_CASE("A filter of joint states takes a robust likelihood", "[joint][robust]") {
  using Filter = PoseFilter<StateGaussian<Moving>, Degree5Rule<9>, QuadraticProgression<double>>;
  const OutlierDrive drive(1, 0.15);
  Filter filter(drive.prior);
  const auto result = filter.update(RobustMeasurements(drive.seen, drive.model(), StudentT<double>{}));
  CHECK(result.status == UpdateStatus::kConverged);
  CHECK(Moving::local(filter.belief().state, drive.truth).norm() < 0.3);
}
