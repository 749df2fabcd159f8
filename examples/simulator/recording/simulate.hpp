// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "simulator/recording/imu.hpp"
#include "simulator/rendering/projection.hpp"
#include "simulator/rendering/rectification_error.hpp"
#include "simulator/rendering/rig_disturbance.hpp"
#include "simulator/rendering/sensor.hpp"
#include "simulator/world/camera_path.hpp"
#include "simulator/world/ride.hpp"
#include "simulator/world/world.hpp"
#include "stereo_slam/calibration/stereo_rig.hpp"

/// Renders a street as a KITTI odometry or EuRoC sequence with exact ground truth.
namespace stereo_slam::simulator {

struct SimulationSettings {
  std::filesystem::path trajectory;  ///< pose file, see read_camera_path(); empty: the built-in drive
  Scenery scenery = Scenery::kTown;  ///< built along the path
  int frames = 0;                    ///< number; 0: all of the file, or kDefaultFrames of the built-in drive
  std::uint64_t seed = 1;            ///< of the world, the traffic and the noise
  int dynamic_objects = 0;           ///< moving cars and lorries
  bool moving_masks = false;         ///< write masks of these in the left images
  double fps = 10.0;                 ///< frames a second, > 0
  PinholeCamera camera{1241, 376, 718.856, 718.856, 607.1928, 185.2157};  ///< of both images, px
  double baseline_m = 0.5371657;                                          ///< > 0
  /// Largest displacement in the right image by errors that the recorded calibration does not contain: a
  /// relative rotation, an offset of the principal point and radial distortion, drawn with the seed. Not with
  /// `rig`.
  double rectification_error_px = 0.0;
  LensError lens_error;        ///< left in both images, unknown to the recorded calibration; not with `rig`
  Ride ride;                   ///< motion that the road adds to the path; part of the ground truth
  RigDisturbance disturbance;  ///< of the right camera, unknown to the recorded calibration
  double camera_height_m = 1.65;  ///< above the road, > 0
  int samples_per_pixel = 8;      ///< for anti-aliasing: 4, 8 or 16
  int texture_size_px = 1024;     ///< side of the large textures, a power of two >= 64
  /// Raw images of these cameras in EuRoC's layout, instead of rectified ones of `camera` and `baseline_m` in
  /// KITTI's; the path is that of the left one. T_body_left is required.
  std::optional<StereoRig> rig;
  SensorSettings sensor;
  /// Also the readings of an IMU: of the rig's body, or in the axes of the left camera without a rig.
  std::optional<ImuSettings> imu;
  LoopSettings loop;        ///< the drive of every other scene
  HighwaySettings highway;  ///< the drive of the highway
  int threads = 0;          ///< 0 is one per processor; the images do not depend on it

  static constexpr int kDefaultFrames = 400;
};

/// Called after each frame, from any thread but never concurrently, with the frames done and the total.
/// Returns whether to continue; if not, the frames in progress are finished and make a shorter recording.
using Progress = std::function<bool(int done, int total)>;

/// Writes a recording into `output`, which is created when missing: calib.txt (P0 .. P3), times.txt,
/// poses.txt, image_0/%06d.png and image_1/%06d.png; or, with a rig, mav0 with cam0, cam1 and
/// state_groundtruth_estimate0. With `moving_masks`, the folder `moving` beside image_0 or cam0 holds masks
/// of the moving objects, white on black. With `disturbance`, disturbance.csv holds the RightCameraError of
/// every frame, and its displacements in pixels. With `imu`, imu.csv, imu.yaml and imu_truth.csv, or imu0 in
/// mav0 and velocities and biases in its ground truth, are the readings of an IMU. The text files are written
/// first, then each pair of images as soon as it is rendered. Throws std::invalid_argument for settings out
/// of range and std::runtime_error for a trajectory that cannot be read or leads more than 20 km away from
/// its start, both before anything is written; and std::runtime_error for files that cannot be written and
/// for an `output` that is not empty.
void simulate(const SimulationSettings& settings, const std::filesystem::path& output,
              const Progress& progress = nullptr);

/// What the user should know about how the trajectory was read, with its name; nothing for a pipe, which can
/// be read only once.
[[nodiscard]] std::vector<std::string> trajectory_remarks(const SimulationSettings& settings);

/// The path that simulate() drives with these settings, without the motion of the ride; throws like it.
[[nodiscard]] CameraPath camera_path(const SimulationSettings& settings);

}  // namespace stereo_slam::simulator
