// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include <Eigen/Geometry>

namespace stereo_slam::simulator {

/// T_world_camera of every frame; camera and world axes x right, y down, z forward.
using CameraPath = std::vector<Eigen::Isometry3d>;

/// Reads a pose file (KITTI, TUM or EuRoC, see trajectory_io.hpp). The rotations are orthonormalised, since
/// files hold few digits. Throws std::runtime_error with file and line for a faulty file.
[[nodiscard]] CameraPath read_camera_path(const std::filesystem::path& file);

/// `count` poses while frame `frame` is exposed, evenly spread over `exposure` frames around its pose. The
/// velocity is constant, the mean of that from the frame before and that to the frame after.
[[nodiscard]] CameraPath poses_during_exposure(const CameraPath& path, std::size_t frame, double exposure,
                                               int count);

/// The pose `later` frames after a frame (negative: before it): on the screw motion between the two poses
/// around that time, and beyond the ends of the path on that of the first or the last step.
[[nodiscard]] Eigen::Isometry3d pose_after(const CameraPath& path, std::size_t frame, double later);

/// A time on a path of at least two frames: `share` of the step that begins at frame `step` has passed since
/// frame `frame`. Exact for whole frames.
struct PathTime {
  std::size_t frame = 0;
  std::size_t step = 0;
  double share = 0.0;
};
[[nodiscard]] PathTime path_time(std::size_t frames, std::size_t frame, double later);

/// The built-in drive: a figure of eight around two blocks of houses that share a street, repeated without
/// end. The lap around each block passes the shared street once; a lap of the whole figure ends where it
/// began.
struct LoopSettings {
  double block_length_m = 50.0;
  double block_width_m = 40.0;
  double corner_radius_m = 9.0;
  double speed_m_s = 8.5;  ///< on the straights
  double corner_speed_m_s = 5.0;
  double hill_m = 1.5;       ///< amplitude of the ups and downs of the streets
  double shake_rad = 0.003;  ///< amplitude of the car's pitching and rolling
};

/// First `frames` poses of the built-in drive; the first one is the identity. Throws std::invalid_argument
/// for a corner that does not fit into the block, or a speed or rate that is not positive.
[[nodiscard]] CameraPath street_loop(int frames, double fps, const LoopSettings& settings = {});

/// The built-in drive along a highway: long bends to the left and to the right, gentle ups and downs.
struct HighwaySettings {
  double speed_m_s = 28.0;
  double bend_m = 900.0;     ///< length of a bend to the right and the next one to the left
  double bend_rad = 0.25;    ///< largest angle between the road and the direction it began in, < pi/2
  double valley_m = 400.0;   ///< distance from one hilltop to the next
  double hill_m = 2.0;       ///< amplitude of the hills
  double shake_rad = 0.002;  ///< amplitude of the car's pitching and rolling
};

/// First `frames` poses of the drive along a highway; the first one is the identity. Throws
/// std::invalid_argument for a speed, rate or length that is not positive, and an angle out of range.
[[nodiscard]] CameraPath highway_drive(int frames, double fps, const HighwaySettings& settings = {});

}  // namespace stereo_slam::simulator
