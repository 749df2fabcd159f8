// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <vector>

#include <antipode/filters/pose_filter.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;

/// z = t_z, with its Jacobian in the split chart.
struct Height {
  Vector<double, 1> operator()(const Pose& x, std::size_t) const {
    return Vector<double, 1>(x.translation()[2]);
  }
  Vector<double, 1> operator()(const Pose& x, std::size_t i, Matrix<double, 1, 6>& J) const {
    J.setZero();
    J(0, 5) = 1.0;
    return (*this)(x, i);
  }
};

[[nodiscard]] GaussianMeasurements<double, 1, Height> height(double z, double sigma) {
  return {{{Vector<double, 1>(z), Vector<double, 1>(sigma * sigma)}}, Height{}};
}

}  // namespace

TEST_CASE("The innovation squared of a linear measurement is that of Kalman's update", "[nis]") {
  const SplitPoseGaussian<double> prior{Pose::identity(), pose_covariance<double>(0.05, 2.0)};
  const auto measurement = height(3.0, 0.1);
  const double nis = 9.0 / (4.0 + 0.01);
  CHECK(quadratic_update(prior, measurement).nis == Approx(nis).epsilon(1e-9));
  CHECK(linearized_update(prior, measurement.measurements(), Height{}).nis == Approx(nis).epsilon(1e-9));
  CHECK(gauss_newton_update(prior, measurement.measurements(), Height{}).nis == Approx(nis).epsilon(1e-9));
  // Of samples, and of a Bingham density instead of a Gaussian: to a tenth.
  const auto bingham = to_bingham_gaussian(prior);
  const auto reweighted = progressive_update(bingham, measurement, RichPoseRule{}, {.tau = 0.8});
  CHECK(reweighted.nis == Approx(nis).margin(0.1));
  CHECK(SplitPoseFilter<double>(prior).update(measurement).nis == Approx(nis).epsilon(1e-9));
  CHECK(RichPoseFilter<double>(bingham).update(measurement).nis == Approx(nis).margin(0.1));
}

TEST_CASE("The innovation squared of a reweighted density is right although its samples spread too little",
          "[nis]") {
  Vector6<double> sigma;
  sigma << 0.02, 0.02, 0.05, 1.0, 1.0, 1.0;
  const SplitPoseGaussian<double> prior{Pose::identity(), sigma.cwiseAbs2().asDiagonal()};
  for (const double noise : {1.0, 0.5, 0.1, 0.03}) {
    for (const double z : {0.0, 0.1, 0.3, 1.0, 3.0}) {
      CAPTURE(noise, z);
      const auto position = [&](const Pose& x) {
        return -0.5 * (x.translation() - Vector3<double>::Constant(z)).squaredNorm() / (noise * noise);
      };
      const auto result = RichPoseFilter<double>(to_bingham_gaussian(prior)).update(position);
      CHECK(result.status == UpdateStatus::kConverged);
      CHECK(result.nis == Approx(3.0 * z * z / (1.0 + noise * noise)).margin(0.12));
    }
  }
}

TEST_CASE("A certain prior leaves the innovation in units of the noise", "[nis]") {
  const SplitPoseGaussian<double> prior{Pose::identity(), Matrix6<double>::Zero()};
  const auto measurement = height(3.0, 0.1);
  CHECK(quadratic_update(prior, measurement).nis == Approx(900.0));
  CHECK(linearized_update(prior, measurement.measurements(), Height{}).nis == Approx(900.0));
  CHECK(gauss_newton_update(prior, measurement.measurements(), Height{}).nis == Approx(900.0));
}

TEST_CASE("The innovation squared of a joint state counts every number that was measured", "[nis]") {
  using Chart = ProductChart<SplitChart<double>, VectorChart<double, 3>>;
  StateGaussian<Chart> prior{{Pose::identity(), Vector3<double>::Zero()}, Matrix<double, 9>::Identity()};
  const std::vector<NoisyMeasurement<double, 2>> z{{Vector2<double>(1.0, -2.0), Matrix2<double>::Identity()}};
  const auto h = [](const Chart::Point& x, std::size_t) {
    return Vector2<double>(std::get<0>(x).translation()[0], std::get<1>(x)[1]);
  };
  CHECK(linearized_update(prior, z, h).nis == Approx(2.5).epsilon(1e-9));
}

TEST_CASE("The innovations squared of stereo landmarks are chi-square", "[nis][random]") {
  constexpr int kRuns = 60, kLandmarks = 10, kRows = 3 * kLandmarks;
  double quadratic = 0.0, linearized = 0.0, progressive = 0.0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    Rng rng(seed);
    const PoseGaussian<double> prior{random_pose<double>(rng), pose_covariance<double>(0.01, 0.1)};
    const auto scene = StereoScene<double>::random(rng, draw(rng, prior), kLandmarks);
    std::vector<NoisyMeasurement<double, 3>> z;
    for (const auto& measured : scene.measurements) {
      z.push_back({measured, scene.sigma.cwiseAbs2().asDiagonal()});
    }
    const auto h = [&](const Pose& x, std::size_t i) { return scene.camera(x, scene.landmarks[i]); };
    quadratic += quadratic_update(prior, scene).nis / kRuns;
    linearized += linearized_update(prior, z, h).nis / kRuns;
    progressive += progressive_update(to_bingham_gaussian(prior), scene, JointPoseRule{}).nis / kRuns;
  }
  const double standard_error = std::sqrt(2.0 * kRows / kRuns);
  CHECK(std::abs(quadratic - kRows) <= 4.0 * standard_error);
  CHECK(linearized == Approx(quadratic).epsilon(1e-3));
  CHECK(progressive == Approx(quadratic).epsilon(0.06));
}
