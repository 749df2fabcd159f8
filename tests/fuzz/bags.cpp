// SPDX-License-Identifier: MIT
// Bags of ROS 2 and their messages: they are read, or refused in words of this program.
#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>

#include "fuzz/fuzz_files.hpp"
#include "fuzz/fuzz_target.hpp"
#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/bags/ros_message.hpp"

namespace antipode::fuzz {
namespace {

using namespace stereo_slam;

/// Every message of a file, in full and its beginning, which are the same if a place leads to one message
/// only.
void read_messages(MessageFile& file, bool has_stable_places) {
  (void)file.times();
  for (const auto& topic : file.topics()) {
    const auto places = file.places(topic.name);
    const auto beginnings = file.read_beginnings(places);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto& [bytes, count, fault] = beginnings[i];
      if (!fault.empty() && !has_stable_places) continue;  // it was read in the same way
      try {
        const auto message = file.read(places[i]);
        if (!has_stable_places) continue;
        require(fault.empty() && count == std::min(message.size(), kStampedBytes) &&
                    std::equal(bytes.begin(), bytes.begin() + count, message.begin()),
                "a message and its beginning differ");
      } catch (const std::runtime_error&) {  // of one message
      } catch (const std::invalid_argument&) {
      }
    }
  }
  (void)file.warning();
}

/// Whether a bag can be opened, after its messages were read. One that cannot be would only be opened and
/// refused a second time as a recording.
[[nodiscard]] bool open_and_read(const std::filesystem::path& bag) {
  std::unique_ptr<MessageFile> file;
  try {
    file = open_message_file(bag);
    // In a damaged database several rows may have the same number.
    read_messages(*file, bag.extension() != ".db3");
  } catch (const std::runtime_error&) {
  } catch (const std::invalid_argument&) {
  }
  return file != nullptr;
}

/// A file of this name, through the reader of its messages and as a recording.
void read_bag(Bytes bytes, const std::string& name) {
  const auto bag = folder().write(name, bytes);
  if (!open_and_read(bag)) return;
  const SequenceScan scan = scan_bag(bag, {});
  for (const auto& problem : scan.problems)
    require(problem.text.find(folder().path().string()) != std::string::npos,
            "names no file: " + problem.text);
  attempt_to_read([&] {
    for (std::size_t i = 0; i < scan.sequence.frames.size(); ++i) (void)load_partial_frame(scan.sequence, i);
  });
}

void mcap(Bytes bytes) { read_bag(bytes, "bag.mcap"); }
void db3(Bytes bytes) { read_bag(bytes, "bag.db3"); }

/// One message, as every type that is read. The first byte tells how it is serialised.
void ros_message(Bytes bytes) {
  if (bytes.empty()) return;
  const auto serialization = bytes.front() % 2 == 0 ? Serialization::kCdr : Serialization::kRos1;
  const auto as = [&](const char* type) { return RosMessage{type, serialization, bytes.subspan(1)}; };
  allow_refusal([&] { (void)header_stamp_ns(as("sensor_msgs/msg/Image")); });
  allow_refusal([&] { (void)read_grey(as("sensor_msgs/msg/Image"), {}); });
  allow_refusal([&] { (void)read_16_bit(as("sensor_msgs/msg/Image")); });
  allow_refusal([&] {
    const CameraInfo info = read_camera_info(as("sensor_msgs/msg/CameraInfo"));
    require(info.D.size() <= 14, "more coefficients than a model has");
  });
  allow_refusal(
      [&] { require(is_plausible(read_imu_sample(as("sensor_msgs/msg/Imu"))), "no reading of a sensor"); });
}

/// The file metadata.yaml of a folder with one bag.
void bag_metadata(Bytes bytes) {
  static const auto bag = folder().write("rosbag2/a.mcap", {});
  (void)folder().write("rosbag2/metadata.yaml", bytes);
  attempt_to_read([&] { require(!bag_files(bag.parent_path()).files.empty(), "no files"); });
}

}  // namespace

std::vector<Target> bag_targets() {
  return {{"mcap", mcap}, {"db3", db3}, {"ros_message", ros_message}, {"bag_metadata", bag_metadata}};
}

}  // namespace antipode::fuzz
