// SPDX-License-Identifier: MIT
#include "simulator/world/world.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <opencv2/features2d.hpp>
#include <opencv2/video/tracking.hpp>

#include "simulator/rendering/renderer.hpp"
#include "simulator/world/camera_path.hpp"
#include "simulator/world/traffic.hpp"
#include "support/catch.hpp"

using namespace stereo_slam::simulator;
using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kFps = 10.0;
const PinholeCamera kCamera{621, 188, 359.4, 359.4, 303.3, 92.4};  // KITTI's at half its size
const WorldSettings kSettings{.seed = 5, .camera_height_m = 1.65, .texture_size_px = 256, .street = {}};

/// One world for all tests that only look at it: 300 frames of the built-in drive, a lap of one block and
/// more.
const CameraPath& loop_path() {
  static const CameraPath path = street_loop(300, kFps);
  return path;
}
const World& loop_world() {
  static const World world(loop_path(), kSettings);
  return world;
}

cv::Mat1b rendered(Renderer& renderer, const Isometry3d& T_world_camera,
                   const std::vector<Face>& moving = {}) {
  cv::Mat1b image;
  renderer.render(T_world_camera, moving).convertTo(image, CV_8U);
  return image;
}

/// Nearest point of the scene on the ray of a pixel, by trying every face; nothing where leaves or clouds are
/// hit.
std::optional<Vector3d> cast_ray(const Scene& scene, const Isometry3d& T_world_camera,
                                 const cv::Point2f& pixel) {
  const Vector3d ray =
      T_world_camera.linear() * Vector3d((static_cast<double>(pixel.x) - kCamera.cx) / kCamera.fx,
                                         (static_cast<double>(pixel.y) - kCamera.cy) / kCamera.fy, 1.0);
  const Vector3d eye = T_world_camera.translation();
  const PinholeCamera keyhole{1,
                              1,
                              kCamera.fx,
                              kCamera.fy,
                              kCamera.cx - static_cast<double>(pixel.x),
                              kCamera.cy - static_cast<double>(pixel.y)};
  double nearest = std::numeric_limits<double>::max();
  const Face* hit = nullptr;
  for (const Chunk& chunk : scene.chunks) {
    if (!may_be_visible(chunk.bounds, T_world_camera.inverse(), keyhole)) continue;
    for (const Face& face : chunk.faces) {
      const auto corner = [&](int i) -> Vector3d {
        return face.corners[static_cast<std::size_t>(i)].cast<double>() - eye;
      };
      const Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      const double t = normal.dot(corner(0)) / normal.dot(ray);
      const bool averted = normal.dot(ray) >= 0.0 && !scene.materials[face.material].two_sided;
      if (!(t > kNearPlane_m) || t >= nearest || averted) continue;
      int left = 0;
      for (int i = 0; i < face.corner_count; ++i) {
        const Vector3d a = corner(i);
        const Vector3d b = corner((i + 1) % face.corner_count);
        left += normal.dot((b - a).cross(t * ray - a)) >= 0.0 ? 1 : 0;
      }
      if (left != face.corner_count) continue;
      nearest = t;
      hit = &face;
    }
  }
  if (hit == nullptr || scene.materials[hit->material].opacity || nearest > 300.0) return std::nullopt;
  return eye + nearest * ray;
}

Vector2d project(const Isometry3d& T_world_camera, const Vector3d& point) {
  const Vector3d p = T_world_camera.inverse() * point;
  return {kCamera.fx * p.x() / p.z() + kCamera.cx, kCamera.fy * p.y() / p.z() + kCamera.cy};
}

Vector2d to_vector(const cv::Point2f& p) { return {static_cast<double>(p.x), static_cast<double>(p.y)}; }

/// Errors, px, of corners tracked from one view to the other against the motion of the scene points they
/// show.
std::vector<Vector2d> tracking_errors(const World& world, const Isometry3d& from, const Isometry3d& to) {
  Renderer renderer(world.scene(), kCamera, 8);
  const cv::Mat1b first = rendered(renderer, from);
  const cv::Mat1b second = rendered(renderer, to);
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(first, corners, 250, 0.01, 8.0);
  std::vector<Vector2d> expected;
  std::vector<cv::Point2f> starts;
  for (const cv::Point2f& corner : corners) {
    // A point whose neighbourhood is not one smooth surface has no single motion.
    const auto centre = cast_ray(world.scene(), from, corner);
    if (!centre) continue;
    const Vector2d moved = project(to, *centre);
    bool smooth = true;
    for (const auto& step : {cv::Point2f(6, 0), cv::Point2f(-6, 0), cv::Point2f(0, 6), cv::Point2f(0, -6)}) {
      const auto near = cast_ray(world.scene(), from, corner + step);
      if (!near) {
        smooth = false;
        break;
      }
      const Vector2d flow = project(to, *near) - to_vector(corner + step);
      smooth &= (flow - (moved - to_vector(corner))).norm() < 1.5;
    }
    if (!smooth) continue;
    starts.push_back(corner);
    expected.push_back(moved);
  }
  std::vector<cv::Point2f> tracked;
  for (const Vector2d& p : expected)
    tracked.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  std::vector<std::uint8_t> found;
  std::vector<float> residuals;
  cv::calcOpticalFlowPyrLK(first, second, starts, tracked, found, residuals, {11, 11}, 1,
                           {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.003},
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  std::vector<Vector2d> errors;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (found[i] != 0) errors.push_back(to_vector(tracked[i]) - expected[i]);
  }
  return errors;
}

double median(std::vector<double> values) {
  REQUIRE_FALSE(values.empty());
  std::nth_element(values.begin(), values.begin() + std::ssize(values) / 2, values.end());
  return values[values.size() / 2];
}

/// Path that meets itself: out and back with another height, and across.
CameraPath crossing_path() {
  CameraPath path;
  const auto add = [&](double x, double y, double z) {
    Isometry3d pose = Isometry3d::Identity();
    pose.translation() << x, y, z;
    path.push_back(pose);
  };
  for (int i = 0; i <= 120; ++i) add(0.0, -0.05 * i, i);
  for (int i = 1; i <= 30; ++i) add(2.0 * i, -6.0, 120.0);
  for (int i = 1; i <= 60; ++i) add(60.0, -6.0 + 0.05 * i, 120.0 - i);
  for (int i = 1; i <= 120; ++i) add(60.0 - i, -3.0, 60.0);  // crosses the first street at its z = 60, y = -3
  return path;
}

/// Nothing but twigs is nearer to the route than `clearance_m`, from knee height to `highest_m`.
void check_clear(const World& world, double highest_m, double clearance_m) {
  const auto& materials = world.scene().materials;
  for (const Chunk& chunk : world.scene().chunks) {
    for (const Face& face : chunk.faces) {
      if (materials[face.material].opacity) continue;
      for (int i = 0; i < face.corner_count; ++i) {
        const Vector3d p = face.corners[static_cast<std::size_t>(i)].cast<double>();
        const GroundPoint below(p.x(), p.z());
        const double above_ground = world.terrain().height(below) - p.y();
        if (above_ground < 0.3 || above_ground > highest_m) continue;
        INFO("corner " << p.transpose() << " is " << above_ground << " m above the ground");
        REQUIRE(world.route().distance(below, 20.0) > clearance_m);
      }
    }
  }
}

}  // namespace

TEST_CASE("Nothing stands on the path, crossings included", "[simulate][world]") {
  check_clear(loop_world(), 3.5, 2.0);
  check_clear(World(crossing_path(), kSettings), 3.5, 2.0);
}

TEST_CASE("Nothing stands on the carriageway of a highway, and gantries let lorries through",
          "[simulate][world]") {
  WorldSettings settings = kSettings;
  settings.scenery = Scenery::kHighway;
  const double road = street_profile(Scenery::kHighway).road_half_width_m;
  check_clear(World(highway_drive(60, kFps), settings), 4.5, road);
  check_clear(World(crossing_path(), settings), 4.5, road);
}

TEST_CASE("The ground follows the path below the camera", "[simulate][world]") {
  const auto path = crossing_path();
  const World crossing(path, kSettings);
  for (const Isometry3d& pose : path) {
    const Vector3d p = pose.translation();
    const double above = crossing.terrain().height({p.x(), p.z()}) - p.y();
    INFO("camera at " << p.transpose());
    CHECK(above > 1.2);
    CHECK(above < 2.3);
  }
  for (const Isometry3d& pose : loop_path()) {
    const Vector3d p = pose.translation();
    CHECK(std::abs(loop_world().terrain().height({p.x(), p.z()}) - p.y() - kSettings.camera_height_m) < 0.15);
  }
}

TEST_CASE("A revisited place looks the same", "[simulate][world]") {
  Renderer renderer(loop_world().scene(), kCamera, 8);
  Renderer another(loop_world().scene(), kCamera, 8);
  const cv::Mat1f before = renderer.render(loop_path()[10]);
  CHECK_FALSE(renderer.render(loop_path()[150]).empty());
  CHECK(cv::norm(before, renderer.render(loop_path()[10]), cv::NORM_INF) == 0.0);
  CHECK(cv::norm(before, another.render(loop_path()[10]), cv::NORM_INF) == 0.0);
}

TEST_CASE("The same seed builds the same world, another seed a different one", "[simulate][world]") {
  const CameraPath path = street_loop(30, kFps);
  WorldSettings other = kSettings;
  other.scenery = GENERATE(Scenery::kTown, Scenery::kHighway, Scenery::kFences, Scenery::kSnow);
  other.seed = 6;
  other.texture_size_px = 64;
  WorldSettings same = other;
  same.seed = 7;
  const World a(path, other);
  const World b(path, other);
  const World c(path, same);
  const auto view = [&](const World& world) { return Renderer(world.scene(), kCamera, 4).render(path[5]); };
  CHECK(cv::norm(view(a), view(b), cv::NORM_INF) == 0.0);
  CHECK(cv::norm(view(a), view(c), cv::NORM_INF) > 50.0);
}

TEST_CASE("Every view of the drive shows many corners, turns included", "[simulate][world]") {
  const PinholeCamera full{1241, 376, 718.856, 718.856, 607.1928, 185.2157};
  Renderer renderer(loop_world().scene(), full, 8);
  for (std::size_t frame = 0; frame < loop_path().size(); frame += 23) {
    const cv::Mat1b image = rendered(renderer, loop_path()[frame]);
    std::vector<cv::KeyPoint> corners;
    cv::FAST(image, corners, 12);
    std::array<std::array<int, 6>, 3> cells{};
    for (const cv::KeyPoint& corner : corners) {
      ++cells[static_cast<std::size_t>(corner.pt.y * 3.0F / 376.0F)]
             [static_cast<std::size_t>(corner.pt.x * 6.0F / 1241.0F)];
    }
    int empty = 0;
    for (const auto& row : cells)
      empty += static_cast<int>(std::count_if(row.begin(), row.end(), [](int n) { return n < 5; }));
    INFO("frame " << frame << ": " << corners.size() << " corners, " << empty << " empty cells of 18");
    CHECK(corners.size() >= 800);
    CHECK(empty <= 3);  // sky
    const cv::Scalar mean = cv::mean(image);
    CHECK((mean[0] > 50.0 && mean[0] < 200.0));
  }
}

TEST_CASE("Tracked corners move as the geometry predicts, in time and between the cameras",
          "[simulate][world]") {
  std::vector<Vector2d> in_time;
  std::vector<Vector2d> in_stereo;
  const auto append = [](std::vector<Vector2d>& all, const std::vector<Vector2d>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  for (const std::size_t frame : {std::size_t{20}, std::size_t{58}, std::size_t{140}}) {
    const Isometry3d& here = loop_path()[frame];
    // A third of the way to the next frame: the tracker knows shifts only, no change of size.
    Isometry3d soon = here.inverse() * loop_path()[frame + 1];
    soon.translation() /= 3.0;
    soon.linear() =
        Eigen::Quaterniond::Identity().slerp(1.0 / 3.0, Eigen::Quaterniond(soon.linear())).toRotationMatrix();
    append(in_time, tracking_errors(loop_world(), here, here * soon));
    append(in_stereo, tracking_errors(loop_world(), here, here * Eigen::Translation3d(0.5371657, 0.0, 0.0)));
  }
  for (const auto& errors : {in_time, in_stereo}) {
    CHECK(errors.size() >= 200);
    std::vector<double> x, y, length;
    for (const Vector2d& error : errors) {
      x.push_back(error.x());
      y.push_back(error.y());
      length.push_back(error.norm());
    }
    CHECK(median(length) < 0.1);
    CHECK(std::abs(median(x)) < 0.03);
    CHECK(std::abs(median(y)) < 0.03);
  }
}

TEST_CASE("Cameras that hardly move or look up and down get a world, too", "[simulate][world]") {
  CameraPath path;
  for (int i = 0; i < 20; ++i) {
    Isometry3d pose = Isometry3d::Identity();
    pose.translation() << 0.02 * i, 0.01 * i, -0.01 * i;
    pose.linear() = Eigen::AngleAxisd(0.5 * i, Vector3d(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
    path.push_back(pose);
  }
  WorldSettings settings = kSettings;
  settings.texture_size_px = 64;
  const World world(path, settings);
  Renderer renderer(world.scene(), kCamera, 4);
  for (const Isometry3d& pose : path) {
    const cv::Mat1f image = renderer.render(pose);
    CHECK(cv::checkRange(image));
    CHECK(cv::mean(image)[0] > 10.0);
  }
  CHECK_THROWS_AS(World({}, settings), std::invalid_argument);
}

TEST_CASE("Traffic stays on the road, never drives into the camera, and moves", "[simulate][traffic]") {
  const int vehicles = GENERATE(6, 40);
  const Traffic traffic(loop_world(), loop_path(), kFps, vehicles, 9);
  std::vector<Face> before;
  for (std::size_t frame = 0; frame < loop_path().size(); ++frame) {
    const auto faces = traffic.at(frame);
    const Vector3d eye = loop_path()[frame].translation();
    double moved = 0.0;
    for (std::size_t i = 0; i < faces.size(); ++i) {
      for (int k = 0; k < faces[i].corner_count; ++k) {
        const Vector3d p = faces[i].corners[static_cast<std::size_t>(k)].cast<double>();
        REQUIRE(std::hypot(p.x() - eye.x(), p.z() - eye.z()) > 0.8);
        REQUIRE(loop_world().route().distance({p.x(), p.z()}, 10.0) < 6.0);
      }
      if (faces.size() == before.size())
        moved = std::max(moved, static_cast<double>((faces[i].corners[0] - before[i].corners[0]).norm()));
    }
    if (!faces.empty() && faces.size() == before.size()) CHECK(moved > 0.05);
    before = faces;
  }
  CHECK(Traffic(loop_world(), loop_path(), kFps, 0, 9).at(3).empty());
}

TEST_CASE("The built-in drive starts at the identity, turns gently and revisits places", "[simulate][path]") {
  const auto path = street_loop(700, kFps);
  CHECK(path.front().isApprox(Isometry3d::Identity(), 1e-12));
  double nearest = std::numeric_limits<double>::max();
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Isometry3d step = path[i - 1].inverse() * path[i];
    CHECK(step.translation().norm() < 1.0);
    CHECK(step.translation().norm() > 0.3);
    CHECK(Eigen::AngleAxisd(step.linear()).angle() < 0.1);
    if (i > 150) nearest = std::min(nearest, (path[i].translation() - path.front().translation()).norm());
  }
  CHECK(nearest < 0.6);
  CHECK(street_loop(0, kFps).empty());
  CHECK_THROWS_AS(street_loop(5, 0.0), std::invalid_argument);
  CHECK_THROWS_AS(street_loop(5, kFps, {.corner_radius_m = 40.0}), std::invalid_argument);
}

TEST_CASE("The drive along a highway starts at the identity, keeps its speed and never turns sharply",
          "[simulate][path]") {
  const HighwaySettings settings;
  const auto path = highway_drive(400, kFps);
  CHECK(path.front().isApprox(Isometry3d::Identity(), 1e-12));
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Isometry3d step = path[i - 1].inverse() * path[i];
    CHECK(step.translation().norm() == Approx(settings.speed_m_s / kFps).epsilon(0.002));
    CHECK(Eigen::AngleAxisd(step.linear()).angle() < 0.015);
    CHECK(step.translation().normalized().z() > 0.999);  // it drives where it looks
  }
  CHECK(highway_drive(0, kFps).empty());
  for (const HighwaySettings& wrong :
       {HighwaySettings{.speed_m_s = 0.0}, HighwaySettings{.bend_m = -1.0}, HighwaySettings{.bend_rad = 1.6},
        HighwaySettings{.bend_rad = std::nan("")}, HighwaySettings{.valley_m = 0.0}}) {
    CHECK_THROWS_AS(highway_drive(5, kFps, wrong), std::invalid_argument);
  }
  CHECK_THROWS_AS(highway_drive(5, 0.0), std::invalid_argument);
}
