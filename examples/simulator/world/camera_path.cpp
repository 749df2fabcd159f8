// SPDX-License-Identifier: MIT
#include "simulator/world/camera_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Straight or circular piece of a street plan.
struct Piece {
  Vector2d start;      ///< (x, z)
  double heading_rad;  ///< of the start; 0 looks along z, positive turns right
  double length_m;
  double curvature;  ///< positive turns right
};

struct PlanPoint {
  Vector2d position;
  double heading_rad;
  double curvature;
};

[[nodiscard]] Vector2d direction(double heading_rad) {
  return {std::sin(heading_rad), std::cos(heading_rad)};
}

[[nodiscard]] PlanPoint walk(const Piece& piece, double distance_m) {
  const double heading = piece.heading_rad + piece.curvature * distance_m;
  if (piece.curvature == 0.0) return {piece.start + distance_m * direction(heading), heading, 0.0};
  const Vector2d right_start(std::cos(piece.heading_rad), -std::sin(piece.heading_rad));
  const Vector2d right_end(std::cos(heading), -std::sin(heading));
  return {piece.start + (right_start - right_end) / piece.curvature, heading, piece.curvature};
}

/// The figure of eight: four right turns around one block, four left turns around the other.
[[nodiscard]] std::vector<Piece> figure_of_eight(const LoopSettings& settings) {
  const double radius = settings.corner_radius_m;
  const double turn_length = 0.5 * std::numbers::pi * radius;
  std::vector<Piece> pieces;
  PlanPoint at{Vector2d::Zero(), 0.0, 0.0};
  const auto add = [&](double length, double curvature) {
    pieces.push_back({at.position, at.heading_rad, length, curvature});
    at = walk(pieces.back(), length);
  };
  for (const double side : {1.0, -1.0}) {
    for (int i = 0; i < 4; ++i) {
      add((i % 2 == 0 ? settings.block_length_m : settings.block_width_m) - 2.0 * radius, 0.0);
      add(turn_length, side / radius);
    }
  }
  return pieces;
}

/// Where the drive is after `distance_m`.
[[nodiscard]] PlanPoint at_distance(const std::vector<Piece>& pieces, double distance_m) {
  for (;;) {
    for (const Piece& piece : pieces) {
      if (distance_m < piece.length_m) return walk(piece, distance_m);
      distance_m -= piece.length_m;
    }
  }
}

/// Height of the streets, a smooth function of the place so that revisits agree; y points down.
[[nodiscard]] double street_y(const Vector2d& p, double amplitude_m) {
  return amplitude_m *
         (std::cos(0.031 * p.x() + 0.4) * std::cos(0.037 * p.y() - 0.3) - std::cos(0.4) * std::cos(0.3));
}

/// Camera of a car that pitches and rolls on a road.
struct CarPose {
  Vector3d position;
  double heading_rad;
  double slope_rad;
  double time_s;
  double shake_rad;
};

[[nodiscard]] Eigen::Isometry3d camera_pose(const CarPose& car) {
  const double t = car.time_s;
  const double pitch = car.slope_rad + car.shake_rad * (std::sin(7.3 * t) + 0.6 * std::sin(17.1 * t));
  const double roll = car.shake_rad * (std::sin(5.9 * t) + 0.5 * std::sin(13.7 * t));
  Eigen::Isometry3d T_world_camera = Eigen::Isometry3d::Identity();
  T_world_camera.translation() = car.position;
  T_world_camera.linear() =
      (Eigen::AngleAxisd(car.heading_rad, Vector3d::UnitY()) * Eigen::AngleAxisd(pitch, Vector3d::UnitX()) *
       Eigen::AngleAxisd(roll, Vector3d::UnitZ()))
          .toRotationMatrix();
  return T_world_camera;
}

/// The path in the axes of its first camera.
[[nodiscard]] CameraPath from_identity(CameraPath path) {
  if (path.empty()) return path;
  const Eigen::Isometry3d T_first_world = path.front().inverse();
  for (Eigen::Isometry3d& pose : path) pose = T_first_world * pose;
  return path;
}

/// A road that winds about a straight line.
struct Winding {
  const HighwaySettings& settings;

  [[nodiscard]] double heading_rad(double distance_m) const {
    return settings.bend_rad * std::sin(2.0 * std::numbers::pi * distance_m / settings.bend_m);
  }
  /// Height; y points down.
  [[nodiscard]] double y(double distance_m) const {
    return settings.hill_m * std::cos(2.0 * std::numbers::pi * distance_m / settings.valley_m);
  }
  [[nodiscard]] double slope_rad(double distance_m) const {
    const double turns = 2.0 * std::numbers::pi / settings.valley_m;
    return std::atan(settings.hill_m * turns * std::sin(turns * distance_m));
  }
};

void require_positive(double value, const std::string& what) {
  if (!(value > 0.0)) throw std::invalid_argument(what + " must be positive, not " + std::to_string(value));
}

}  // namespace

CameraPath read_camera_path(const std::filesystem::path& file) {
  CameraPath path = read_trajectory(file).poses;
  for (Eigen::Isometry3d& T_world_camera : path) {
    T_world_camera.linear() = Eigen::Quaterniond(T_world_camera.linear()).normalized().toRotationMatrix();
  }
  return path;
}

CameraPath poses_during_exposure(const CameraPath& path, std::size_t frame, double exposure, int count) {
  const std::size_t before = frame > 0 ? frame - 1 : frame;
  const std::size_t after = std::min(frame + 1, path.size() - 1);
  const Pose middle = Pose::from_isometry(path[frame]);
  Vector6<double> motion = Vector6<double>::Zero();  // from one frame to the next
  if (after > before) {
    motion = Pose::from_isometry(path[after]).boxminus(Pose::from_isometry(path[before])) /
             static_cast<double>(after - before);
  }
  CameraPath poses;
  for (int i = 0; i < count; ++i) {
    const double time = exposure * ((i + 0.5) / count - 0.5);
    poses.push_back(middle.boxplus(time * motion).isometry());
  }
  return poses;
}

PathTime path_time(std::size_t frames, std::size_t frame, double later) {
  const double time = static_cast<double>(frame) + later;
  const double last = static_cast<double>(frames - 1);
  const auto nearest = static_cast<std::size_t>(std::floor(std::clamp(time, 0.0, last)));
  return {nearest, std::min(nearest, frames - 2), time - static_cast<double>(nearest)};
}

Eigen::Isometry3d pose_after(const CameraPath& path, std::size_t frame, double later) {
  if (path.size() < 2) return path[frame];
  const PathTime at = path_time(path.size(), frame, later);
  const Pose begin = Pose::from_isometry(path[at.step]);
  const Pose end = Pose::from_isometry(path[at.step + 1]);
  return Pose::from_isometry(path[at.frame]).boxplus(at.share * end.boxminus(begin)).isometry();
}

CameraPath street_loop(int frames, double fps, const LoopSettings& settings) {
  if (!(settings.corner_radius_m > 0.0) ||
      2.0 * settings.corner_radius_m > std::min(settings.block_length_m, settings.block_width_m)) {
    throw std::invalid_argument("a corner of radius " + std::to_string(settings.corner_radius_m) +
                                " m does not fit into the block");
  }
  if (!(fps > 0.0) || !(settings.speed_m_s > 0.0) || !(settings.corner_speed_m_s > 0.0)) {
    throw std::invalid_argument("frame rate and speeds must be positive");
  }
  const auto pieces = figure_of_eight(settings);
  CameraPath path;
  double distance_m = 0.0;
  double speed = settings.speed_m_s;
  for (int frame = 0; frame < frames; ++frame) {
    const PlanPoint here = at_distance(pieces, distance_m);
    constexpr double kStep_m = 0.5;
    const double rise = street_y(here.position + kStep_m * direction(here.heading_rad), settings.hill_m) -
                        street_y(here.position - kStep_m * direction(here.heading_rad), settings.hill_m);
    const double slope = std::atan2(-rise, 2.0 * kStep_m);
    const Vector3d position(here.position.x(), street_y(here.position, settings.hill_m), here.position.y());
    path.push_back(camera_pose({position, here.heading_rad, slope, frame / fps, settings.shake_rad}));

    const double ahead = std::abs(at_distance(pieces, distance_m + 6.0).curvature);
    const bool turning = std::abs(here.curvature) > 0.0 || ahead > 0.0;
    const double wanted = turning ? settings.corner_speed_m_s : settings.speed_m_s;
    speed += std::clamp(wanted - speed, -4.0 / fps, 2.0 / fps);  // brakes at 4, accelerates at 2 m/s^2
    distance_m += speed / fps;
  }
  return from_identity(std::move(path));
}

CameraPath highway_drive(int frames, double fps, const HighwaySettings& settings) {
  require_positive(fps, "frame rate");
  require_positive(settings.speed_m_s, "speed");
  require_positive(settings.bend_m, "length of a bend");
  require_positive(settings.valley_m, "length of a valley");
  if (!(std::abs(settings.bend_rad) < 0.5 * std::numbers::pi)) {
    throw std::invalid_argument("a highway that bends by " + std::to_string(settings.bend_rad) +
                                " rad turns back");
  }
  const Winding road{settings};
  constexpr int kSteps = 20;  // integration steps a frame
  const double step_m = settings.speed_m_s / fps / kSteps;
  CameraPath path;
  Vector2d position = Vector2d::Zero();
  double distance_m = 0.0;
  for (int frame = 0; frame < frames; ++frame) {
    path.push_back(camera_pose({{position.x(), road.y(distance_m), position.y()},
                                road.heading_rad(distance_m),
                                road.slope_rad(distance_m),
                                frame / fps,
                                settings.shake_rad}));
    for (int i = 0; i < kSteps; ++i, distance_m += step_m)
      position += step_m * direction(road.heading_rad(distance_m + 0.5 * step_m));
  }
  return from_identity(std::move(path));
}

}  // namespace stereo_slam::simulator
