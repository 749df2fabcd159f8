// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/images/pair_source.hpp"

namespace stereo_slam {

/// Whether the extension is that of a video: mp4, avi, mkv, mov, webm, m4v, mpg, mpeg, ts, mts, wmv.
[[nodiscard]] bool has_video_name(const std::filesystem::path& file);

/// The video NAME.mp4, .avi ..., if there is one; else NAME.
[[nodiscard]] std::filesystem::path find_video(const std::filesystem::path& name);

/// Checks by the difference of their stamps that two videos stay in step.
class StampComparison {
 public:
  /// Takes the difference of the stamps of frame `index`, to be called frame by frame. False if the
  /// difference jumped between the frames index - 2 and index - 1 by more than the tolerance, and the new
  /// difference is confirmed by frame `index`. A different value at a single frame may be due to rounding.
  [[nodiscard]] bool in_step(std::size_t index, double difference_ms, double tolerance_ms);

  /// The difference before the jump, ms, once in_step() has returned false.
  [[nodiscard]] double before_ms() const { return recent_ms_.front(); }

  /// Forgets the differences, after what made them jump was corrected.
  void restart() { recent_ms_.clear(); }

 private:
  std::size_t last_ = 0;
  std::deque<double> recent_ms_;
};

/// Two video files read in step, or one that shows both cameras side by side. Where one of two lacks frames
/// that the other has, by its times, these are left out from the second frame after them on. Reading in order
/// is fast; an earlier frame restarts from the beginning.
class VideoPair : public PairSource {
 public:
  /// `right` is empty for images side by side. Throws std::runtime_error that names the file when one is
  /// missing or cannot be decoded.
  VideoPair(const std::filesystem::path& left, const std::filesystem::path& right);
  ~VideoPair() override;

  /// Number of frames of the shorter video, by the headers, or counted where these have none.
  [[nodiscard]] std::size_t frames() const noexcept { return frames_; }
  [[nodiscard]] std::pair<std::size_t, std::size_t> frames_of_each() const noexcept {
    return frames_of_each_;
  }
  /// The mean rate of the left video; 0 if it is not known.
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }

  /// Lets the pairs have the times of the left video's frames, which need not be equally far apart.
  void use_own_times() noexcept { own_times_ = true; }

  /// Grey images of a frame; nothing if a video ends before it. Frame counts in headers are approximate, so a
  /// slightly early end is accepted. Throws std::runtime_error when the end is much too early.
  [[nodiscard]] std::optional<RawPair> read(std::size_t index) override;

  /// Says if a video ended before the frame count of its header (known once a frame beyond its end was asked
  /// for), or if one of two videos showed a frame twice.
  [[nodiscard]] std::string warning() override;

 private:
  struct Decoder;

  [[nodiscard]] std::optional<RawPair> read_images(std::size_t index);
  [[nodiscard]] std::optional<cv::Mat> read(Decoder& decoder, std::size_t index);
  [[nodiscard]] bool ends_in_time(const Decoder& decoder) const;
  [[nodiscard]] std::int64_t stamp_ns(std::size_t index);
  void keep_in_step(std::size_t index, cv::Mat& left, cv::Mat& right);
  void note_repetition(std::size_t index, const RawPair& pair);

  /// From a pair on, how many more frames of a video are left out.
  struct Skip {
    std::size_t from = 0;
    bool of_left = false;
    std::size_t frames = 0;
  };
  [[nodiscard]] std::size_t frame_of(std::size_t index, bool is_left) const;

  std::mutex mutex_;
  std::vector<Skip> skips_;
  std::unique_ptr<Decoder> left_;
  std::unique_ptr<Decoder> right_;  // null for images side by side
  std::pair<std::size_t, std::size_t> frames_of_each_;
  std::size_t frames_ = 0;
  double rate_hz_ = 0.0;
  bool own_times_ = false;
  StampComparison stamps_;
  std::size_t shown_ = 0;      ///< index of the pair that was read last
  std::int64_t shown_ns_ = 0;  ///< its stamp
  std::string warning_;
};

}  // namespace stereo_slam
