// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/bags/message_times.hpp"
#include "stereo_slam/bags/ros_message.hpp"
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

/// A file of a recording.
struct BagPart {
  std::filesystem::path file;
  std::unique_ptr<MessageFile> messages;
  std::optional<RecordTimes> times;  ///< nothing if it has no messages
};

/// The images and calibrations in a recording of one bag or several parts. Every function throws
/// std::runtime_error that names the file when the bag cannot be read. Reading images is thread-safe.
class BagReader {
 public:
  explicit BagReader(const std::filesystem::path& recording);

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

  /// The last message of such a topic.
  [[nodiscard]] CameraInfo last_camera_info(const std::string& topic);

  /// Calls `use` with every message of a topic, and with the time at which it was recorded, in the order of
  /// these times. What is thrown for a message goes to `fault`.
  void for_each(const std::string& topic, const std::function<void(const RosMessage&, std::int64_t)>& use,
                const std::function<void(const std::string&)>& fault);

  /// What the files lack, one warning for each that is not whole: "PATH: WHAT".
  [[nodiscard]] std::vector<std::string> warnings() const;

 private:
  struct Message {
    const BagPart* part = nullptr;
    MessagePlace place;
  };

  /// A message of one of several topics.
  struct Indexed : Message {
    std::size_t topic = 0;
    MessageBeginning beginning;
  };

  /// From the first to the last message.
  [[nodiscard]] double duration_s() const;

  /// The messages of a topic in order of recording.
  [[nodiscard]] std::vector<Message> messages(const std::string& topic) const;

  /// A message of sensor_msgs/CameraInfo. Throws with the name of its file.
  [[nodiscard]] CameraInfo read_camera_info(const std::string& topic, const Message& message);

  /// A message of a topic. Throws without the name of the file. Only the part that was read last keeps
  /// messages in memory.
  [[nodiscard]] RosMessage read(const std::string& topic, const Message& message);

  /// The messages of topics in a part, with their beginnings.
  [[nodiscard]] static std::vector<Indexed> read_beginnings(const BagPart& part,
                                                            const std::vector<std::string>& topics);

  /// Calls `use` with image `i` of an indexed topic, and adds the names of both to its errors.
  void read_image(const std::string& topic, std::size_t i, const std::function<void(const RosMessage&)>& use);

  std::filesystem::path recording_;
  std::vector<std::string> warnings_;  ///< of the parts together
  std::vector<BagPart> parts_;
  const BagPart* last_read_ = nullptr;
  std::map<std::string, BagTopic> topics_;
  std::map<std::string, std::vector<Message>> images_;  ///< by topic
  std::mutex mutex_;                                    ///< files are not thread-safe
};

}  // namespace stereo_slam
