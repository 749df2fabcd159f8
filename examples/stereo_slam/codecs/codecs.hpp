// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stereo_slam {

/// An open video file or camera, read like a cv::VideoCapture. No function throws.
class Video {
 public:
  virtual ~Video() = default;

  /// Goes to the next image. False at the end.
  virtual bool grab() = 0;
  /// The image that grab() went to; empty if it cannot be decoded.
  virtual cv::Mat retrieve() = 0;
  /// A cv::VideoCaptureProperties; 0 if it is not known.
  [[nodiscard]] virtual double get(int property) const = 0;
  virtual void set(int property, double value) = 0;
};

/// Images and videos in all formats that OpenCV reads and writes. No function throws.
class Codecs {
 public:
  virtual ~Codecs() = default;

  /// `flags` are cv::ImreadModes. Empty if the image cannot be decoded.
  [[nodiscard]] virtual cv::Mat decode(std::span<const std::uint8_t> file, int flags) const = 0;
  /// The file's content in the format of the extension, such as ".png"; `parameters` are cv::ImwriteFlags
  /// with their values. Empty if the image cannot be encoded.
  [[nodiscard]] virtual std::vector<std::uint8_t> encode(const cv::Mat& image, const std::string& extension,
                                                         const std::vector<int>& parameters) const = 0;
  /// Opens a video with the first of `backends` (cv::VideoCaptureAPIs) that is able to; null if none is.
  /// FFmpeg gives up opening a source that delivers nothing for `timeout_ms`; 0 means its own 30 s.
  [[nodiscard]] virtual std::unique_ptr<Video> open_video(const std::string& name,
                                                          std::span<const int> backends,
                                                          int timeout_ms) const = 0;
};

/// OpenCV's codecs, in a shared library that the first call loads. On Debian the codecs depend on two hundred
/// libraries; loading these at every start would take 0.2 s, even in commands that read no images. Throws
/// std::runtime_error if the shared library is not installed with the program.
[[nodiscard]] const Codecs& opencv_codecs();

}  // namespace stereo_slam
