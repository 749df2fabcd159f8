// SPDX-License-Identifier: MIT
// Writes a recording as a bag of ROS 2 (MCAP) as large as those of robots: its images, again and again, among
// the messages of other sensors. See docs/results/bags.md.
//
//   bag_of_recording RECORDING FILE.mcap [none|lz4|zstd [GIGABYTES [OTHERS]]]
//
// The messages have GIGABYTES in all; without it, the recording comes once. OTHERS (0) is the number of
// messages of 300 kB after each image: points of laser scans. Chunks have the size that rosbag2 gives them.
// The recording is one in KITTI layout.
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/support/mcap_writer.hpp"

namespace {

using namespace stereo_slam;
using test::TestMessage;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr std::size_t kOther_bytes = 300'000;
constexpr std::size_t kChunk_bytes = 786'432;

/// Points of laser scans: x, y, z and the intensity as float, in steps of 4 mm.
std::vector<std::uint8_t> make_scans() {
  std::vector<std::uint8_t> bytes;
  std::mt19937 random(1);
  for (std::size_t i = 0; bytes.size() < 32 * kOther_bytes; ++i) {
    const double angle = 0.003 * static_cast<double>(i % 2094);
    const double range = 10.0 + 8.0 * std::sin(7.0 * angle) + 1e-3 * (random() % 40);
    const auto put = [&](double value) {
      const auto four = std::bit_cast<std::array<std::uint8_t, 4>>(static_cast<float>(value));
      bytes.insert(bytes.end(), four.begin(), four.end());
    };
    for (const double position : {range * std::cos(angle), range * std::sin(angle), 0.03 * range})
      put(0.004 * std::round(position / 0.004));
    put(static_cast<double>(random() % 100));
  }
  return bytes;
}

TestMessage image_message(const std::string& side, const cv::Mat& image, std::int64_t taken_ns) {
  constexpr std::int64_t kDelay_ns = 3'000'000;  // between taking and recording an image
  return {"/stereo/" + side + "/image_rect", "sensor_msgs/msg/Image", taken_ns + kDelay_ns,
          test::cdr_image({.stamp_ns = taken_ns,
                           .width = static_cast<std::uint32_t>(image.cols),
                           .height = static_cast<std::uint32_t>(image.rows),
                           .step = static_cast<std::uint32_t>(image.cols),
                           .data = {image.datastart, image.dataend}},
                          false)};
}

TestMessage calibration_message(const std::string& side, const StereoCamera& camera) {
  const double Tx = side == "left" ? 0.0 : -camera.fx * camera.baseline_m;
  return {"/stereo/" + side + "/camera_info", "sensor_msgs/msg/CameraInfo", kStart_ns,
          test::cdr_camera_info({.coefficients = 5,
                                 .width = static_cast<std::uint32_t>(camera.width_px),
                                 .height = static_cast<std::uint32_t>(camera.height_px),
                                 .f = camera.fx,
                                 .cx = camera.cx,
                                 .cy = camera.cy,
                                 .Tx = Tx},
                                false)};
}

/// Writes a bag to a file, a chunk at a time.
class Bag {
 public:
  Bag(const std::string& file, const std::string& compression)
      : stream_(file, std::ios::binary),
        writer_({.compression = compression == "none" ? "" : compression, .chunk_bytes = kChunk_bytes}) {}

  void add(const TestMessage& message) {
    bytes_ += message.bytes.size();
    writer_.add(message);
    stream_ << writer_.take();
  }

  void end() {
    stream_ << writer_.end().bytes;
    stream_.close();
    if (!stream_) throw std::runtime_error("the bag cannot be written");
  }

  /// Of the messages.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  std::ofstream stream_;
  test::McapWriter writer_;
  std::size_t bytes_ = 0;
};

void write_bag(const std::vector<std::string>& arguments) {
  const StereoSequence sequence = open_sequence(arguments[0], "auto");
  Bag bag(arguments[1], arguments.size() > 2 ? arguments[2] : "none");
  const auto most_bytes =
      static_cast<std::size_t>(1e9 * (arguments.size() > 3 ? std::stod(arguments[3]) : 0.0));
  const int others = arguments.size() > 4 ? std::stoi(arguments[4]) : 0;
  const auto scans = make_scans();
  std::size_t scan = 0;
  const std::int64_t first_ns = sequence.frames.front().stamp_ns;
  const std::int64_t duration_ns = sequence.frames.back().stamp_ns - first_ns + 100'000'000;
  for (const auto* side : {"left", "right"}) bag.add(calibration_message(side, sequence.camera));
  for (std::int64_t round = 0; round == 0 || bag.bytes() < most_bytes; ++round) {
    for (std::size_t i = 0; i < sequence.frames.size() && (most_bytes == 0 || bag.bytes() < most_bytes);
         ++i) {
      const auto frame = load_frame(sequence, i);
      const std::int64_t taken_ns = kStart_ns + round * duration_ns + sequence.frames[i].stamp_ns - first_ns;
      for (const auto* side : {"left", "right"}) {
        bag.add(image_message(side, side[0] == 'l' ? frame.left : frame.right, taken_ns));
        for (int k = 0; k < others; ++k) {
          const auto* begin = scans.data() + (scan++ * 7919 % 31) * kOther_bytes;
          bag.add({"/scan", "sensor_msgs/msg/PointCloud2", taken_ns + 3'000'000 + k,
                   std::vector<std::uint8_t>(begin, begin + kOther_bytes)});
        }
      }
    }
  }
  bag.end();
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() < 2 || arguments.size() > 5) {
    std::fputs("usage: bag_of_recording RECORDING FILE.mcap [none|lz4|zstd [GIGABYTES [OTHERS]]]\n", stderr);
    return 2;
  }
  try {
    write_bag(arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bag_of_recording: %s\n", error.what());
    return 1;
  }
  return 0;
}
