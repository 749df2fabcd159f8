// SPDX-License-Identifier: MIT
#include "stereo_slam/imu/imu_recording.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/imu/imu_samples_file.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// By how much the stamps of the IMU are later than those of the frames, by its description or else by the
/// calibration of the cameras; nothing if neither says so.
[[nodiscard]] std::optional<std::int64_t> delay_of(const std::optional<ImuDescription>& description,
                                                   const CameraAndImu& camera) {
  constexpr std::int64_t kSame_ns = 1'000;
  const auto described = description ? description->later_ns : std::nullopt;
  if (described && camera.later_ns && std::abs(*described - *camera.later_ns) > kSame_ns) {
    fail(
        description->file,
        "timeshift_cam_imu is {:.6g} s, but {:.6g} s in the calibration of the cameras; remove the wrong one",
        1e-9 * static_cast<double>(*described), 1e-9 * static_cast<double>(*camera.later_ns));
  }
  return described ? described : camera.later_ns;
}

}  // namespace

std::optional<fs::path> find_imu(const fs::path& recording) {
  for (const char* name : {"mav0/imu0/data.csv", "imu0/data.csv", "imu.csv"}) {
    if (fs::is_regular_file(recording / name)) return recording / name;
  }
  return std::nullopt;
}

ImuRecording read_imu(const fs::path& samples, const CameraAndImu& camera) {
  ImuSamples recorded = read_imu_samples(samples);
  std::optional<ImuDescription> description;
  if (const auto file = find_imu_description(samples)) description = read_imu_description(*file);
  return imu_recording(samples, std::move(recorded), description, camera);
}

ImuRecording imu_recording(const fs::path& file, ImuSamples recorded,
                           const std::optional<ImuDescription>& description, const CameraAndImu& camera) {
  ImuRecording imu{
      .file = file, .sensor = {}, .samples = std::move(recorded.samples), .faults = recorded.faults};
  if (description) imu.sensor.noise = description->noise;
  const auto T_body_imu = description ? description->T_body_imu : std::nullopt;
  if (!T_body_imu && !camera.T_body_camera) {
    fail(file,
         "the pose of the camera in the axes of this IMU is not known; give a calibration that has it "
         "(T_cam_imu "
         "of Kalibr, T_BS of EuRoC, or T_body_left), or the pose of the IMU in the left camera as T_BS in "
         "imu.yaml");
  }
  const auto identity = Eigen::Isometry3d::Identity();
  const Eigen::Isometry3d T_camera_body = camera.T_body_camera.value_or(identity).inverse();
  imu.sensor.T_camera_imu = to_pose(T_camera_body * T_body_imu.value_or(identity));
  const auto later_ns = delay_of(description, camera);
  if (later_ns) imu.sensor.delay_sigma_s = kKnownDelaySigma_s;
  imu.sensor.known_delay_ns = later_ns.value_or(0);
  for (auto& sample : imu.samples) sample.stamp_ns -= imu.sensor.known_delay_ns;
  return imu;
}

std::optional<std::string> check_overlap(const ImuRecording& imu, std::int64_t first_ns,
                                         std::int64_t last_ns) {
  const std::int64_t begin_ns = imu.samples.front().stamp_ns, end_ns = imu.samples.back().stamp_ns;
  if (begin_ns >= last_ns || end_ns <= first_ns) {
    fail(imu.file,
         "has samples from {} s to {} s, but the frames are from {} s to {} s; write the stamps of both in "
         "the "
         "same clock",
         format_seconds(begin_ns), format_seconds(end_ns), format_seconds(first_ns), format_seconds(last_ns));
  }
  constexpr std::int64_t kNoticeable_ns = 1'000'000'000;
  const std::int64_t before_ns = std::max<std::int64_t>(begin_ns - first_ns, 0);
  const std::int64_t after_ns = std::max<std::int64_t>(last_ns - end_ns, 0);
  if (before_ns + after_ns <= kNoticeable_ns) return std::nullopt;
  return fmt::format(
      "the first {:.1f} s and the last {:.1f} s of the frames have no samples; there the images "
      "are used alone",
      1e-9 * static_cast<double>(before_ns), 1e-9 * static_cast<double>(after_ns));
}

ImuReadings ImuFeed::until(std::int64_t stamp_ns) {
  constexpr std::int64_t kAhead_ns = 250'000'000;
  const std::int64_t end_ns = stamp_ns + kAhead_ns;
  const auto& samples = imu_->samples;
  ImuReadings readings{.sensor = imu_->sensor, .samples = {}};
  while (next_ < samples.size() && (next_ == 0 || samples[next_ - 1].stamp_ns < end_ns)) {
    readings.samples.push_back(samples[next_++]);
  }
  return readings;
}

}  // namespace stereo_slam
