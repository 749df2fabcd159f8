// SPDX-License-Identifier: MIT
#include <vector>

#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

Landmark landmark_at(std::uint32_t id, const Vector3<double>& position, std::size_t last_seen) {
  Landmark landmark;
  landmark.id = id;
  landmark.mean = test::kitti_camera().project(position).value();
  landmark.last_px = {11.0, 12.0};
  landmark.last_seen = last_seen;
  landmark.observations = 7;
  return landmark;
}

TEST_CASE("Tracks are the landmarks in view: where they were found, or else where they should be",
          "[stereo_slam][map]") {
  const StereoCamera camera = test::kitti_camera();
  const std::vector<Landmark> landmarks{landmark_at(1, {0.0, 0.0, 12.0}, 5),
                                        landmark_at(2, {0.0, 0.0, 22.0}, 4),
                                        landmark_at(3, {0.0, 0.0, 1.0}, 4),     // behind the camera now
                                        landmark_at(4, {90.0, 0.0, 12.0}, 4)};  // beside the image
  const Pose T_keyframe_camera =
      Pose::from_rotation_translation(antipode::Vector4<double>(1, 0, 0, 0), Vector3<double>(0, 0, 2));
  const auto tracks = tracks_in_view({landmarks, camera}, T_keyframe_camera, 5);
  REQUIRE(tracks.size() == 2);
  CHECK(tracks[0].id == 1);
  CHECK(tracks[0].found);
  CHECK(tracks[0].left_px == Vector2<double>(11.0, 12.0));
  CHECK(tracks[0].depth_m == Approx(10.0));
  CHECK(tracks[0].observations == 7);
  CHECK(tracks[1].id == 2);
  CHECK_FALSE(tracks[1].found);
  CHECK(tracks[1].left_px.x() == Approx(camera.cx));
  CHECK(tracks[1].depth_m == Approx(20.0));
}

}  // namespace
}  // namespace stereo_slam
