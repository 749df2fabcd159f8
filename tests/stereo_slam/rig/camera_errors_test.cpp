// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/camera_errors.hpp"

#include <cmath>
#include <random>

#include <Eigen/LU>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

using Coefficients = CameraErrors::Coefficients;
using Evidence = CameraErrors::EvidenceOfBoth;

constexpr double kWidest_px = 0.7;
constexpr double kExpected_px = 0.03;

[[nodiscard]] const ErrorTerms::ByDisplacement& by_displacement() {
  static const ErrorTerms::ByDisplacement result = DisplacementTerms(test::kitti_camera()).disparity;
  return result;
}

[[nodiscard]] Coefficients offset(double constant_px, double square_px) {
  Coefficients coefficients = Coefficients::Zero();
  coefficients[0] = constant_px;
  coefficients[3] = square_px;
  return coefficients;
}

/// What motions show if they measure the coefficients at random places of the image, and the displacement
/// between their frames with the same noise.
class Motions {
 public:
  Evidence next(const Coefficients& truth, const ImageDisplacement::Coefficients& displacement =
                                               ImageDisplacement::Coefficients::Zero()) {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> place(-1.0, 1.0);
    Evidence evidence;
    antipode::Vector<double, ErrorTerms::kBoth> both;
    both << truth, displacement;
    for (int i = 0; i < 50; ++i) {
      const double x = place(random_), y = place(random_);
      antipode::Matrix<double, 2, ErrorTerms::kBoth> terms = decltype(terms)::Zero();  // not of the lenses
      terms.row(0).head<CameraErrors::kOffsetTerms>() << 1.0, x, y, x * x, x * y, y * y, x * x * x, x * x * y,
          x * y * y, y * y * y;
      terms.row(1).tail<ImageDisplacement::kTerms>() << 1.0, 0.0, y, x * x, x * y;
      const Vector2<double> measured_px =
          terms * both + kNoise_px * Vector2<double>(normal(random_), normal(random_));
      evidence.information += terms.transpose() * terms / (kNoise_px * kNoise_px);
      evidence.vector += terms.transpose() * measured_px / (kNoise_px * kNoise_px);
    }
    return evidence;
  }

 private:
  static constexpr double kNoise_px = 1.0;
  std::mt19937_64 random_{1};
};

[[nodiscard]] CameraErrors exact_calibration() {
  CameraErrors estimate(kWidest_px, by_displacement());
  estimate.expect(kExpected_px, kExpected_px);
  return estimate;
}

void drive(CameraErrors& estimate, Motions& motions, const Coefficients& truth, int count) {
  for (int i = 0; i < count; ++i) estimate.add(motions.next(truth), estimate.estimate().mean());
}

TEST_CASE("The prior of an exact calibration resists noise", "[stereo_slam][rectification]") {
  CameraErrors estimate = exact_calibration();
  Motions motions;
  drive(estimate, motions, Coefficients::Zero(), 200);
  CHECK_FALSE(estimate.has_large_error());
  CHECK(estimate.drift_sigma_px() <= 0.003);
  CHECK(estimate.estimate().mean().cwiseAbs().maxCoeff() < 0.05);
}

TEST_CASE("A wrong column is learned whatever the rows show, and was there from the start",
          "[stereo_slam][rectification]") {
  const double column_px = GENERATE(-20.0, -5.0, 0.5, 5.0);
  CAPTURE(column_px);
  CameraErrors estimate = exact_calibration();
  Motions motions;
  drive(estimate, motions, offset(column_px, 0.0), 100);
  CHECK(estimate.has_large_error());
  CHECK((estimate.estimate().mean() - offset(column_px, 0.0)).cwiseAbs().maxCoeff() < 0.1);
  for (const auto& errors : estimate.history()) CHECK(std::abs(errors.mean[0] - column_px) < 0.1);
}

TEST_CASE("A rig that drifts is followed, and so is one that comes to rest", "[stereo_slam][rectification]") {
  constexpr double kDrift_px = 0.02;  // from motion to motion
  constexpr int kCount = 150;
  ImageDisplacement::Coefficients displacement = ImageDisplacement::Coefficients::Zero();
  displacement[0] = kDrift_px;
  CameraErrors estimate = exact_calibration();
  Motions motions;
  std::vector<Coefficients> truth;
  drive(estimate, motions, Coefficients::Zero(), kCount);
  for (int i = 0; i < kCount; ++i) {
    truth.push_back(i * by_displacement() * displacement);
    estimate.add(motions.next(truth.back(), displacement), estimate.estimate().mean());
  }
  CHECK(estimate.drift_sigma_px() >= 0.01);
  CHECK(estimate.drift_sigma_px() <= 0.1);
  CHECK(std::abs(estimate.estimate().mean()[0] - kCount * kDrift_px) < 0.4);
  const auto history = estimate.history();
  REQUIRE(history.size() == 2 * kCount);
  CHECK(std::abs(history.front().mean[0]) < 0.2);
  int inside = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const ErrorsDuring& errors = history[kCount + i];
    CHECK(std::abs(errors.mean[0] - truth[i][0]) < 0.4);
    inside += std::abs(errors.mean[0] - truth[i][0]) < 2.0 * std::sqrt(errors.covariance(0, 0));
  }
  CHECK(inside >= 0.9 * kCount);
  const double sigma_px = std::sqrt(estimate.estimate().covariance()(0, 0));
  drive(estimate, motions, kCount * by_displacement() * displacement, 3 * kCount);
  CHECK(estimate.drift_sigma_px() <= 0.003);
  CHECK(std::abs(estimate.estimate().mean()[0] - kCount * kDrift_px) < 0.1);
  CHECK(std::sqrt(estimate.estimate().covariance()(0, 0)) < 0.5 * sigma_px);
}

TEST_CASE("A turn that nothing told is followed, and stays away from the motions before it",
          "[stereo_slam][rectification]") {
  const double expected_px = GENERATE(kExpected_px, kWidest_px);  // an exact calibration, and any
  CAPTURE(expected_px);
  CameraErrors estimate(kWidest_px, by_displacement());
  estimate.expect(expected_px, expected_px);
  Motions motions;
  constexpr std::size_t kCount = 40;
  const Coefficients turn = offset(2.0, 1.5);
  for (int part = 0; part < 3; ++part) {  // the second turn is back
    const Coefficients truth = part == 1 ? turn : Coefficients::Zero();
    drive(estimate, motions, truth, kCount);
    CAPTURE(part);
    CHECK((estimate.estimate().mean() - truth).cwiseAbs().maxCoeff() < 0.5);
    if (part == 0) continue;
    const auto history = estimate.history();
    CHECK((history[part * kCount - 20].coefficients() - (turn - truth)).cwiseAbs().maxCoeff() < 0.5);
  }
}

TEST_CASE("A displacement from the start does not hide a later turn", "[stereo_slam][rectification]") {
  CameraErrors estimate = exact_calibration();
  Motions motions;
  drive(estimate, motions, offset(-2.0, 0.0), 40);
  drive(estimate, motions, offset(0.5, 0.0), 40);
  CHECK(std::abs(estimate.history().front().mean[0] + 2.0) < 0.2);
  CHECK(std::abs(estimate.estimate().mean()[0] - 0.5) < 0.3);
}

TEST_CASE("What a movement of the right camera does not change stays known", "[stereo_slam][rectification]") {
  CameraErrors estimate(kWidest_px, by_displacement());
  estimate.expect(kWidest_px, kWidest_px);
  Motions motions;
  Coefficients truth = Coefficients::Zero();
  truth[4] = 1.4;  // x y
  drive(estimate, motions, truth, 40);
  const auto variance = [&](int term) { return estimate.estimate().covariance()(term, term); };
  const double known = variance(4), constant = variance(0);
  estimate.forget(1.0);
  CHECK(variance(4) < 1.2 * known);
  CHECK(variance(0) > 2.0 * constant);
  CHECK(std::abs(estimate.estimate().mean()[4] - 1.4) < 0.3);
}

TEST_CASE("A resumed estimate does not learn a large error anew", "[stereo_slam][rectification]") {
  CameraErrors estimate = exact_calibration();
  Motions motions;
  drive(estimate, motions, offset(-5.0, 0.0), 60);
  CameraErrors resumed = exact_calibration();
  resumed.resume(estimate.everything(), estimate.has_large_error());
  CHECK(resumed.estimate().mean().isApprox(estimate.estimate().mean(), 1e-3));
  drive(resumed, motions, offset(-5.0, 0.0), 20);
  CHECK(std::abs(resumed.estimate().mean()[0] + 5.0) < 0.1);
}

TEST_CASE("What motions showed before the right camera moved stays with them",
          "[stereo_slam][rectification]") {
  CameraErrors estimate = exact_calibration();
  Motions motions;
  constexpr int kBefore = 60, kAfter = 40;
  drive(estimate, motions, offset(-5.0, 0.0), kBefore);
  const Coefficients before = estimate.estimate().mean();
  estimate.forget(1.0);
  for (int i = 0; i < kAfter; ++i) estimate.add_displaced(motions.next(offset(-4.0, 0.0)));
  CHECK(std::abs(estimate.estimate().mean()[0] + 4.0) < 0.15);
  const auto history = estimate.history();
  CHECK(std::abs(history[kBefore - 1].mean[0] - before[0]) < 0.02);
  CHECK(std::abs(history[kBefore].mean[0] + 4.0) < 0.15);
}

TEST_CASE("After a shift the estimate goes on with what was known", "[stereo_slam][rectification]") {
  const Coefficients small = offset(0.05, 0.0), change = offset(3.0, 1.0);
  CameraErrors shifted = exact_calibration(), still = exact_calibration();
  Motions with_shift, without;
  drive(shifted, with_shift, small, 20);
  drive(still, without, small, 20);
  shifted.shift(change);
  CHECK(shifted.has_large_error());
  drive(shifted, with_shift, small + change, 40);
  drive(still, without, small, 40);
  CHECK((shifted.estimate().mean() - still.estimate().mean() - change).norm() < 1e-9);
  CHECK(shifted.estimate().information.isApprox(still.estimate().information, 1e-12));
  const auto history = shifted.history(), without_shift = still.history();
  for (std::size_t i : {0, 19, 20, 59}) {
    const Coefficients expected = without_shift[i].coefficients() + (i < 20 ? 0.0 : 1.0) * change;
    CHECK((history[i].coefficients() - expected).norm() < 1e-9);
  }
}

TEST_CASE("A shift moves the estimate, and diffusion widens it by its covariance",
          "[stereo_slam][rectification]") {
  CameraErrors estimate = exact_calibration();
  Motions motions;
  drive(estimate, motions, offset(-5.0, 0.0), 60);
  const Coefficients before = estimate.estimate().mean();
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
