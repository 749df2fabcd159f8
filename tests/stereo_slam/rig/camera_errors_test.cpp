// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/camera_errors.hpp"

#include <cmath>
#include <random>

#include <Eigen/LU>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

using Basis = CameraErrors::Coefficients;
using Evidence = CameraErrors::Evidence;

constexpr double kWidest_px = 0.7;
constexpr double kExpected_px = 0.03;

[[nodiscard]] Basis offset(double constant_px, double square_px) {
  Basis coefficients = Basis::Zero();
  coefficients[0] = constant_px;
  coefficients[3] = square_px;
  return coefficients;
}

/// What motions show if they measure the coefficients at random places of the image.
class Motions {
 public:
  Evidence next(const Basis& truth) {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> place(-1.0, 1.0);
    Evidence evidence;
    for (int i = 0; i < 50; ++i) {
      const double x = place(random_), y = place(random_);
      Basis terms = Basis::Zero();  // they show nothing of the lenses
      terms.head<CameraErrors::kOffsetTerms>() << 1.0, x, y, x * x, x * y, y * y, x * x * x, x * x * y,
          x * y * y, y * y * y;
      const double measured_px = terms.dot(truth) + kNoise_px * normal(random_);
      evidence.information += terms * terms.transpose() / (kNoise_px * kNoise_px);
      evidence.vector += measured_px * terms / (kNoise_px * kNoise_px);
    }
    return evidence;
  }

 private:
  static constexpr double kNoise_px = 1.0;
  std::mt19937_64 random_{1};
};

[[nodiscard]] CameraErrors exact_calibration() {
  CameraErrors estimate(kWidest_px);
  estimate.expect(kExpected_px, kExpected_px);
  return estimate;
}

/// Adds motions; returns how many were added when a turn was noticed.
[[nodiscard]] std::optional<int> drive(CameraErrors& estimate, Motions& motions, const Basis& truth,
                                       int count) {
  std::optional<int> noticed;
  for (int i = 0; i < count; ++i) {
    if (estimate.add(motions.next(truth)) && !noticed) noticed = i + 1;
  }
  return noticed;
}

TEST_CASE("The prior of an exact calibration resists noise", "[stereo_slam][rectification]") {
  CameraErrors estimate = exact_calibration();
  Motions motions;
  CHECK_FALSE(drive(estimate, motions, Basis::Zero(), 200));
  CHECK_FALSE(estimate.has_large_error());
  CHECK(estimate.periods().empty());
  CHECK(estimate.estimate().mean().cwiseAbs().maxCoeff() < 0.05);
}

TEST_CASE("A wrong column is learned whatever the rows show", "[stereo_slam][rectification]") {
  const double column_px = GENERATE(-20.0, -5.0, 0.5, 5.0);
  CAPTURE(column_px);
  CameraErrors estimate = exact_calibration();
  Motions motions;
  CHECK_FALSE(drive(estimate, motions, offset(column_px, 0.0), 100));
  CHECK(estimate.has_large_error());
  CHECK(estimate.periods().empty());  // it has been there from the start
  CHECK((estimate.estimate().mean() - offset(column_px, 0.0)).cwiseAbs().maxCoeff() < 0.1);
}

TEST_CASE("A turn is noticed, learned, and separates the motions before it from those after it",
          "[stereo_slam][rectification]") {
  const double expected_px = GENERATE(kExpected_px, kWidest_px);  // an exact calibration, and any
  CAPTURE(expected_px);
  CameraErrors estimate(kWidest_px);
  estimate.expect(expected_px, expected_px);
  Motions motions;
  constexpr int kBefore = 40;
  CHECK_FALSE(drive(estimate, motions, Basis::Zero(), kBefore));
  for (int turn = 1; turn <= 2; ++turn) {  // the second one is back
    const Basis truth = turn == 1 ? offset(2.0, 1.5) : Basis::Zero();
    const auto noticed = drive(estimate, motions, truth, kBefore);
    REQUIRE(noticed);
    CHECK(*noticed <= 3);
    REQUIRE(estimate.periods().size() == static_cast<std::size_t>(turn));
    const auto& before = estimate.periods().back();
    CHECK(std::abs(static_cast<double>(before.motions) - turn * kBefore) <= 1.0);
    CHECK((before.estimate.mean() - (offset(2.0, 1.5) - truth)).cwiseAbs().maxCoeff() < 0.5);
    CHECK(estimate.period_of(before.motions - 1) == &before);
    CHECK(estimate.period_of(before.motions) == nullptr);
    CHECK((estimate.estimate().mean() - truth).cwiseAbs().maxCoeff() < 0.5);
  }
}

TEST_CASE("A displacement from the start does not hide a later turn", "[stereo_slam][rectification]") {
  CameraErrors estimate = exact_calibration();
  Motions motions;
  constexpr int kBefore = 40;
  CHECK_FALSE(drive(estimate, motions, offset(-2.0, 0.0), kBefore));
  const auto noticed = drive(estimate, motions, offset(0.5, 0.0), 20);
  REQUIRE(noticed);
  CHECK(*noticed <= 3);
  REQUIRE(estimate.periods().size() == 1);
  CHECK(std::abs(estimate.periods()[0].estimate.mean()[0] + 2.0) < 0.2);
  CHECK(std::abs(estimate.estimate().mean()[0] - 0.5) < 0.3);
}

TEST_CASE("What a turn does not change stays known", "[stereo_slam][rectification]") {
  CameraErrors estimate(kWidest_px);
  estimate.expect(kWidest_px, kWidest_px);
  Motions motions;
  Basis truth = Basis::Zero();
  truth[4] = 1.4;  // x y
  (void)drive(estimate, motions, truth, 40);
  const auto variance = [&](int term) {
    return estimate.estimate().information.inverse().eval()(term, term);
  };
  const double known = variance(4), constant = variance(0);
  REQUIRE(drive(estimate, motions, truth + offset(2.0, 1.5), 3));
  CHECK(variance(4) < 1.2 * known);
  CHECK(variance(0) > 2.0 * constant);
  CHECK(std::abs(estimate.estimate().mean()[4] - 1.4) < 0.3);
}

TEST_CASE("A resumed estimate does not learn a large error anew", "[stereo_slam][rectification]") {
  CameraErrors estimate = exact_calibration();
  Motions motions;
  (void)drive(estimate, motions, offset(-5.0, 0.0), 60);
  CameraErrors resumed = exact_calibration();
  resumed.resume(estimate.everything());
  CHECK(resumed.estimate().mean().isApprox(estimate.estimate().mean()));
  CHECK_FALSE(drive(resumed, motions, offset(-5.0, 0.0), 20));
  CHECK(std::abs(resumed.estimate().mean()[0] + 5.0) < 0.1);
}

TEST_CASE("What motions showed before the right camera moved stays with them",
          "[stereo_slam][rectification]") {
  CameraErrors estimate = exact_calibration();
  Motions motions;
  constexpr int kBefore = 60, kAfter = 40;
  (void)drive(estimate, motions, offset(-5.0, 0.0), kBefore);
  const Basis before = estimate.estimate().mean();
  estimate.forget(1.0);
  for (int i = 0; i < kAfter; ++i) estimate.add_without_turn(motions.next(offset(-4.0, 0.0)));
  CHECK(std::abs(estimate.estimate().mean()[0] + 4.0) < 0.15);
  const auto* period = estimate.period_of(kBefore - 1);
  REQUIRE(period);
  CHECK(period->estimate.mean().isApprox(before));
  CHECK(period->turn_px.isZero(0.0));
  CHECK_FALSE(estimate.period_of(kBefore));
}

TEST_CASE("After a shift the estimate goes on with what was known", "[stereo_slam][rectification]") {
  const Basis small = offset(0.05, 0.0), change = offset(3.0, 1.0);
  CameraErrors shifted = exact_calibration(), still = exact_calibration();
  Motions with_shift, without;
  CHECK_FALSE(drive(shifted, with_shift, small, 20));
  CHECK_FALSE(drive(still, without, small, 20));
  shifted.shift(change);
  CHECK(shifted.has_large_error());
  CHECK_FALSE(drive(shifted, with_shift, small + change, 40));
  CHECK_FALSE(drive(still, without, small, 40));
  CHECK((shifted.estimate().mean() - still.estimate().mean() - change).norm() < 1e-9);
  CHECK(shifted.estimate().information.isApprox(still.estimate().information, 1e-12));
  const auto* period = shifted.period_of(19);
  REQUIRE(period);
  CHECK(period->turn_px.isZero(0.0));  // it is known when it was
  CHECK_FALSE(shifted.period_of(20));
}

TEST_CASE("A shift moves the estimate, and diffusion widens it by its covariance",
          "[stereo_slam][rectification]") {
  CameraErrors estimate = exact_calibration();
  Motions motions;
  (void)drive(estimate, motions, offset(-5.0, 0.0), 60);
  const Basis before = estimate.estimate().mean();
  estimate.shift(offset(2.0, 0.5));
  CHECK((estimate.estimate().mean() - before - offset(2.0, 0.5)).norm() < 1e-6);
  const auto everything = [&] {
    return CameraErrors::Information(estimate.everything().information.inverse());
  };
  const CameraErrors::Information narrow = everything();
  const CameraErrors::Information added = 0.01 * CameraErrors::Information::Identity();
  estimate.diffuse(added);
  CHECK((everything() - narrow - added).norm() < 1e-6);
}

}  // namespace
}  // namespace stereo_slam
