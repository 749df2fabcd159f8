// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "stereo_slam/calibration/stereo_rig.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

/// @file
/// The stereo SLAM for use in other programs: link antipode::stereo_slam. Needs Eigen and OpenCV's core.
/// Pixels, metres, radians, nanoseconds; `T_a_b` maps coordinates of b to coordinates of a.

/// Stereo visual SLAM with a covariance for every pose.
namespace stereo_slam {

/// What a StereoSlam does; all of it can be left out.
struct SlamOptions {
  std::string preset = "default";                                     ///< of `stereo_slam run --preset`
  std::optional<std::filesystem::path> settings_file = std::nullopt;  ///< of `stereo_slam run --config`
  std::map<std::string, std::string> settings{};  ///< after the file: {{"features.count", "500"}}
  std::optional<std::filesystem::path> load_map = std::nullopt;  ///< localises in a map that save_map() wrote
  bool extend_map = false;                                       ///< also continues the loaded map
  /// Begins with what an earlier run learned of the same cameras: cameras.yaml of `stereo_slam run`, or the
  /// file of save_cameras(). A loaded map has this, too: not with load_map.
  std::optional<std::filesystem::path> learned = std::nullopt;
  ImuNoise imu_noise = ImuSensor{}.noise;  ///< of the IMU whose samples process() gets
  bool loop_thread = true;                 ///< a thread of its own closes loops; the results are the same
  /// Do not set: it records your compiler's flags. The constructors throw if the library's differ.
  std::size_t eigen_alignment = EIGEN_MAX_ALIGN_BYTES;
};

/// Pose of a frame as it is known now: a loop closure may have moved it since the frame was processed.
struct FramePose {
  std::size_t index = 0;                                  ///< in the order of process(), from 0
  std::int64_t stamp_ns = 0;                              ///< when the images were taken
  TrackingStatus status = TrackingStatus::kInitializing;  ///< when it was processed
  PoseGaussian T_world_camera;                            ///< of the rectified left camera
};

/// Stereo visual SLAM: image pairs in, poses with covariances out. The world's origin is the camera's first
/// pose; "camera" is the rectified left camera, axes x right, y down, z forward. Calls of several threads on
/// one object wait for each other; different objects are independent.
///
/// Every constructor throws std::invalid_argument or std::runtime_error, with one line that names file or
/// value, for a calibration, a setting or a map that cannot be used.
class StereoSlam {
 public:
  /// For images that are rectified already. A camera without size takes that of the first images.
  explicit StereoSlam(const StereoCamera& camera, const SlamOptions& options = {});

  /// For raw images, which are rectified here.
  explicit StereoSlam(const StereoRig& rig, const SlamOptions& options = {});

  /// For the cameras of a calibration file, in any of the formats that docs/datasets.md describes.
  explicit StereoSlam(const std::filesystem::path& calibration, const SlamOptions& options = {});

  /// Takes over map and state; what is left may be destroyed or assigned to.
  StereoSlam(StereoSlam&&) noexcept;
  /// Takes over map and state; what is left may be destroyed or assigned to.
  StereoSlam& operator=(StereoSlam&&) noexcept;
  /// Ends the thread that closes loops, if there is one.
  ~StereoSlam();

  /// Tracks a pair that was taken at one time. Every pair gets a pose; `status` says what it is based on, and
  /// T_world_camera.covariance how far it can be trusted.
  ///
  /// Images have 8 or 16 bits and 1, 3 (BGR) or 4 (BGRA) channels, and may be reused by the caller at once.
  /// If the right camera delivered nothing, `right` may be empty (cv::Mat()) in all pairs but the first: then
  /// the left image alone is tracked.
  /// Throws std::invalid_argument, and changes nothing, for images of another size or type, for first images
  /// without the principal point of a camera that has no size, or for a stamp that is not later than the one
  /// before.
  FrameResult process(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp_ns);

  /// The same with the samples of an IMU since the frame before, which predict the motion: in order, with
  /// stamps of the images' clock, up to the first one that is not before `stamp_ns` if there is one already.
  /// FrameResult::inertial has velocity, gravity and biases, and inertial() says whether the IMU is used.
  /// Samples that are not finite or not in order are left out. The body of the calibration is the IMU: throws
  /// std::invalid_argument if the calibration has no T_body_camera.
  FrameResult process(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp_ns,
                      std::span<const ImuSample> imu);

  /// Waits for loops that are still being closed. Call it after the last frame, before reading the results.
  void finish();

  /// Poses of all frames so far.
  [[nodiscard]] std::vector<FramePose> trajectory() const;
  /// Poses of the keyframes among them.
  [[nodiscard]] std::vector<FramePose> keyframes() const;

  /// Landmarks in world coordinates.
  [[nodiscard]] std::vector<MapPoint> map_points() const;

  /// Loops found so far, accepted and refused.
  [[nodiscard]] std::vector<LoopEvent> loops() const;

  /// The rectified camera: what map points project into. Its size is 0 before the first images, if the
  /// calibration has none.
  [[nodiscard]] const StereoCamera& camera() const;

  /// The rectified left camera in the body, if the calibration contains one. The body's pose is
  /// `T_world_camera * T_body_camera.inverse()`.
  [[nodiscard]] const std::optional<Eigen::Isometry3d>& T_body_camera() const;

  /// How the samples of an IMU were used so far; nothing without any.
  [[nodiscard]] std::optional<InertialSummary> inertial() const;

  /// Writes the map for SlamOptions::load_map and `stereo_slam run --load-map`. Throws std::runtime_error
  /// when the file cannot be written, and std::logic_error without loop closure or an image size so far.
  void save_map(const std::filesystem::path& file) const;

  /// Writes what was learned of the cameras, for SlamOptions::learned and `stereo_slam run --learned`. Throws
  /// std::runtime_error when the file cannot be written, and std::logic_error before the first images or with
  /// a preset that learns nothing.
  void save_cameras(const std::filesystem::path& file) const;

 private:
  FrameResult process_frame(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp_ns,
                            std::optional<ImuReadings> imu);

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace stereo_slam
