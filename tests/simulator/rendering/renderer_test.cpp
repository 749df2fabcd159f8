// SPDX-License-Identifier: MIT
#include "simulator/rendering/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "simulator/textures/random.hpp"
#include "support/catch.hpp"

using namespace stereo_slam::simulator;
using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

const PinholeCamera kSmallCamera{200, 140, 150.0, 155.0, 97.3, 71.8};

std::shared_ptr<const Texture> even_texture(int grey) {
  return std::make_shared<const Texture>(cv::Mat1b(1, 1, static_cast<std::uint8_t>(grey)));
}

/// Parallelogram p, p + a, p + a + b, p + b; visible from the side a x b, u along a, v along b, both 0 .. 1.
Face parallelogram(const Vector3d& p, const Vector3d& a, const Vector3d& b, MaterialId material) {
  Face face;
  face.corners = {p.cast<float>(), (p + a).cast<float>(), (p + a + b).cast<float>(), (p + b).cast<float>()};
  face.u_axis = (a / a.squaredNorm()).cast<float>();
  face.v_axis = (b / b.squaredNorm()).cast<float>();
  face.u_offset = static_cast<float>(-a.dot(p) / a.squaredNorm());
  face.v_offset = static_cast<float>(-b.dot(p) / b.squaredNorm());
  face.material = material;
  return face;
}

/// Scene without haze in front of black.
Scene dark_scene(const std::vector<Face>& faces) {
  Scene scene;
  scene.horizon_grey = 0.0F;
  scene.haze_distance_m = 1e12;
  for (const int grey : {255, 100, 200}) {
    Material material;
    material.detail = even_texture(grey);
    material.two_sided = true;
    scene.materials.push_back(material);
  }
  scene.chunks = make_chunks(faces, 10.0);
  return scene;
}

Vector2d project(const Vector3d& p_camera) {
  return {kSmallCamera.fx * p_camera.x() / p_camera.z() + kSmallCamera.cx,
          kSmallCamera.fy * p_camera.y() / p_camera.z() + kSmallCamera.cy};
}

struct Shape {
  double area = 0.0;
  Vector2d centroid = Vector2d::Zero();
};

/// Area and centroid of a polygon in the image.
Shape polygon_shape(const std::vector<Vector2d>& outline) {
  Shape shape;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2d& a = outline[i];
    const Vector2d& b = outline[(i + 1) % outline.size()];
    const double cross = a.x() * b.y() - a.y() * b.x();
    shape.area += 0.5 * cross;
    shape.centroid += cross * (a + b) / 6.0;
  }
  shape.centroid /= shape.area;
  shape.area = std::abs(shape.area);
  return shape;
}

/// The same of an image of a white shape on black; pixel centres have integer coordinates.
Shape shape_in_image(const cv::Mat1f& image) {
  Shape shape;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double share = static_cast<double>(image(y, x)) / 255.0;
      shape.area += share;
      shape.centroid += share * Vector2d(x, y);
    }
  }
  shape.centroid /= shape.area;
  return shape;
}

Isometry3d random_pose(Random& random) {
  const Vector3d axis =
      Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)).normalized();
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(random.uniform(0.0, 3.0), axis).toRotationMatrix();
  pose.translation() = 300.0 * Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  return pose;
}

double largest_difference(const cv::Mat1f& a, const cv::Mat1f& b) { return cv::norm(a, b, cv::NORM_INF); }

}  // namespace

TEST_CASE("A marker is drawn where the pinhole model puts it", "[simulate][renderer]") {
  const int samples = GENERATE(4, 8, 16);
  Random random(17);
  double worst = 0.0;
  Vector2d mean = Vector2d::Zero();
  constexpr int kMarkers = 60;
  for (int i = 0; i < kMarkers; ++i) {
    const Isometry3d T_world_camera = random_pose(random);
    const Vector3d centre_camera =
        random.uniform(3.0, 60.0) * Vector3d(random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.3), 1.0);
    const double side = 0.12 * centre_camera.z();  // some 18 pixels
    const Vector3d centre = T_world_camera * centre_camera;
    const Eigen::Matrix3d tilt =
        Eigen::AngleAxisd(random.uniform(0.0, 0.9), Vector3d::UnitX()).toRotationMatrix() *
        Eigen::AngleAxisd(random.uniform(0.0, 6.0), Vector3d::UnitZ()).toRotationMatrix();
    const Vector3d a = T_world_camera.linear() * tilt * Vector3d::UnitX() * side;
    const Vector3d b = T_world_camera.linear() * tilt * Vector3d::UnitY() * side;
    const Face marker = parallelogram(centre - 0.5 * (a + b), a, b, 0);
    const Scene scene = dark_scene({marker});

    std::vector<Vector2d> outline;
    for (const auto& corner : marker.corners) {
      outline.push_back(project(T_world_camera.inverse() * corner.cast<double>()));
    }
    const Shape expected = polygon_shape(outline);
    const Shape drawn = shape_in_image(Renderer(scene, kSmallCamera, samples).render(T_world_camera));
    const Vector2d error = drawn.centroid - expected.centroid;
    worst = std::max(worst, error.cwiseAbs().maxCoeff());
    mean += error / kMarkers;
    CHECK(std::abs(drawn.area / expected.area - 1.0) < 0.02);
  }
  // An edge that runs along the pixels is quantised to 1/samples of a pixel, and so is, at most half a step
  // wrong, the middle between two of them. Other edges average out.
  CAPTURE(samples, worst, mean.transpose());
  CHECK(worst < 0.5 / samples);
  CHECK(mean.norm() < 0.1 / samples);
  if (samples >= 8) CHECK(worst < 0.05);
}

TEST_CASE("A smooth texture is drawn at its exact perspective position", "[simulate][renderer]") {
  // Every pixel shows the wave at the point where its central ray meets the slanted plane.
  constexpr int kSize = 512;
  constexpr int kCycles = 8;
  const auto wave = [](double u) { return 127.0 + 100.0 * std::sin(2.0 * std::numbers::pi * kCycles * u); };
  cv::Mat1b image(kSize, kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) image(y, x) = cv::saturate_cast<std::uint8_t>(wave((x + 0.5) / kSize));
  }
  const Vector3d p(-30.0, -20.0, 5.0);
  const Vector3d a(60.0, 0.0, 14.0);
  const Vector3d b(0.0, 40.0, 9.0);
  Random random(3);
  const Isometry3d T_world_camera = random_pose(random);
  Scene scene = dark_scene(
      {parallelogram(T_world_camera * p, T_world_camera.linear() * a, T_world_camera.linear() * b, 0)});
  scene.materials[0].detail = std::make_shared<const Texture>(image);
  const cv::Mat1f drawn = Renderer(scene, kSmallCamera, 8).render(T_world_camera);

  const Vector3d normal = a.cross(b);
  double worst = 0.0;
  double weighted_error = 0.0;
  double weights = 0.0;
  for (int y = 0; y < kSmallCamera.height_px; y += 3) {
    for (int x = 0; x < kSmallCamera.width_px; x += 3) {
      const auto u_at = [&](double column) {
        const Vector3d ray((column - kSmallCamera.cx) / kSmallCamera.fx,
                           (y - kSmallCamera.cy) / kSmallCamera.fy, 1.0);
        return a.dot(normal.dot(p) / normal.dot(ray) * ray - p) / a.squaredNorm();
      };
      const double slope = wave(u_at(x + 0.5)) - wave(u_at(x - 0.5));  // grey levels a pixel
      const double error = static_cast<double>(drawn(y, x)) - wave(u_at(x));
      worst = std::max(worst, std::abs(error));
      weighted_error += slope * error;
      weights += slope * slope;
    }
  }
  // Texels are rounded to a level, their weights to 2^-8 of neighbours that differ by ten levels; the mean
  // over a pixel, some tenth of a radian of the wave, is (0.1)^2 / 6 of the amplitude below its crests.
  CHECK(worst < 2.0);
  CHECK(std::abs(weighted_error / weights) < 0.005);  // the shift, px, that explains the errors best
}

TEST_CASE("The right image shows a plane moved by the disparity", "[simulate][renderer]") {
  constexpr double kBaseline_m = 0.54;
  const double depth = kSmallCamera.fx * kBaseline_m / 5.0;  // 5 px
  cv::Mat1b noise(64, 64);
  cv::RNG(4).fill(noise, cv::RNG::UNIFORM, 0, 256);
  Scene scene = dark_scene({parallelogram({-30.0, -25.0, depth}, {60.0, 0.0, 0.0}, {0.0, 50.0, 0.0}, 0)});
  scene.materials[0].detail = std::make_shared<const Texture>(noise);
  Renderer renderer(scene, kSmallCamera, 4);
  const cv::Mat1f left = renderer.render(Isometry3d::Identity());
  const cv::Mat1f right = renderer.render(Isometry3d(Eigen::Translation3d(kBaseline_m, 0.0, 0.0)));
  const cv::Rect overlap(5, 0, kSmallCamera.width_px - 5, kSmallCamera.height_px);
  // The texture's coordinates are rounded to 2^-8 of a texel of at most 255 levels.
  CHECK(largest_difference(left(overlap), right(overlap - cv::Point(5, 0))) < 2.5);
}

TEST_CASE("The nearer face hides the farther one in either order", "[simulate][renderer]") {
  const Face near = parallelogram({-1.0, -1.0, 4.0}, {2.0, 0.0, 0.0}, {0.0, 2.0, 0.0}, 1);
  const Face far = parallelogram({-20.0, -20.0, 9.0}, {40.0, 0.0, 0.0}, {0.0, 40.0, 0.0}, 2);
  for (const auto& faces : {std::vector{near, far}, std::vector{far, near}}) {
    const cv::Mat1f image = Renderer(dark_scene(faces), kSmallCamera, 8).render(Isometry3d::Identity());
    CHECK(image(72, 97) == Approx(100.0));
    CHECK(image(5, 5) == Approx(200.0));
  }
}

TEST_CASE("Faces that intersect are cut along their common line", "[simulate][renderer]") {
  const Face upright = parallelogram({-20.0, -20.0, 10.0}, {40.0, 0.0, 0.0}, {0.0, 40.0, 0.0}, 1);
  const Face slanted =
      parallelogram({-20.0, -20.0, 5.0}, {40.0, 0.0, 10.0}, {0.0, 40.0, 0.0}, 2);  // z = 10 at x = 0
  const cv::Mat1f image =
      Renderer(dark_scene({upright, slanted}), kSmallCamera, 16).render(Isometry3d::Identity());
  for (int y = 0; y < image.rows; y += 10) {
    CHECK(image(y, 96) == Approx(200.0));  // the slanted one is nearer on the left of cx = 97.3
    CHECK(image(y, 99) == Approx(100.0));
  }
}

TEST_CASE("A mesh of faces that share edges has no holes and no doubled pixels", "[simulate][renderer]") {
  Random random(23);
  std::vector<Face> faces;
  constexpr int kCells = 12;
  const auto node = [&](int i, int j) {
    return Vector3d(-9.0 + 1.5 * i, -6.0 + 1.0 * j, 8.0 + 0.3 * std::sin(1.7 * i + j));
  };
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      for (const bool upper : {false, true}) {
        Face face = parallelogram(node(i, j), Vector3d::UnitX(), Vector3d::UnitY(), 1);
        face.corner_count = 3;
        face.corners = {node(i, j).cast<float>(),
                        node(i + 1, upper ? j + 1 : j).cast<float>(),
                        node(upper ? i : i + 1, j + 1).cast<float>(),
                        {}};
        faces.push_back(face);
      }
    }
  }
  const PinholeCamera camera{150, 90, 100.0, 100.0, 75.2, 44.9};
  const Scene scene = dark_scene(faces);
  for (int i = 0; i < 20; ++i) {
    Isometry3d pose = Isometry3d::Identity();
    pose.translation() << random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-1.0, 1.0);
    const cv::Mat1f image = Renderer(scene, camera, 8).render(pose);
    for (const float grey : image(cv::Rect(20, 20, 110, 50))) REQUIRE(grey == Approx(100.0));
  }
}

TEST_CASE("A face is visible from its front only, unless it is two-sided", "[simulate][renderer]") {
  const Face facing = parallelogram({-9.0, 9.0, 5.0}, {18.0, 0.0, 0.0}, {0.0, -18.0, 0.0}, 0);
  const Face averted = parallelogram({-9.0, -9.0, 5.0}, {18.0, 0.0, 0.0}, {0.0, 18.0, 0.0}, 0);
  Scene scene = dark_scene({facing});
  scene.materials[0].two_sided = false;
  CHECK(Renderer(scene, kSmallCamera, 4).render(Isometry3d::Identity())(70, 100) == Approx(255.0));
  scene.chunks = make_chunks({averted}, 10.0);
  CHECK(Renderer(scene, kSmallCamera, 4).render(Isometry3d::Identity())(70, 100) == 0.0F);
  scene.materials[0].two_sided = true;
  CHECK(Renderer(scene, kSmallCamera, 4).render(Isometry3d::Identity())(70, 100) == Approx(255.0));
}

TEST_CASE("Faces around, behind and across the camera are drawn correctly", "[simulate][renderer]") {
  // A floor that passes below the camera and behind it: below the horizon everything is floor.
  const Face floor = parallelogram({-500.0, 1.5, -500.0}, {1000.0, 0.0, 0.0}, {0.0, 0.0, 1000.0}, 0);
  const Face behind = parallelogram({-5.0, -5.0, -3.0}, {10.0, 0.0, 0.0}, {0.0, 10.0, 0.0}, 1);
  const cv::Mat1f image =
      Renderer(dark_scene({floor, behind}), kSmallCamera, 8).render(Isometry3d::Identity());
  for (int x = 0; x < image.cols; x += 7) {
    CHECK(image(60, x) == 0.0F);
    CHECK(image(75, x) == Approx(255.0));
    CHECK(image(image.rows - 1, x) == Approx(255.0));
  }
  Face degenerate = floor;
  degenerate.corners.fill(Eigen::Vector3f(0.0F, 0.0F, 5.0F));
  CHECK(largest_difference(
            Renderer(dark_scene({floor, degenerate}), kSmallCamera, 8).render(Isometry3d::Identity()),
            image) == 0.0);
}

TEST_CASE("Holes let the background through in proportion to the opacity", "[simulate][renderer]") {
  Face screen = parallelogram({-9.0, -9.0, 5.0}, {18.0, 0.0, 0.0}, {0.0, 18.0, 0.0}, 0);
  for (const int opacity : {0, 64, 128, 255}) {
    Scene scene = dark_scene({screen});
    scene.materials[0].opacity = even_texture(opacity);
    const cv::Mat1f image = Renderer(scene, kSmallCamera, 8).render(Isometry3d::Identity());
    CHECK(std::abs(cv::mean(image(cv::Rect(50, 50, 60, 40)))[0] - opacity) < 255.0 / 16.0 + 1.0);
  }
}

TEST_CASE("Distance fades into haze and shadow darkens the ground", "[simulate][renderer]") {
  const Face wall = parallelogram({-90.0, -90.0, 50.0}, {180.0, 0.0, 0.0}, {0.0, 180.0, 0.0}, 1);
  Scene scene = dark_scene({wall});
  scene.haze_distance_m = 50.0;
  scene.horizon_grey = 200.0F;
  CHECK(Renderer(scene, kSmallCamera, 4).render(Isometry3d::Identity())(70, 100) ==
        Approx(150.0).epsilon(1e-4));

  scene = dark_scene({parallelogram({-20.0, 1.5, 0.0}, {40.0, 0.0, 0.0}, {0.0, 0.0, 40.0}, 1)});
  scene.materials[1].takes_shadow = true;
  cv::Mat1b map(64, 64, std::uint8_t{255});
  map.colRange(0, 32).setTo(0);  // x < 0
  scene.sunlight = {std::make_shared<const Texture>(map), {-20.0, 0.0}, 40.0, 0.4F};
  const cv::Mat1f image = Renderer(scene, kSmallCamera, 4).render(Isometry3d::Identity());
  CHECK(image(110, 40) == Approx(40.0));
  CHECK(image(110, 160) == Approx(100.0));
}

TEST_CASE("The renderer rejects impossible cameras and sample counts", "[simulate][renderer]") {
  const Scene scene = dark_scene({});
  CHECK_THROWS_AS(Renderer(scene, kSmallCamera, 5), std::invalid_argument);
  CHECK_THROWS_AS(Renderer(scene, PinholeCamera{0, 10, 1.0, 1.0, 0.0, 0.0}, 4), std::invalid_argument);
  CHECK_THROWS_AS(Renderer(scene, PinholeCamera{10, 10, -1.0, 1.0, 0.0, 0.0}, 4), std::invalid_argument);
  const cv::Mat1f empty = Renderer(scene, kSmallCamera, 4).render(Isometry3d::Identity());
  CHECK(cv::countNonZero(empty) == 0);
}
