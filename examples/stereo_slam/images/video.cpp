// SPDX-License-Identifier: MIT
#include "stereo_slam/images/video.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <opencv2/videoio.hpp>

#include "stereo_slam/codecs/codecs.hpp"
#include "stereo_slam/images/grey_image.hpp"
#include "stereo_slam/images/image_size.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

void require_size(const fs::path& file, const Video& video) {
  const double width_px = video.get(cv::CAP_PROP_FRAME_WIDTH);
  const double height_px = video.get(cv::CAP_PROP_FRAME_HEIGHT);
  if (width_px * height_px <= static_cast<double>(kMostPixels)) return;
  fail(file, "has {} x {} pixels; images may have up to {} pixels", width_px, height_px, kMostPixels);
}

constexpr std::array<std::string_view, 11> kExtensions = {".mp4", ".avi",  ".mkv", ".mov", ".webm", ".m4v",
                                                          ".mpg", ".mpeg", ".ts",  ".wmv", ".mts"};

std::unique_ptr<Video> open(const fs::path& file) {
  if (!fs::exists(file)) fail(file, "missing; check the path in the calibration file");
  if (!fs::is_regular_file(file)) fail(file, "is not a video file");
  constexpr std::array<int, 2> kBackends = {cv::CAP_FFMPEG, cv::CAP_OPENCV_MJPEG};
  auto video = opencv_codecs().open_video(file.string(), kBackends, 0);
  if (!video) fail(file, "cannot be opened as a video; convert it to MP4 with H.264 or AVI with MJPEG");
  require_size(file, *video);
  return video;
}

/// Whether the format has the number of frames in its header: AVI and MP4. Matroska, WebM and MPEG have the
/// duration at most.
bool counts_frames(const fs::path& file) {
  std::array<char, 12> bytes{};
  std::ifstream(file, std::ios::binary).read(bytes.data(), bytes.size());
  const std::string_view text(bytes.data(), bytes.size());
  constexpr std::array<std::string_view, 6> kBoxes = {"ftyp", "moov", "mdat", "free", "wide", "skip"};
  return text.starts_with("RIFF") || std::ranges::find(kBoxes, text.substr(4, 4)) != kBoxes.end();
}

/// The rate, or 0 if no camera has it.
double possible_rate(double rate_hz) {
  return std::isfinite(rate_hz) && rate_hz >= 0.01 && rate_hz < 1e5 ? rate_hz : 0.0;
}

/// The number of packets, each of a frame, without decoding them; 0 if the decoder does not tell them apart.
std::size_t count_packets(const fs::path& file) {
  constexpr double kPackets = -1.0;
  const auto video = open(file);
  video->set(cv::CAP_PROP_FORMAT, kPackets);
  if (video->get(cv::CAP_PROP_FORMAT) != kPackets) return 0;
  std::size_t count = 0;
  while (video->grab()) ++count;
  return count;
}

}  // namespace

bool has_video_name(const fs::path& file) {
  return std::ranges::find(kExtensions, lower_case(file.extension().string())) != kExtensions.end();
}

fs::path find_video(const fs::path& name) {
  for (const auto extension : kExtensions) {
    fs::path video = name;
    video += extension;
    if (fs::exists(video)) return video;
  }
  std::error_code error;  // without the folder there is no video
  for (const auto& entry : fs::directory_iterator(name.parent_path(), error)) {
    if (entry.path().stem() == name.filename() && has_video_name(entry.path())) return entry.path();
  }
  return name;
}

struct VideoPair::Decoder {
  fs::path file;
  std::unique_ptr<Video> video;
  std::size_t next = 0;
  std::size_t promised = 0;  ///< frames, by count_frames()
  double rate_hz = 0.0;      ///< their mean rate; 0 if it is not known
  double stamp_ms = 0.0;     ///< time of the frame read last
  double last_ms = 0.0;      ///< time of the last frame, if all were decoded to count them
  cv::Mat image;             ///< read last

  explicit Decoder(const fs::path& path) : file(path), video(open(path)) {}

  /// Finds the number of frames and the rate. The header is believed if its format counts frames. Otherwise
  /// the header only knows the duration, and the frames are counted.
  void count_frames() {
    constexpr double kMostFrames = 1e7;  // eleven days at ten a second
    constexpr double kLeastFrameBytes = 64.0;
    const double most = std::min(kMostFrames, static_cast<double>(fs::file_size(file)) / kLeastFrameBytes);
    const double stated = video->get(cv::CAP_PROP_FRAME_COUNT);
    const double header_rate = video->get(cv::CAP_PROP_FPS);
    const bool counted = counts_frames(file);
    const bool is_stated = std::isfinite(stated) && stated >= 1.0;
    rate_hz = possible_rate(header_rate);
    if (counted && is_stated && stated < most) {
      promised = static_cast<std::size_t>(std::llround(stated));
      return;
    }
    const bool has_duration = rate_hz > 0.0 && is_stated;
    if (counted || has_duration) promised = count_packets(file);
    if (promised == 0) {
      for (; video->grab(); ++promised) last_ms = video->get(cv::CAP_PROP_POS_MSEC);
      rewind();
    }
    const auto count = static_cast<double>(promised);
    if (counted || std::abs(stated - count) < 1.0) return;
    rate_hz = possible_rate(has_duration ? header_rate * count / stated : 1e3 * (count - 1.0) / last_ms);
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
    return colour.empty() ? colour : to_grey(colour);
  }

  [[nodiscard]] std::string fault_of(std::size_t index) const {
    return fmt::format("{}: frame {} cannot be decoded", file.string(), index);
  }
};

VideoPair::VideoPair(const fs::path& left, const fs::path& right) : left_(std::make_unique<Decoder>(left)) {
  if (!right.empty()) right_ = std::make_unique<Decoder>(right);
  for (auto* decoder : {left_.get(), right_.get()}) {
    if (decoder != nullptr) decoder->count_frames();
  }
  frames_of_each_ = {left_->promised, (right_ ? right_ : left_)->promised};
  frames_ = std::min(frames_of_each_.first, frames_of_each_.second);
  rate_hz_ = left_->rate_hz;
}

VideoPair::~VideoPair() = default;

/// Whether the last frame has the time that it has by the header: then frames are missing among the others,
/// which a recorder dropped, and none at the end.
bool VideoPair::ends_in_time(const Decoder& decoder) const {
  constexpr double kSlack = 1.5;  // frames
  const double last_frame = 1e-3 * decoder.stamp_ms * decoder.rate_hz;
  return decoder.rate_hz > 0.0 && last_frame + kSlack >= static_cast<double>(decoder.promised);
}

/// The frame, or nothing if the video ends before it. Throws if the video ends much too early.
std::optional<cv::Mat> VideoPair::read(Decoder& decoder, std::size_t index) {
  auto image = decoder.read(index);
  if (!image && index > 0 && ends_in_time(decoder)) return image;
  constexpr std::size_t kSlack = 5;
  const bool nearly_done = index > 0 && index + std::max(kSlack, frames_ / 50) >= frames_;
  if (!image && !nearly_done) {
    fail(decoder.file, "ends at frame {} of {}; the video is truncated or damaged", index, frames_);
  }
  if (!image && index < frames_) {
    warning_ = fmt::format(
        "{}: the video ends after {}, its header promises {}; check that it was copied as a whole",
        decoder.file.string(), counted(decoder.next, "frame"), decoder.promised);
  }
  return image;
}

/// The time of a frame, in the left video: that of the constant rate, if it is as near as formats round
/// times.
std::int64_t VideoPair::stamp_ns(std::size_t index) {
  constexpr double kRounding_ns = 1e6;
  const double own_ns = 1e6 * left_->stamp_ms;
  const auto frame = static_cast<double>(frame_of(index, /*is_left=*/true));
  const double even_ns = rate_hz_ > 0.0 ? 1e9 * frame / rate_hz_ : 0.0;
  const bool known = index == 0 || (std::isfinite(own_ns) && own_ns > 0.0);
  const bool even = rate_hz_ > 0.0 && (!known || std::abs(own_ns - even_ns) <= kRounding_ns);
  std::int64_t stamp_ns = std::llround(even ? even_ns : own_ns);
  if (index == shown_ + 1) stamp_ns = std::max(stamp_ns, shown_ns_ + 1);
  return stamp_ns;
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

/// The frame of a video that is in a pair.
std::size_t VideoPair::frame_of(std::size_t index, bool is_left) const {
  std::size_t frame = index;
  for (const auto& skip : skips_) {
    if (skip.of_left == is_left && skip.from <= index) frame += skip.frames;
  }
  return frame;
}

/// Leaves out frames of one video if the other lacks them, from the pair before this one on, and replaces the
/// image of this pair.
void VideoPair::keep_in_step(std::size_t index, cv::Mat& left, cv::Mat& right) {
  if (rate_hz_ == 0.0) return;
  constexpr double kMostOfAFrame = 0.75;
  const double ahead_ms = left_->stamp_ms - right_->stamp_ms;
  if (stamps_.in_step(index, ahead_ms, kMostOfAFrame * 1e3 / rate_hz_)) return;
  const double jump_ms = ahead_ms - stamps_.before_ms();
  const bool left_lacks = jump_ms > 0.0;
  const auto frames =
      static_cast<std::size_t>(std::max(1LL, std::llround(1e-3 * std::abs(jump_ms) * rate_hz_)));
  const auto& [lacking, other] =
      left_lacks ? std::pair(left_->file, right_->file) : std::pair(right_->file, left_->file);
  skips_.push_back({.from = index - 1, .of_left = !left_lacks, .frames = frames});
  stamps_.restart();
  if (warning_.empty()) {
    warning_ = fmt::format(
        "{}: lacks {} before frame {} that {} has, by their times; from the next frame on the images are "
        "paired without it",
        lacking.string(), counted(frames, "frame"), index - 1, other.string());
  }
  cv::Mat& image = left_lacks ? right : left;
  const auto next = (left_lacks ? right_ : left_)->read(frame_of(index, !left_lacks));
  if (next) image = *next;
}

/// Sets the warning if the image of one camera is exactly that of the frame before, and the other camera's is
/// not.
void VideoPair::note_repetition(std::size_t index, const RawPair& pair) {
  const auto difference = [](const cv::Mat& a, const cv::Mat& b) {
    return a.size() == b.size() ? cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total()) : 255.0;
  };
  const bool comparable = pair.complete() && !left_->image.empty() && !right_->image.empty();
  if (index == shown_ + 1 && comparable && warning_.empty()) {
    // Mean change in grey levels. With less change, the camera may stand still and give the same image twice.
    constexpr double kMoved = 1.0;
    const double left = difference(pair.left, left_->image);
    const double right = difference(pair.right, right_->image);
    if (std::min(left, right) == 0.0 && std::max(left, right) > kMoved) {
      warning_ = fmt::format(
          "{}: frame {} shows the frame before it again, unlike that of the other camera; the video is "
          "damaged there, or a frame was lost",
          (left == 0.0 ? left_ : right_)->file.string(), index);
    }
  }
  left_->image = pair.left;
  right_->image = pair.right;
}

std::string VideoPair::warning() {
  const std::lock_guard lock(mutex_);
  return warning_;
}

std::optional<RawPair> VideoPair::read(std::size_t index) {
  const std::lock_guard lock(mutex_);
  auto pair = read_images(index);
  if (!pair) return std::nullopt;
  const std::int64_t stamp = stamp_ns(index);
  shown_ = index;
  shown_ns_ = stamp;
  if (own_times_) pair->stamp_ns = stamp;
  return pair;
}

std::optional<RawPair> VideoPair::read_images(std::size_t index) {
  auto left = read(*left_, frame_of(index, true));
  if (!left) return std::nullopt;
  RawPair pair;
  if (left->empty()) pair.left_fault = left_->fault_of(index);
  if (!right_) {
    if (left->empty()) {
      pair.right_fault = pair.left_fault;
      return pair;
    }
    try {
      return split(*left);
    } catch (const std::invalid_argument& error) {
      fail(left_->file, error.what());
    }
  }
  auto right = read(*right_, frame_of(index, false));
  if (!right) return std::nullopt;
  if (right->empty()) pair.right_fault = right_->fault_of(index);
  keep_in_step(index, *left, *right);
  pair.left = *left;
  pair.right = *right;
  note_repetition(index, pair);
  return pair;
}

}  // namespace stereo_slam
