// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/lens_residual.hpp"

#include "stereo_slam/rig/pair_geometry.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// About those of KITTI, px.
const LensResidual::Coefficients kLens(-13.0, 7.0);

TEST_CASE("The position in the image is the inverse of the corrected one", "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  const LensResidual lens(camera, GENERATE(kLens, LensResidual::Coefficients(40.0, -40.0)));
  for (double u = 0.0; u < camera.width_px; u += 50.0) {
    for (double v = 0.0; v < camera.height_px; v += 50.0) {
      const Vector2<double> px(u, v);
      CHECK((lens.in_image(lens.corrected(px)) - px).norm() < 1e-3);
    }
  }
}

TEST_CASE("An exact lens moves no point by a bit", "[stereo_slam][rectification]") {
  const LensResidual lens(test::kitti_camera());
  const Vector2<double> px(12.3, 345.6);
  CHECK(lens.corrected(px) == px);
  CHECK(lens.in_image(px) == px);
  CHECK(LensResidual().corrected(px) == px);
}

TEST_CASE("Coefficients of the lens are shifts at the side borders, and k1 and k2 those of the usual model",
          "[stereo_slam][rectification]") {
  const StereoCamera camera = test::kitti_camera();
  const LensResidual lens(camera, kLens);
  const Vector2<double> border(camera.cx + 0.5 * camera.width_px, camera.cy);
  CHECK((lens.corrected(border) - border - Vector2<double>(kLens.sum(), 0.0)).norm() < 1e-9);
  const Vector2<double> px(900.0, 60.0);
  const Vector2<double> ray((px.x() - camera.cx) / camera.fx, (px.y() - camera.cy) / camera.fy);
  const double r2 = ray.squaredNorm();
  const Vector2<double> moved = ray * (1.0 + lens.k()[0] * r2 + lens.k()[1] * r2 * r2);
  const Vector2<double> expected(camera.fx * moved.x() + camera.cx, camera.fy * moved.y() + camera.cy);
  CHECK((lens.corrected(px) - expected).norm() < 1e-9);
}

TEST_CASE("Measurements with a lens error are those of exact cameras", "[stereo_slam][rectification]") {
  std::mt19937_64 random(1);
  PairGeometry::Coefficients offset = PairGeometry::Coefficients::Zero();
  offset.col(0) << 0.4, -0.3;
  offset(0, 3) = 0.5;
  ImageDisplacement::Coefficients displacement;
  displacement << 1.0, -0.3, 0.4, 0.2, -0.1;
  PairGeometry residual(test::kitti_camera(), offset, kLens);
  const bool displaced = GENERATE(false, true);
  if (displaced) residual = residual.displaced(displacement);
  for (int i = 0; i < 20; ++i) {
    const StereoPoint z = test::random_measurement(random, test::kitti_camera(), 4.0, 80.0);
    const auto measured = residual.measure(residual.left_position(z), residual.right_position(z));
    CHECK((measured.z - z).norm() < 2e-3);
    CHECK((measured.left_px - residual.left_position(z)).norm() == 0.0);
    CHECK(std::abs(measured.row_error_px) < 2e-3);
  }
}

}  // namespace
}  // namespace stereo_slam
