// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "stereo_slam/dataset/sequence.hpp"

/// Recordings in bags of ROS 1, where the program was built with librosbag-storage-dev.
namespace stereo_slam {

struct BagOptions {
  std::string left_topic;  ///< both empty: the only pair of image topics whose names differ by left and
                           ///< right, cam0 and cam1, camera0 and camera1, or infra1 and infra2
  std::string right_topic;
  /// See read_calibration(). Empty: the calibration beside the bag, else the bag's camera_info.
  std::filesystem::path calibration;
  PairingOptions pairing{};
};

/// Whether the extension is that of a bag.
[[nodiscard]] bool has_bag_name(const std::filesystem::path& file);

struct BagTopic {
  std::string name;
  std::string type;  ///< "sensor_msgs/Image"
  std::size_t messages = 0;
};

/// The topics of a bag by name. Throws std::runtime_error that names the file when it cannot be read.
[[nodiscard]] std::vector<BagTopic> list_topics(const std::filesystem::path& file);

/// The names of the image topics of the left and the right camera.
struct TopicPair {
  std::string left;
  std::string right;
};

/// The topics that the options name, else the only pair found by names. Throws std::invalid_argument, listing
/// the candidates, when there is no pair or more than one.
[[nodiscard]] TopicPair choose_topics(const std::vector<BagTopic>& topics, const BagOptions& options);

/// Reads the stamps of all images (sensor_msgs/Image or CompressedImage) and the calibration. Images are
/// paired by stamp, to 1 ms; those without a partner are left out, with a warning.
[[nodiscard]] SequenceScan scan_bag(const std::filesystem::path& file, const BagOptions& options);

}  // namespace stereo_slam
