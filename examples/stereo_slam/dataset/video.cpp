// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/video.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <opencv2/videoio.hpp>

#include "stereo_slam/codecs/codecs.hpp"
#include "stereo_slam/dataset/grey_image.hpp"
#include "stereo_slam/dataset/image_size.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

void require_size(const fs::path& file, const Video& video) {
  const double width_px = video.get(cv::CAP_PROP_FRAME_WIDTH);
  const double height_px = video.get(cv::CAP_PROP_FRAME_HEIGHT);
  if (width_px * height_px <= static_cast<double>(kMostPixels)) return;
  fail(file, fmt::format("has {} x {} pixels; images may have up to {} pixels, scale them down", width_px,
                         height_px, kMostPixels));
}

constexpr std::array<std::string_view, 7> kExtensions = {".mp4",  ".avi", ".mkv", ".mov",
                                                         ".webm", ".m4v", ".mpg"};

std::unique_ptr<Video> open(const fs::path& file) {
  if (!fs::exists(file)) fail(file, "missing; check the path in the calibration file");
  if (!fs::is_regular_file(file)) fail(file, "is not a video file");
  constexpr std::array<int, 2> kBackends = {cv::CAP_FFMPEG, cv::CAP_OPENCV_MJPEG};
  auto video = opencv_codecs().open_video(file.string(), kBackends, 0);
  if (!video) fail(file, "cannot be opened as a video; convert it to MP4 with H.264 or AVI with MJPEG");
  require_size(file, *video);
  return video;
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
  std::unique_ptr<Video> video;
  std::size_t next = 0;
  std::size_t promised = 0;  ///< frames, by count_frames()
  double stamp_ms = 0.0;     ///< time of the frame read last
  cv::Mat image;             ///< read last

  explicit Decoder(const fs::path& path) : file(path), video(open(path)) {}

  /// The frame count of the header; if the header has none, or one too large for the file size, the file is
  /// decoded and its frames are counted.
  std::size_t count_frames() {
    constexpr double kMostFrames = 1e7;  // eleven days at ten a second
    constexpr double kLeastFrameBytes = 64.0;
    const double most = std::min(kMostFrames, static_cast<double>(fs::file_size(file)) / kLeastFrameBytes);
    const double stated = video->get(cv::CAP_PROP_FRAME_COUNT);
    if (stated >= 1.0 && stated < most) return static_cast<std::size_t>(std::llround(stated));
    while (video->grab()) ++next;
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
      if (!video->grab()) return std::nullopt;
    }
    stamp_ms = video->get(cv::CAP_PROP_POS_MSEC);
    const cv::Mat colour = video->retrieve();
    if (colour.empty()) fail(file, fmt::format("frame {} cannot be decoded", index));
    return to_grey(colour);
  }
};

VideoPair::VideoPair(const fs::path& left, const fs::path& right) : left_(std::make_unique<Decoder>(left)) {
  if (!right.empty()) right_ = std::make_unique<Decoder>(right);
  for (auto* decoder : {left_.get(), right_.get()}) {
    if (decoder != nullptr) decoder->promised = decoder->count_frames();
  }
  frames_of_each_ = {left_->promised, (right_ ? right_ : left_)->promised};
  frames_ = std::min(frames_of_each_.first, frames_of_each_.second);
  const double rate_hz = left_->video->get(cv::CAP_PROP_FPS);
  rate_hz_ = std::isfinite(rate_hz) && rate_hz >= 0.01 && rate_hz < 1e5 ? rate_hz : 0.0;
}

VideoPair::~VideoPair() = default;

/// The frame, or nothing if the video ends before it. Throws if the video ends much too early.
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

bool StampComparison::in_step(std::size_t index, double difference_ms, double tolerance_ms) {
  constexpr std::size_t kCompared = 4;
  if (index <= last_) recent_ms_.clear();  // read again from its beginning
  last_ = index;
  if (recent_ms_.empty()) recent_ms_.push_back(difference_ms);
  recent_ms_.push_back(difference_ms);
  if (recent_ms_.size() < kCompared) return true;
  if (recent_ms_.size() > kCompared) recent_ms_.pop_front();
  const auto agree = [&](std::size_t i, std::size_t j) {
    return std::abs(recent_ms_[i] - recent_ms_[j]) <= tolerance_ms;
  };
  return !agree(0, 1) || agree(1, 2) || agree(1, 3) || !agree(2, 3);
}

/// Throws if one of the videos lacks a frame that the other has: all pairs after it would be wrong.
void VideoPair::require_in_step(std::size_t index) {
  if (rate_hz_ == 0.0) return;
  constexpr double kMostOfAFrame = 0.75;
  const double ahead_ms = left_->stamp_ms - right_->stamp_ms;
  if (stamps_.in_step(index, ahead_ms, kMostOfAFrame * 1e3 / rate_hz_)) return;
  const bool left_lacks = ahead_ms > stamps_.before_ms();
  const auto& [lacking, other] =
      left_lacks ? std::pair(left_->file, right_->file) : std::pair(right_->file, left_->file);
  fail(lacking,
       fmt::format("lacks a frame before frame {}: from there on its stamps are ahead of those of {}, "
                   "so left and right images do not belong together; convert both videos again",
                   index - 1, other.string()));
}

/// Sets the warning if the image of one camera is exactly that of the frame before, and the other camera's is
/// not.
void VideoPair::note_repetition(std::size_t index, const RawPair& pair) {
  const auto difference = [](const cv::Mat& a, const cv::Mat& b) {
    return a.size() == b.size() ? cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total()) : 255.0;
  };
  if (index == shown_ + 1 && warning_.empty()) {
    // Mean change in grey levels. With less change, the camera may stand still and give the same image twice.
    constexpr double kMoved = 1.0;
    const double left = difference(pair.left, left_->image);
    const double right = difference(pair.right, right_->image);
    if (std::min(left, right) == 0.0 && std::max(left, right) > kMoved) {
      warning_ = fmt::format(
          "{}: frame {} shows the frame before it again, unlike that of the other camera; the video is "
          "damaged "
          "there, or a frame was lost",
          (left == 0.0 ? left_ : right_)->file.string(), index);
    }
  }
  shown_ = index;
  left_->image = pair.left;
  right_->image = pair.right;
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
  require_in_step(index);
  RawPair pair{*left, *right};
  note_repetition(index, pair);
  return pair;
}

}  // namespace stereo_slam
