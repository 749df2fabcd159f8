// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/bags/message_times.hpp"
#include "stereo_slam/calibration/camera_info.hpp"
#include "stereo_slam/images/grey_image.hpp"

namespace stereo_slam {

/// The files of a recording: a bag; the parts of one as BAG,BAG,...; or those in a folder. Throws
/// std::runtime_error if a folder contains none.
[[nodiscard]] std::vector<std::filesystem::path> bag_files(const std::filesystem::path& recording);

/// The images and calibrations in a recording of one bag or several parts. Every function throws
/// std::runtime_error that names the file when the bag cannot be read. In a program built without
/// librosbag-storage-dev the constructor always throws.
class BagReader {
 public:
  explicit BagReader(const std::filesystem::path& recording);
  ~BagReader();
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;

  [[nodiscard]] std::vector<BagTopic> topics() const;

  /// Indexes the images of a topic. Returns their times, in order of recording.
  [[nodiscard]] std::vector<MessageTime> index_images(const std::string& topic);

  /// Image `i`, from 0, of an indexed topic, as CV_8UC1; 16 bits a pixel by the scale.
  [[nodiscard]] cv::Mat image(const std::string& topic, std::size_t i, const GreyScale& scale = {});

  /// Adds the values of that image if it has 16 bits a pixel. Returns whether it has.
  [[nodiscard]] bool add_values(const std::string& topic, std::size_t i, ValueCounts& values);

  /// The first message of a topic of sensor_msgs/CameraInfo whose camera is calibrated; the last one if none
  /// is.
  [[nodiscard]] CameraInfo camera_info(const std::string& topic);

 private:
  struct Bag;
  std::unique_ptr<Bag> bag_;
};

}  // namespace stereo_slam
