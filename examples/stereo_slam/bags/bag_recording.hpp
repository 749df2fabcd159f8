// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "stereo_slam/bags/bag_files.hpp"
#include "stereo_slam/bags/topic_pair.hpp"
#include "stereo_slam/dataset/sequence.hpp"

/// Recordings in bags; those of ROS 1 where the program was built with librosbag-storage-dev.
namespace stereo_slam {

struct BagOptions {
  std::string left_topic{};   ///< both empty: see choose_topics()
  std::string right_topic{};  ///< the same as the left one: its images show both cameras side by side
  /// See read_calibration(). Empty: the calibration beside the bag, else the bag's camera_info.
  std::filesystem::path calibration{};
  std::string imu_topic{};  ///< empty: see choose_imu_topic()
  PairingOptions pairing{};
  bool record_times = false;  ///< use the times of recording, not the stamps in the headers of messages
};

/// The topics of a bag by name. Throws std::runtime_error that names the file when it cannot be read.
[[nodiscard]] std::vector<BagTopic> list_topics(const std::filesystem::path& file);

/// Reads the stamps of all images (sensor_msgs/Image or CompressedImage) and the calibration. Images are
/// paired by stamp, see pair_stamps(); those without a partner or a usable stamp are left out, with a
/// warning. The IMU is only looked for when StereoSequence::recorded_imu is called: its description is
/// imu.yaml, or EuRoC's mav0/imu0/sensor.yaml, beside the bag or beside the calibration of the options.
[[nodiscard]] SequenceScan scan_bag(const std::filesystem::path& recording, const BagOptions& options);

}  // namespace stereo_slam
