// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "stereo_slam/support/cdr.hpp"
#include "stereo_slam/support/support.hpp"

/// The tiny recording as messages of ROS 2, which mcap_writer.hpp and db3_writer.hpp write to files.
namespace stereo_slam::test {

struct RecordedDrive {
  int first = 0;  ///< frames from this one
  int frames = 5;
  std::string image = "image_rect";  ///< the last part of the topics
  bool big_endian = false;
};

constexpr std::int64_t kDriveStart_ns = 1'500'000'000'000'000'000;
constexpr std::int64_t kDriveStep_ns = 100'000'000;

/// Each frame: a camera_info and an image of the right camera, then of the left one, and a message of an
/// unknown type. Images are recorded 30 ms after they were taken.
inline std::vector<TestMessage> drive_messages(const RecordedDrive& drive = {}) {
  using Tiny = TinySequence;
  const int end = drive.first + drive.frames;
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), end);
  std::vector<TestMessage> messages;
  for (int i = drive.first; i < end; ++i) {
    const std::int64_t taken_ns = kDriveStart_ns + kDriveStep_ns * i;
    for (const bool is_left : {false, true}) {
      const cv::Mat image = cv::imread((folder / (is_left ? "image_0" : "image_1") / frame_name(i)).string(),
                                       cv::IMREAD_GRAYSCALE);
      const std::string camera = is_left ? "/stereo/left/" : "/stereo/right/";
      const std::int64_t record_ns = taken_ns + 30'000'000;
      messages.push_back(
          {camera + "camera_info", "sensor_msgs/msg/CameraInfo", record_ns,
           cdr_camera_info({.coefficients = 0, .Tx = is_left ? 0.0 : -80.0}, drive.big_endian)});
      messages.push_back({camera + drive.image, "sensor_msgs/msg/Image", record_ns,
                          cdr_image({.stamp_ns = taken_ns,
                                     .width = Tiny::kWidth,
                                     .height = Tiny::kHeight,
                                     .step = Tiny::kWidth,
                                     .data = {image.datastart, image.dataend}},
                                    drive.big_endian)});
    }
    messages.push_back(
        {"/note", "std_msgs/msg/String", taken_ns, CdrWriter(drive.big_endian).put_text("note").take()});
  }
  return messages;
}

}  // namespace stereo_slam::test
