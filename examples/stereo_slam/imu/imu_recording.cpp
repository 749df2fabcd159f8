// SPDX-License-Identifier: MIT
#include "stereo_slam/imu/imu_recording.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "stereo_slam/calibration/yaml_map.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// The file that describes the IMU; nothing if there is none.
[[nodiscard]] std::optional<fs::path> description_of(const fs::path& samples) {
  for (const auto& file :
       {fs::path(samples).replace_extension(".yaml"), samples.parent_path() / "sensor.yaml"}) {
    if (fs::is_regular_file(file)) return file;
  }
  return std::nullopt;
}

/// A density of noise; the value of `otherwise` if the map has none.
[[nodiscard]] double density(const YamlMap& map, const char* key, double otherwise) {
  constexpr double kLargest = 10.0;  // in any of the units: larger than that of any IMU
  const double value = map.number_or(key, otherwise);
  if (!(value > 0.0 && value <= kLargest)) {
    map.fail(map.get({key}), "{} is {}, but must be positive and at most {}; see the comment of the unit",
             key, value, kLargest);
  }
  return value;
}

[[nodiscard]] ImuNoise noise_of(const YamlMap& map) {
  const ImuNoise usual = ImuSensor{}.noise;
  return {
      .gyroscope = density(map, "gyroscope_noise_density", usual.gyroscope),
      .accelerometer = density(map, "accelerometer_noise_density", usual.accelerometer),
      .gyroscope_bias_walk = density(map, "gyroscope_random_walk", usual.gyroscope_bias_walk),
      .accelerometer_bias_walk = density(map, "accelerometer_random_walk", usual.accelerometer_bias_walk)};
}

/// By how much the stamps of the IMU are later than those of the camera.
[[nodiscard]] std::int64_t delay_ns(const YamlMap& map) {
  constexpr double kLargest_s = 10.0;
  const double delay_s = map.number_or("timeshift_cam_imu", 0.0);
  if (!(std::abs(delay_s) <= kLargest_s)) {
    map.fail(map.get({"timeshift_cam_imu"}), "timeshift_cam_imu is {} s, but must be within {} s", delay_s,
             kLargest_s);
  }
  return std::llround(1e9 * delay_s);
}

}  // namespace

std::optional<fs::path> find_imu(const fs::path& recording) {
  for (const char* name : {"mav0/imu0/data.csv", "imu0/data.csv", "imu.csv"}) {
    if (fs::is_regular_file(recording / name)) return recording / name;
  }
  return std::nullopt;
}

ImuRecording read_imu(const fs::path& samples, const std::optional<Eigen::Isometry3d>& T_body_camera) {
  auto [read, faults] = read_imu_samples(samples);
  ImuRecording imu{.file = samples, .sensor = {}, .samples = std::move(read), .faults = faults};
  Eigen::Isometry3d T_body_imu = Eigen::Isometry3d::Identity();
  if (const auto file = description_of(samples)) {
    const YamlMap whole(*file, load_yaml_file(*file), "the file");
    const YamlMap map = whole.has("imu0") ? whole.map("imu0") : whole;  // as Kalibr writes it
    imu.sensor.noise = noise_of(map);
    if (map.has("T_BS")) T_body_imu = map.transform("T_BS");
    const std::int64_t later_ns = delay_ns(map);
    for (auto& sample : imu.samples) sample.stamp_ns -= later_ns;
  }
  const Eigen::Isometry3d T_camera_body = T_body_camera.value_or(Eigen::Isometry3d::Identity()).inverse();
  imu.sensor.T_camera_imu = to_pose(T_camera_body * T_body_imu);
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
