// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/associate.hpp"

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

Descriptor random_descriptor(std::mt19937_64& random) {
  Descriptor descriptor;
  for (auto& byte : descriptor) byte = static_cast<std::uint8_t>(random());
  return descriptor;
}

Feature feature_at(const Vector2<double>& px, const Descriptor& descriptor) {
  Feature feature;
  feature.position_px = px;
  feature.descriptor = descriptor;
  return feature;
}

/// Landmarks re-observed where they are expected, as features of both images.
struct FeatureScene {
  StereoCamera camera = test::kitti_camera();
  std::vector<Landmark> landmarks;
  std::vector<PredictedLandmark> predicted;
  std::vector<std::optional<Vector2<double>>> search_start_px;
  StereoFeatures features;

  MapView map() const { return {landmarks, camera}; }
};

FeatureScene make_scene(std::mt19937_64& random, int count) {
  FeatureScene scene;
  const StereoCamera& camera = scene.camera;
  for (int i = 0; i < count; ++i) {
    const StereoPoint z = test::random_measurement(random, camera, 6.0, 40.0);
    Landmark landmark = test::landmark_at(z, 0.3);
    landmark.descriptor = random_descriptor(random);
    scene.features.left.push_back(feature_at(z.head<2>(), landmark.descriptor));
    scene.features.right.push_back(feature_at({z.x() - z.z(), z.y()}, landmark.descriptor));
    scene.landmarks.push_back(landmark);
  }
  PoseGaussian pose;
  pose.covariance = 1e-6 * Matrix6<double>::Identity();
  scene.predicted = project_landmarks(scene.map(), pose, 140.0);
  for (const auto& p : scene.predicted) scene.search_start_px.emplace_back(p.z.head<2>());
  return scene;
}

TEST_CASE("Landmarks find their features in both images", "[stereo_slam][association]") {
  std::mt19937_64 random(1);
  const FeatureScene scene = make_scene(random, 100);
  const auto matches = associate(scene.predicted, scene.search_start_px, scene.map(), scene.features, {});
  REQUIRE(matches.size() >= 98);  // random neighbours may compete
  for (const auto& match : matches) {
    REQUIRE(match.left_feature);
    CHECK(*match.left_feature == match.landmark);
    CHECK((match.z - match.predicted.z).norm() < 0.05);
  }
}

TEST_CASE("Without flow, with another descriptor, or outside the ellipse, nothing matches",
          "[stereo_slam][association]") {
  std::mt19937_64 random(2);
  FeatureScene scene = make_scene(random, 30);
  for (auto& end_px : scene.search_start_px) end_px.reset();
  CHECK(associate(scene.predicted, scene.search_start_px, scene.map(), scene.features, {}).empty());

  scene = make_scene(random, 30);
  for (auto& landmark : scene.landmarks) landmark.descriptor = random_descriptor(random);
  CHECK(associate(scene.predicted, scene.search_start_px, scene.map(), scene.features, {}).empty());

  scene = make_scene(random, 30);
  for (auto& feature : scene.features.left) feature.position_px.y() += 15.0;
  CHECK(associate(scene.predicted, scene.search_start_px, scene.map(), scene.features, {}).empty());

  CHECK(associate({}, {}, FeatureScene{}.map(), {}, {}).empty());
}

TEST_CASE("Pairs that break the epipolar constraint are dropped", "[stereo_slam][association]") {
  std::mt19937_64 random(3);
  FeatureScene scene = make_scene(random, 30);
  for (auto& feature : scene.features.left) feature.position_px.y() += 1.5;
  for (auto& feature : scene.features.right) feature.position_px.y() -= 1.5;
  AssociationSettings settings;
  settings.max_row_error_px = 2.0;
  CHECK(associate(scene.predicted, scene.search_start_px, scene.map(), scene.features, settings).empty());
}

TEST_CASE("A feature serves the landmark that is most similar to it", "[stereo_slam][association]") {
  std::mt19937_64 random(4);
  FeatureScene scene = make_scene(random, 1);
  scene.landmarks.push_back(scene.landmarks.front());
  scene.landmarks.front().descriptor[0] ^= 0xFF;  // eight bits further away
  PredictedLandmark twin = scene.predicted.front();
  twin.index = 1;
  scene.predicted.push_back(twin);
  scene.search_start_px.push_back(scene.search_start_px.front());
  const auto matches = associate(scene.predicted, scene.search_start_px, scene.map(), scene.features, {});
  REQUIRE(matches.size() == 1);
  CHECK(matches.front().landmark == 1);
}

TEST_CASE("The flow gate keeps static points and drops what moves on its own", "[stereo_slam][association]") {
  const StereoCamera camera{200.0, 200.0, 100.0, 60.0, 0.5, 200, 120};
  const auto pyramids_of = [](cv::Point2d shift) {
    return StereoPyramid{FlowPyramid(test::texture_image({200, 120}, shift)), {}};
  };
  const StereoPyramid previous = pyramids_of({0.0, 0.0});
  const std::vector<Landmark> landmarks = {test::landmark_at({100.0, 60.0, 10.0}, 0.3)};
  const MapView map{landmarks, camera};
  // The camera moves left by 0.15 m: a static point at 10 m moves right by 3 px.
  Vector6<double> sideways = Vector6<double>::Zero();
  sideways[3] = -0.15;
  PoseGaussian pose;
  pose.pose = Pose::exp(sideways);
  const auto predicted = project_landmarks(map, pose, 140.0);
  REQUIRE(predicted.size() == 1);
  AssociationSettings settings;
  settings.flow_tolerance_px = 1.0;
  const auto search_start_px = [&](const StereoPyramid& current) {
    const auto flow = observe_flow(predicted, map, Pose::identity(), {previous, current}, {});
    return gate_by_flow(predicted, flow, {}, settings);
  };
  const auto end_px = search_start_px(pyramids_of({3.0, 0.0}));
  REQUIRE(end_px.size() == 1);
  REQUIRE(end_px[0]);
  CHECK((*end_px[0] - Vector2<double>(103.0, 60.0)).norm() < 0.1);

  CHECK_FALSE(search_start_px(pyramids_of({3.0, 4.0}))[0]);  // the object moves 4 px down, too
}

}  // namespace
}  // namespace stereo_slam
