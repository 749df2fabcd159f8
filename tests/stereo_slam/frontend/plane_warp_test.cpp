// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/plane_warp.hpp"

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// A point of the road 1.65 m below a level camera, with the slope of its disparity.
StereoPlane road_at(const StereoCamera& camera, const Vector2<double>& px) {
  const double slope = camera.baseline_m / 1.65;
  return {{px.x(), px.y(), slope * (px.y() - camera.cy)}, {0.0, slope}};
}

/// The pixel of the source image for an offset in the target image.
Vector2<double> source_offset(const PatchWarp& warp, const Vector2<double>& target) {
  const Vector2<double> y = warp.linear * target;
  return y / (1.0 - warp.perspective.dot(y));
}

TEST_CASE("A plane's pixels in another view are where its points project to", "[stereo_slam][images]") {
  const StereoCamera camera = test::kitti_camera();
  for (const double forward_m : {0.0, 0.9, 4.0, -2.0}) {
    const Pose T_first_second = test::car_motion(forward_m);
    for (const Vector2<double>& px : {Vector2<double>(500.0, 260.0), Vector2<double>(900.0, 300.0)}) {
      StereoPlane plane = road_at(camera, px);
      plane.disparity_slope.x() = 0.05;  // a road that is not level
      const auto view = view_plane(plane, T_first_second, camera);
      REQUIRE(view);
      for (const Vector2<double>& offset :
           {Vector2<double>(0.0, 0.0), Vector2<double>(6.0, -3.0), Vector2<double>(-4.0, 7.0)}) {
        StereoPoint z = plane.z;
        z += StereoPoint(offset.x(), offset.y(), plane.disparity_slope.dot(offset));
        const auto seen = camera.project(T_first_second.inverse() * camera.back_project(z));
        REQUIRE(seen);
        const Vector2<double> left = seen->head<2>() - view->plane.z.head<2>();
        CHECK(seen->z() - view->plane.z.z() == Approx(view->plane.disparity_slope.dot(left)).margin(1e-9));
        CHECK((source_offset(view->left, left) - offset).norm() < 1e-9);
        const Vector2<double> right = left - Vector2<double>(seen->z() - view->plane.z.z(), 0.0);
        CHECK((source_offset(view->right, right) - offset).norm() < 1e-9);
      }
    }
  }
}

TEST_CASE("Planes behind the camera or just before it, without a disparity, or seen edge-on have no view",
          "[stereo_slam][images]") {
  const StereoCamera camera = test::kitti_camera();
  const StereoPlane plane{{600.0, 180.0, 40.0}};  // 9.7 m ahead
  CHECK(view_plane(plane, Pose::identity(), camera));
  CHECK_FALSE(view_plane(plane, test::car_motion(12.0), camera));
  CHECK_FALSE(view_plane(plane, Pose::exp((Vector6<double>() << 0, 0, 0, 0, 0, 9.64).finished()), camera));
  CHECK_FALSE(view_plane({{600.0, 180.0, -1.0}}, Pose::identity(), camera));
  CHECK_FALSE(view_plane({{600.0, 180.0, 40.0}, {1.0, 0.0}}, Pose::identity(), camera));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(view_plane({{600.0, 180.0, nan}}, Pose::identity(), camera));
  CHECK_FALSE(view_plane({{600.0, 180.0, 40.0}, {nan, 0.0}}, Pose::identity(), camera));
}

}  // namespace
}  // namespace stereo_slam
