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

/// Two video files read in step. Frames are cheap in order; going back starts from the beginning.
class VideoPair {
 public:
  /// Throws std::runtime_error naming the file that is missing or that nothing can decode.
  VideoPair(const std::filesystem::path& left, const std::filesystem::path& right);
  ~VideoPair();
  VideoPair(const VideoPair&) = delete;
  VideoPair& operator=(const VideoPair&) = delete;

  /// What the two headers say; the shorter one counts.
  [[nodiscard]] std::size_t frames() const noexcept { return frames_; }
  [[nodiscard]] std::pair<std::size_t, std::size_t> frames_of_each() const noexcept {
    return frames_of_each_;
  }
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }  ///< 0 when the header does not say

  /// Grey images of a frame; nothing when a video ends before it. Headers count frames roughly, so that the
  /// end may come a little early; throws std::runtime_error when it comes much too early.
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
