// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include <opencv2/core.hpp>

namespace stereo_slam {

/// Two video files read in step. Reading in order is fast; an earlier frame restarts from the beginning.
class VideoPair {
 public:
  /// Throws std::runtime_error that names the file when one is missing or cannot be decoded.
  VideoPair(const std::filesystem::path& left, const std::filesystem::path& right);
  ~VideoPair();
  VideoPair(const VideoPair&) = delete;
  VideoPair& operator=(const VideoPair&) = delete;

  /// Number of frames by the headers; the shorter video counts.
  [[nodiscard]] std::size_t frames() const noexcept { return frames_; }
  [[nodiscard]] std::pair<std::size_t, std::size_t> frames_of_each() const noexcept {
    return frames_of_each_;
  }
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }  ///< 0 if the header has none

  /// Grey images of a frame; nothing if a video ends before it. Frame counts in headers are approximate, so a
  /// slightly early end is accepted. Throws std::runtime_error when the end is much too early.
  [[nodiscard]] std::optional<std::pair<cv::Mat, cv::Mat>> read(std::size_t index);

 private:
  struct Decoder;

  std::mutex mutex_;
  std::unique_ptr<Decoder> left_;
  std::unique_ptr<Decoder> right_;
  std::pair<std::size_t, std::size_t> frames_of_each_;
  std::size_t frames_ = 0;
  double rate_hz_ = 0.0;
};

}  // namespace stereo_slam
