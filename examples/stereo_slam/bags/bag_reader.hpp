// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/bags/message_times.hpp"
#include "stereo_slam/bags/topic_pair.hpp"
#include "stereo_slam/calibration/camera_info.hpp"
#include "stereo_slam/images/grey_image.hpp"

namespace stereo_slam {

/// The images of a topic that can be read.
struct IndexedImages {
  std::vector<MessageTime> times;  ///< in order of recording
  std::size_t unreadable = 0;      ///< messages that are left out
  std::string first_fault;         ///< why the first of them cannot be read
};

/// The images and calibrations in a recording of one bag or several parts. Every function throws
/// std::runtime_error that names the file when the bag cannot be read. Reading images is thread-safe.
class BagReader {
 public:
  explicit BagReader(const std::filesystem::path& recording);
  ~BagReader();
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;

  /// Sorted by name.
  [[nodiscard]] std::vector<BagTopic> topics() const;

  /// Indexes the images of topics, all in one pass over the recording. Throws if a topic has none that can be
  /// read.
  [[nodiscard]] std::vector<IndexedImages> index_images(const std::vector<std::string>& topics);

  /// Image `i`, from 0, of an indexed topic, as CV_8UC1; 16 bits a pixel by the scale.
  [[nodiscard]] cv::Mat image(const std::string& topic, std::size_t i, const GreyScale& scale = {});

  /// Adds the values of that image if it has 16 bits a pixel. Returns whether it has.
  [[nodiscard]] bool add_values(const std::string& topic, std::size_t i, ValueCounts& values);

  /// The first message of a topic of sensor_msgs/CameraInfo whose camera is calibrated; the last one if none
  /// is.
  [[nodiscard]] CameraInfo camera_info(const std::string& topic);

  /// What the files lack, one warning for each that is not whole: "PATH: WHAT".
  [[nodiscard]] std::vector<std::string> warnings() const;

 private:
  struct Bag;
  std::unique_ptr<Bag> bag_;
};

}  // namespace stereo_slam
