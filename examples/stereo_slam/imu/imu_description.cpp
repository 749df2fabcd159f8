// SPDX-License-Identifier: MIT
#include "stereo_slam/imu/imu_description.hpp"

#include <vector>

#include "stereo_slam/calibration/time_shift.hpp"
#include "stereo_slam/calibration/yaml_map.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

std::optional<fs::path> find_imu_description(const fs::path& place) {
  const std::vector<fs::path> files =
      fs::is_directory(place) ? std::vector<fs::path>{place / "imu.yaml", place / "mav0/imu0/sensor.yaml"}
                              : std::vector<fs::path>{fs::path(place).replace_extension(".yaml"),
                                                      place.parent_path() / "sensor.yaml"};
  for (const auto& file : files) {
    if (fs::is_regular_file(file)) return file;
  }
  return std::nullopt;
}

ImuDescription read_imu_description(const fs::path& file) {
  const YamlMap whole(file, load_yaml_file(file), "the file");
  const YamlMap map = whole.has("imu0") ? whole.map("imu0") : whole;  // as Kalibr writes it
  ImuDescription description{.file = file, .noise = noise_of(map)};
  if (map.has("T_BS")) description.T_body_imu = map.transform("T_BS");
  description.later_ns = read_time_shift_ns(map);
  return description;
}

}  // namespace stereo_slam
