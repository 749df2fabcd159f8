// SPDX-License-Identifier: MIT
// make_bag KITTI_DIR OUTPUT_DIR: the recording as rosbag2 writes it, drive_0.mcap and metadata.yaml.
#include <filesystem>
#include <fstream>

#include <opencv2/imgcodecs.hpp>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/mcap_writer.hpp"

using namespace stereo_slam::test;

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto sequence = stereo_slam::open_sequence(argv[1], "kitti");
  const auto& camera = sequence.camera;
  const std::filesystem::path output = argv[2];
  std::filesystem::create_directories(output);
  constexpr std::int64_t kFirst_ns = 1'700'000'000'000'000'000;
  CdrCameraInfo info{.coefficients = 0,
                     .width = static_cast<std::uint32_t>(camera.width_px),
                     .height = static_cast<std::uint32_t>(camera.height_px),
                     .f = camera.fx,
                     .cx = camera.cx,
                     .cy = camera.cy};
  McapWriter writer({.compression = "zstd", .chunk_bytes = 1 << 20});
  for (const auto& frame : sequence.frames) {
    const std::int64_t stamp_ns = kFirst_ns + frame.stamp_ns;
    for (const bool is_left : {true, false}) {
      const std::string topic = is_left ? "/stereo/left/" : "/stereo/right/";
      info.Tx = is_left ? 0.0 : -camera.fx * camera.baseline_m;
      writer.add(
          {topic + "camera_info", "sensor_msgs/msg/CameraInfo", stamp_ns, cdr_camera_info(info, false)});
      const cv::Mat image = cv::imread((is_left ? frame.left : frame.right).string(), cv::IMREAD_GRAYSCALE);
      writer.add({topic + "image_rect", "sensor_msgs/msg/Image", stamp_ns,
                  cdr_image({.stamp_ns = stamp_ns,
                             .width = info.width,
                             .height = info.height,
                             .step = info.width,
                             .data = {image.datastart, image.dataend}},
                            false)});
    }
  }
  std::ofstream(output / "drive_0.mcap", std::ios::binary) << writer.end().bytes;
  std::ofstream metadata(output / "metadata.yaml");
  metadata << "rosbag2_bagfile_information:\n  version: 8\n  storage_identifier: mcap\n"
              "  relative_file_paths:\n    - drive_0.mcap\n  compression_format: \"\"\n";
  return metadata ? 0 : 1;
}
