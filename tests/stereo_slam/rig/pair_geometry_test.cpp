// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/pair_geometry.hpp"

#include <cmath>
#include <random>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("Measuring a point inverts its right position", "[stereo_slam][rectification]") {
  std::mt19937_64 random(1);
  const PairGeometry residual(test::kitti_camera(), test::planted_rectification());
  for (int i = 0; i < 20; ++i) {
    const StereoPoint z = test::random_measurement(random, test::kitti_camera(), 5.0, 80.0);
    const auto measured = residual.measure(residual.left_position(z), residual.right_position(z));
    CHECK((measured.z - z).norm() < 1e-12);
    CHECK(std::abs(measured.row_error_px) < 1e-12);
  }
}

TEST_CASE("The root mean square of an offset is that of its values over the image",
          "[stereo_slam][rectification]") {
  StereoCamera camera = test::kitti_camera();
  camera.cx = 0.5 * camera.width_px;
  camera.cy = 0.5 * camera.height_px;
  const PairGeometry residual(camera, test::planted_rectification());
  Vector2<double> sum = Vector2<double>::Zero();
  constexpr int kSteps = 200;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const Vector2<double> px((i + 0.5) / kSteps * camera.width_px, (j + 0.5) / kSteps * camera.height_px);
      sum += (residual.coefficients() * residual.basis(px)).cwiseAbs2();
    }
  }
  const Vector2<double> expected = (sum / (kSteps * kSteps)).cwiseSqrt();
  CHECK((residual.rms_offset_px() - expected).norm() < 1e-3);
}

}  // namespace
}  // namespace stereo_slam
