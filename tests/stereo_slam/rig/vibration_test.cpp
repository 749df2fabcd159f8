// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/vibration.hpp"

#include <random>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// White displacements along the rows.
void add_white(Vibration& vibration, double sigma_px, int frames) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.0, sigma_px);
  for (int i = 0; i < frames; ++i) {
    ImageDisplacement::Coefficients displacement = ImageDisplacement::Coefficients::Zero();
    displacement[0] = normal(random);
    vibration.add(displacement);
  }
}

TEST_CASE("A rigid rig does not vibrate, and what lenses leave is no vibration", "[stereo_slam][slam]") {
  Vibration vibration;
  CHECK_FALSE(vibration.present());
  add_white(vibration, 0.15, 500);
  CHECK_FALSE(vibration.present());
}

TEST_CASE("A vibration is noticed within some frames, and ends", "[stereo_slam][slam]") {
  Vibration vibration;
  add_white(vibration, 0.5, 30);
  CHECK(vibration.present());
  CHECK_FALSE(vibration.rest());
  add_white(vibration, 0.05, 200);
  CHECK_FALSE(vibration.present());
}

TEST_CASE("A displacement surprises that is five sigma of its noise and of what is usual for the rig",
          "[stereo_slam][slam]") {
  const int term = GENERATE(0, 1, 2);
  DisplacementEstimate shown;
  shown.covariance = 0.05 * 0.05 * ImageDisplacement::Covariance::Identity();
  const auto surprises = [&](const Vibration& rig, double displacement_px) {
    shown.change.setZero();
    shown.change[term] = displacement_px;
    return rig.is_surprised_by(shown);
  };
  Vibration rig;
  CHECK_FALSE(surprises(rig, 0.24));
  CHECK(surprises(rig, -0.26));
  for (int i = 0; i < 60; ++i) rig.add(ImageDisplacement::Coefficients::Constant(i % 2 == 0 ? 0.12 : -0.12));
  CHECK_FALSE(surprises(rig, 0.6));  // .65 px: five times .13, the root of .05^2 + .12^2
  CHECK(surprises(rig, 0.7));
}

TEST_CASE("Only the displacements that are seen well can surprise", "[stereo_slam][slam]") {
  DisplacementEstimate shown;
  shown.covariance = 0.05 * 0.05 * ImageDisplacement::Covariance::Identity();
  shown.change[3] = shown.change[4] = 5.0;
  CHECK_FALSE(Vibration().is_surprised_by(shown));
}

ImageDisplacement::Coefficients along_rows(double px) {
  ImageDisplacement::Coefficients displacement = ImageDisplacement::Coefficients::Zero();
  displacement[0] = px;
  return displacement;
}

const ImageDisplacement::Covariance kNoise = 0.05 * 0.05 * ImageDisplacement::Covariance::Identity();

TEST_CASE("A jump of a rig that was rigid for twenty frames is held, and one of another rig is a vibration",
          "[stereo_slam][slam]") {
  Vibration vibration;
  const int frames = GENERATE(0, 18, 19, 100);  // before the jump; the first one is that of the start
  for (int i = 0; i < frames; ++i) vibration.add(along_rows(0.0));
  vibration.jump(along_rows(1.0), kNoise);
  CHECK(vibration.present() == (frames < 19));
  CHECK(vibration.held().displacement == along_rows(vibration.present() ? 0.0 : 1.0));
  CHECK(vibration.has_jumped() != vibration.present());
}

TEST_CASE("A second jump within twenty frames is a vibration", "[stereo_slam][slam]") {
  Vibration vibration;
  for (int i = 0; i < 30; ++i) vibration.add(along_rows(0.0));
  vibration.jump(along_rows(1.0), kNoise);
  vibration.add(along_rows(1.02));
  vibration.jump(along_rows(-0.5), kNoise);
  CHECK(vibration.present());
  CHECK(vibration.held().displacement.isZero(0.0));
}

TEST_CASE("A displacement that is held is the mean of those after the jump until a keyframe is taken",
          "[stereo_slam][slam]") {
  Vibration vibration;
  for (int i = 0; i < 30; ++i) vibration.add(along_rows(0.0));
  vibration.jump(along_rows(1.0), kNoise);
  CHECK(vibration.held().covariance.isApprox(kNoise));
  vibration.measure_held(along_rows(1.1), kNoise);
  CHECK((vibration.held().displacement - along_rows(1.05)).norm() < 1e-9);
  CHECK(vibration.held().covariance.isApprox(0.5 * kNoise));
  vibration.begin_keyframe();
  vibration.measure_held(along_rows(2.0), kNoise);
  CHECK((vibration.held().displacement - along_rows(1.05)).norm() < 1e-9);
}

TEST_CASE("A jump of a rig whose displacements vary is less certain by their mean square",
          "[stereo_slam][slam]") {
  Vibration vibration;
  for (int i = 0; i < 200; ++i) vibration.add(along_rows(i % 2 == 0 ? 0.1 : -0.1));
  vibration.jump(along_rows(1.0), kNoise);
  CHECK(vibration.held().covariance(0, 0) == Approx(0.05 * 0.05 + 0.1 * 0.1).epsilon(0.01));
  CHECK(vibration.held().covariance(1, 1) == Approx(0.05 * 0.05));
}

TEST_CASE("A right image has come to rest in the frame after a jump, and settles there",
          "[stereo_slam][slam]") {
  Vibration vibration;
  for (int i = 0; i < 30; ++i) vibration.add(along_rows(0.0));
  CHECK_FALSE(vibration.rest());
  vibration.jump(along_rows(1.0), kNoise);
  CHECK_FALSE(vibration.rest());
  vibration.add(along_rows(1.02));
  REQUIRE(vibration.rest());
  CHECK(*vibration.rest() == along_rows(1.0));
  vibration.settle();
  CHECK_FALSE(vibration.rest());
  CHECK(vibration.held().displacement.isZero(0.0));
  CHECK(vibration.mean_square_px2().maxCoeff() < 0.01 * 0.01);
}

TEST_CASE("A right image that comes back to its place has not been turned", "[stereo_slam][slam]") {
  Vibration vibration;
  vibration.jump(ImageDisplacement::Coefficients::Zero(), kNoise);
  for (int i = 0; i < 39; ++i) vibration.add(ImageDisplacement::Coefficients::Constant(0.1));
  CHECK(vibration.present());
  for (int i = 0; i < 60; ++i) {
    vibration.add(ImageDisplacement::Coefficients::Constant(0.1));
    CHECK_FALSE(vibration.rest());
  }
  CHECK_FALSE(vibration.present());
}

TEST_CASE("A right image that rests at another place has been turned", "[stereo_slam][slam]") {
  Vibration vibration;
  vibration.jump(ImageDisplacement::Coefficients::Zero(), kNoise);
  ImageDisplacement::Coefficients displacement = ImageDisplacement::Coefficients::Zero();
  displacement[0] = 2.0;
  for (int i = 0; i < 59; ++i) vibration.add(displacement);
  CHECK_FALSE(vibration.rest());
  vibration.add(displacement);
  REQUIRE(vibration.rest());
  CHECK((*vibration.rest() - displacement).norm() < 1e-9);
}

}  // namespace
}  // namespace stereo_slam
