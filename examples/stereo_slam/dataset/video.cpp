// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/video.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <opencv2/videoio.hpp>

#include "stereo_slam/dataset/grey_image.hpp"
#include "stereo_slam/dataset/image_size.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

void require_size(const fs::path& file, const cv::VideoCapture& video) {
  const double width_px = video.get(cv::CAP_PROP_FRAME_WIDTH);
  const double height_px = video.get(cv::CAP_PROP_FRAME_HEIGHT);
  if (width_px * height_px <= static_cast<double>(kMostPixels)) return;
  fail(file, fmt::format("has {} x {} pixels; images may have up to {} pixels, scale them down", width_px,
                         height_px, kMostPixels));
}

constexpr std::array<std::string_view, 7> kExtensions = {".mp4",  ".avi", ".mkv", ".mov",
                                                         ".webm", ".m4v", ".mpg"};

cv::VideoCapture open(const fs::path& file) {
  if (!fs::exists(file)) fail(file, "missing; check the path in the calibration file");
  if (!fs::is_regular_file(file)) fail(file, "is not a video file");
  for (const int backend : {cv::CAP_FFMPEG, cv::CAP_OPENCV_MJPEG}) {
    cv::VideoCapture video;
    try {
      if (video.open(file.string(), backend) && video.isOpened()) {
        require_size(file, video);
        return video;
      }
    } catch (const cv::Exception&) {  // this backend cannot; the next one may
    }
  }
  fail(file, "cannot be opened as a video; convert it to MP4 with H.264 or AVI with MJPEG");
}

}  // namespace

bool has_video_name(const fs::path& file) {
  return std::find(kExtensions.begin(), kExtensions.end(), file.extension().string()) != kExtensions.end();
}

fs::path find_video(const fs::path& name) {
  for (const auto extension : kExtensions) {
    fs::path video = name;
    video += extension;
    if (fs::exists(video)) return video;
  }
  return name;
}

struct VideoPair::Decoder {
  fs::path file;
  cv::VideoCapture video;
  std::size_t next = 0;
  std::size_t promised = 0;  ///< frames, by count_frames()

  explicit Decoder(const fs::path& path) : file(path), video(open(path)) {}

  /// From the header, or by decoding the file if the header has none, or one that the file has no room for.
  std::size_t count_frames() {
    constexpr double kMostFrames = 1e7;  // eleven days at ten a second
    constexpr double kLeastFrameBytes = 64.0;
    const double most = std::min(kMostFrames, static_cast<double>(fs::file_size(file)) / kLeastFrameBytes);
    const double stated = video.get(cv::CAP_PROP_FRAME_COUNT);
    if (stated >= 1.0 && stated < most) return static_cast<std::size_t>(std::llround(stated));
    while (video.grab()) ++next;
    const std::size_t count = next;
    rewind();
    return count;
  }

  void rewind() {
    video = open(file);
    next = 0;
  }

  std::optional<cv::Mat> read(std::size_t index) {
    if (index < next) rewind();
    for (; next <= index; ++next) {
      if (!video.grab()) return std::nullopt;
    }
    cv::Mat image;
    if (!video.retrieve(image) || image.empty()) fail(file, fmt::format("frame {} cannot be decoded", index));
    return to_grey(image);
  }
};

VideoPair::VideoPair(const fs::path& left, const fs::path& right) : left_(std::make_unique<Decoder>(left)) {
  if (!right.empty()) right_ = std::make_unique<Decoder>(right);
  for (auto* decoder : {left_.get(), right_.get()}) {
    if (decoder != nullptr) decoder->promised = decoder->count_frames();
  }
  frames_of_each_ = {left_->promised, (right_ ? right_ : left_)->promised};
  frames_ = std::min(frames_of_each_.first, frames_of_each_.second);
  const double rate_hz = left_->video.get(cv::CAP_PROP_FPS);
  rate_hz_ = std::isfinite(rate_hz) && rate_hz >= 0.01 && rate_hz < 1e5 ? rate_hz : 0.0;
}

VideoPair::~VideoPair() = default;

/// Nothing where the video nearly is at its end; throws where it is not.
std::optional<cv::Mat> VideoPair::read(Decoder& decoder, std::size_t index) {
  auto image = decoder.read(index);
  constexpr std::size_t kSlack = 5;
  const bool nearly_done = index > 0 && index + std::max(kSlack, frames_ / 50) >= frames_;
  if (!image && !nearly_done) {
    fail(decoder.file,
         fmt::format("ends at frame {} of {}; the video is truncated or damaged", index, frames_));
  }
  if (!image && index < frames_) {
    warning_ = fmt::format(
        "{}: the video ends after {} frames, its header promises {}; check that it was copied as a whole",
        decoder.file.string(), decoder.next, decoder.promised);
  }
  return image;
}

std::string VideoPair::warning() {
  const std::lock_guard lock(mutex_);
  return warning_;
}

std::optional<RawPair> VideoPair::read(std::size_t index) {
  const std::lock_guard lock(mutex_);
  auto left = read(*left_, index);
  if (!left) return std::nullopt;
  if (!right_) {
    try {
      return split(*left);
    } catch (const std::invalid_argument& error) {
      fail(left_->file, error.what());
    }
  }
  auto right = read(*right_, index);
  if (!right) return std::nullopt;
  return RawPair{*left, *right};
}

}  // namespace stereo_slam
