// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "stereo_slam/support/support.hpp"

/// Videos whose frames have times of their own, which the writers of OpenCV do not write.
namespace stereo_slam::test {

/// What the header of a Matroska file says besides the size.
struct MatroskaHeader {
  double frame_ms = 0.0;     ///< duration of a frame; 0: nothing
  double duration_ms = 0.0;  ///< of the video; 0: nothing
};

/// A Matroska file (RFC 9559) of JPEG images, each with its time, in the order of the file.
class MatroskaVideo {
 public:
  void add(const cv::Mat& image, int time_ms) {
    std::vector<unsigned char> jpeg;
    cv::imencode(".jpg", image, jpeg);
    const std::string block =
        std::string("\x81") + number(0, 2) + "\x80" + std::string(jpeg.begin(), jpeg.end());
    clusters_ += element("\x1F\x43\xB6\x75",
                         integer("\xE7", static_cast<std::uint64_t>(time_ms)) + element("\xA3", block));
    size_ = image.size();
  }

  void write(const fs::path& file, const MatroskaHeader& header = {}) const {
    const std::string ebml = element("\x1A\x45\xDF\xA3", element("\x42\x82", "matroska") +
                                                             integer("\x42\x87", 4) + integer("\x42\x85", 2));
    std::string info = integer("\x2A\xD7\xB1", 1'000'000);  // the unit of times, ns
    if (header.duration_ms > 0.0) info += real("\x44\x89", header.duration_ms);
    const std::string video = integer("\xB0", static_cast<std::uint64_t>(size_.width)) +
                              integer("\xBA", static_cast<std::uint64_t>(size_.height));
    std::string track = integer("\xD7", 1) + integer("\x73\xC5", 1) + integer("\x83", 1) +
                        element("\x86", "V_MJPEG") + element("\xE0", video);
    if (header.frame_ms > 0.0)
      track += integer("\x23\xE3\x83", static_cast<std::uint64_t>(1e6 * header.frame_ms));
    write_text(file, ebml + element("\x18\x53\x80\x67",
                                    element("\x15\x49\xA9\x66", info) +
                                        element("\x16\x54\xAE\x6B", element("\xAE", track)) + clusters_));
  }

 private:
  static std::string number(std::uint64_t value, int bytes) {
    std::string text;
    for (int i = bytes; i-- > 0;) text += static_cast<char>(value >> (8 * i) & 0xFFU);
    return text;
  }
  static std::string element(const std::string& id, const std::string& content) {
    return id + "\x01" + number(content.size(), 7) + content;  // the length in eight bytes
  }
  static std::string integer(const std::string& id, std::uint64_t value) {
    return element(id, number(value, 8));
  }
  static std::string real(const std::string& id, double value) {
    return integer(id, std::bit_cast<std::uint64_t>(value));
  }

  std::string clusters_;
  cv::Size size_;
};

}  // namespace stereo_slam::test
