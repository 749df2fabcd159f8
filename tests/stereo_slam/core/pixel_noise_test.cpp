// SPDX-License-Identifier: MIT
#include "stereo_slam/core/pixel_noise.hpp"

#include <limits>
#include <random>

#include <Eigen/Eigenvalues>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST_CASE("The noise scale converges to the variances of the noise and follows them", "[stereo_slam][slam]") {
  NoiseScale noise;
  CHECK(noise.variance_ratio() == Vector2<double>::Ones());
  std::mt19937_64 random(1);
  constexpr int kResiduals = 100;
  const auto add_updates = [&](double u, double v, int count) {
    std::chi_squared_distribution<double> squares(kResiduals);
    for (int i = 0; i < count; ++i) {
      noise.add({u * squares(random) / kResiduals, v * squares(random) / kResiduals});
    }
  };
  add_updates(0.4, 3.0, 1);
  CHECK(noise.variance_ratio().x() > 0.8);  // one update hardly counts
  CHECK(noise.variance_ratio().y() < 1.6);
  add_updates(0.4, 3.0, 300);
  CHECK(noise.variance_ratio().x() == Approx(0.4).epsilon(0.1));
  CHECK(noise.variance_ratio().y() == Approx(3.0).epsilon(0.1));
  add_updates(3.0, 0.4, 600);
  CHECK(noise.variance_ratio().x() == Approx(3.0).epsilon(0.1));
  CHECK(noise.variance_ratio().y() == Approx(0.4).epsilon(0.1));
}

TEST_CASE("The noise scale ignores what is not finite, and stays above zero", "[stereo_slam][slam]") {
  NoiseScale noise;
  noise.add({kNaN, 3.0});
  noise.add({3.0, kInfinity});
  CHECK(noise.variance_ratio() == Vector2<double>::Ones());
  for (int i = 0; i < 1000; ++i) noise.add({0.0, 0.0});
  CHECK(noise.variance_ratio() == Vector2<double>::Constant(0.2));
}

TEST_CASE("A frame that is noisier than the mean and than assumed counts more", "[stereo_slam][slam]") {
  NoiseScale noise;
  for (int i = 0; i < 2000; ++i) noise.add({0.5, 2.0});
  const auto of_frame = [&](double u, double v) { return noise.variance_ratio_of_frame({u, v}); };
  const auto mean = noise.variance_ratio();
  CHECK(of_frame(0.3, 1.0) == mean);
  CHECK(of_frame(1.2, 2.5).isApprox(mean, 1e-6));  // hardly more than assumed; hardly more than the mean
  CHECK(of_frame(1.8, 3.6).x() == Approx(0.5 + 5.0 * 0.5));
  CHECK(of_frame(1.8, 3.6).y() == Approx(2.0 + 5.0 * 1.0));
  CHECK(of_frame(kNaN, 3.0) == mean);
  CHECK(of_frame(3.0, kInfinity) == mean);
}

TEST_CASE("All limits of the noise scale are relative to the expected ratio", "[stereo_slam][slam]") {
  NoiseScale half(0.5);
  CHECK(half.variance_ratio() == Vector2<double>::Constant(0.5));
  CHECK(half.variance_ratio_of_frame({0.6, 1.0}).x() == 0.5);
  CHECK(half.variance_ratio_of_frame({0.6, 1.0}).y() == Approx(0.5 + 5.0 * (1.0 - 1.3 * 0.5)));
  for (int i = 0; i < 1000; ++i) half.add({0.0, 0.0});
  CHECK(half.variance_ratio() == Vector2<double>::Constant(0.1));
}

TEST_CASE("A covariance takes the noise of the image axis that its component moves points along",
          "[stereo_slam][slam]") {
  const Matrix6<double> root = Matrix6<double>::Random();
  const Matrix6<double> before = root * root.transpose() + Matrix6<double>::Identity();
  const Matrix6<double> after = NoiseScale::scaled(before, {4.0, 9.0});
  for (const int component : {1, 3, 5}) {
    CHECK(after(component, component) == Approx(4.0 * before(component, component)).epsilon(1e-6));
  }
  for (const int component : {0, 2, 4}) {
    CHECK(after(component, component) == Approx(9.0 * before(component, component)).epsilon(1e-6));
  }
  CHECK(after == after.transpose());
  CHECK(Eigen::SelfAdjointEigenSolver<Matrix6<double>>(after).eigenvalues().minCoeff() > 0.0);

  // The same noise along both axes scales the covariance as a whole.
  CHECK(NoiseScale::scaled(before, {2.5, 2.5}).isApprox(2.5 * before, 1e-6));
}

}  // namespace
}  // namespace stereo_slam
