// SPDX-License-Identifier: MIT
#include <cmath>
#include <concepts>
#include <cstddef>
#include <tuple>
#include <vector>

#include <antipode/filters/angle_measurements.hpp>
#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/geometry/chart.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"

/// A heading, measured while roll and pitch are uncertain: to second order it contains roll times pitch,
/// which points on the axes do not see.
namespace antipode::test {
namespace {

using Pose = DualQuaternion<double>;
using MovingChart = ProductChart<SplitChart<double>, VectorChart<double, 3>>;
using Moving = StateGaussian<MovingChart>;

[[nodiscard]] const Pose& pose_of(const Pose& x) { return x; }
[[nodiscard]] const Pose& pose_of(const MovingChart::Point& x) { return std::get<0>(x); }

template <class State>
[[nodiscard]] double yaw_of(const State& x) {
  const Matrix3<double> R = pose_of(x).rotation_matrix();
  return std::atan2(R(1, 0), R(0, 0));
}

/// The heading near the measured one, with its Jacobian by differences.
struct HeadingNear {
  double measured;

  template <class State>
  Vector<double, 1> operator()(const State& x, std::size_t) const {
    return Vector<double, 1>(measured + wrap_angle(yaw_of(x) - measured));
  }
  Vector<double, 1> operator()(const Pose& x, std::size_t i, Matrix<double, 1, 6>& J) const {
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; ++k) {
      const Vector6<double> e = kStep * Vector6<double>::Unit(k);
      J(0, k) = ((*this)(x.boxplus(e), i)[0] - (*this)(x.boxplus(-e), i)[0]) / (2.0 * kStep);
    }
    return (*this)(x, i);
  }
};

/// The posteriors that an update calls converged.
struct Converged {
  int count = 0;
  double mean_nees = 0.0;
};

constexpr int kTrials = 400;

/// The attitude is known to `prior_sigma`, the rest to .5 m and .5 m/s.
template <class Density, class Update>
[[nodiscard]] Converged converged_of(double prior_sigma, double heading_sigma, const Update& update) {
  constexpr int N = Density::Chart::kDim;
  Vector<double, N> sigma = Vector<double, N>::Constant(0.5);
  sigma.template head<3>().setConstant(prior_sigma);
  Converged converged;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    Rng rng(seed);
    std::normal_distribution<double> normal;
    Density prior;
    auto& [mean, covariance] = prior;
    const Pose pose = random_pose<double>(rng);
    if constexpr (std::same_as<Density, Moving>) {
      mean = {pose, Vector3<double>::Zero()};
    } else {
      mean = pose;
    }
    covariance = sigma.cwiseAbs2().asDiagonal();
    Vector<double, N> error;
    for (double& entry : error) entry = normal(rng);
    const auto truth = Density::Chart::retract(mean, error.cwiseProduct(sigma));
    const double z = yaw_of(truth) + heading_sigma * normal(rng);
    const std::vector<NoisyMeasurement<double, 1>> measured{
        {Vector<double, 1>(z), Matrix<double, 1>(heading_sigma * heading_sigma)}};
    const auto result = update(prior, measured, HeadingNear{z});
    if (result.status != UpdateStatus::kConverged) continue;
    ++converged.count;
    converged.mean_nees += nees(result.posterior, truth);
  }
  if (converged.count > 0) converged.mean_nees /= converged.count;
  return converged;
}

const auto kLinearized = [](const auto& prior, const auto& measured, const auto& h) {
  return linearized_update(prior, measured, h);
};
const auto kGaussNewton = [](const auto& prior, const auto& measured, const auto& h) {
  return gauss_newton_update(prior, measured, h);
};

}  // namespace

TEST_CASE("A heading is believed under wide attitudes only as far as roll times pitch allows",
          "[filters][random]") {
  // Three standard deviations of a mean of NEES.
  const auto tolerance = [](const Converged& c, int dim) { return 3.0 * std::sqrt(2.0 * dim / c.count); };
  for (const double prior_sigma : {0.05, 0.1, 0.2}) {
    CAPTURE(prior_sigma);
    const Converged pose = converged_of<PoseGaussian<double>>(prior_sigma, 0.05, kLinearized);
    CHECK(pose.count >= 0.75 * kTrials);
    CHECK(std::abs(pose.mean_nees - 6.0) <= tolerance(pose, 6));
    const Converged joint = converged_of<Moving>(prior_sigma, 0.05, kLinearized);
    CHECK(joint.count >= 0.75 * kTrials);
    CHECK(std::abs(joint.mean_nees - 9.0) <= tolerance(joint, 9));
    const Converged newton = converged_of<PoseGaussian<double>>(prior_sigma, 0.05, kGaussNewton);
    CHECK(newton.count >= 0.4 * kTrials);
    CHECK(std::abs(newton.mean_nees - 6.0) <= tolerance(newton, 6));
  }
}

TEST_CASE("A heading much more precise than roll times pitch is not a Gaussian posterior",
          "[filters][random]") {
  // .2 rad times .2 rad against .005 rad. Points on the axes alone: ANEES 14 and 16, called converged.
  CHECK(converged_of<PoseGaussian<double>>(0.2, 0.005, kLinearized).count == 0);
  CHECK(converged_of<Moving>(0.2, 0.005, kLinearized).count == 0);
  CHECK(converged_of<PoseGaussian<double>>(0.2, 0.005, kGaussNewton).count == 0);
}

}  // namespace antipode::test
