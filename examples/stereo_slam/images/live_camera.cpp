// SPDX-License-Identifier: MIT
#include "stereo_slam/images/live_camera.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/videoio.hpp>

#include "stereo_slam/codecs/codecs.hpp"
#include "stereo_slam/images/grey_image.hpp"
#include "stereo_slam/images/image_size.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPipelineMark = " ! ";
constexpr std::string_view kDevices = "/dev/video";
constexpr int kTimeout_ms = 6000;

/// OpenCV's backends for a source. Without this choice OpenCV would also try the drivers of industrial
/// cameras, which takes time and leaks memory.
[[nodiscard]] std::vector<int> backends_for(std::string_view name) {
  if (name.find(kPipelineMark) != std::string_view::npos) return {cv::CAP_GSTREAMER};
  if (name.starts_with(kDevices)) return {cv::CAP_V4L2};
  return {cv::CAP_FFMPEG, cv::CAP_GSTREAMER};
}

}  // namespace

bool is_live(const fs::path& source) {
  const std::string name = source.string();
  if (name.starts_with(kDevices)) return true;
  const bool is_text = name.find("://") != std::string::npos || name.find(kPipelineMark) != std::string::npos;
  std::error_code error;  // as of a pipeline that is too long for a name
  return is_text && !fs::exists(source, error);
}

struct LiveCamera::Device {
  std::string name;
  std::unique_ptr<Video> capture;

  explicit Device(const fs::path& source)
      : name(source.string()), capture(opencv_codecs().open_video(name, backends_for(name), kTimeout_ms)) {
    if (!capture) fail("cannot be opened; check its name, and that no other program uses it");
    capture->set(cv::CAP_PROP_BUFFERSIZE, 1);  // if the driver can: only the latest image is of use
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(fmt::format("{}: {}", name, what));
  }

  cv::Mat retrieve(std::string& fault) {
    const cv::Mat image = capture->retrieve();
    if (image.empty()) {
      fault = fmt::format("{}: delivers an image that cannot be decoded", name);
      return {};
    }
    if (image.total() > kMostPixels)
      fail(fmt::format("delivers images with more than {} pixels", kMostPixels));
    return to_grey(image);
  }
};

LiveCamera::LiveCamera(const fs::path& left, const fs::path& right) : left_(std::make_unique<Device>(left)) {
  if (!right.empty()) right_ = std::make_unique<Device>(right);
}

LiveCamera::~LiveCamera() = default;

std::optional<RawPair> LiveCamera::read(std::size_t) {
  const bool grabbed = left_->capture->grab() && (!right_ || right_->capture->grab());
  if (!grabbed) {
    if (!began_) left_->fail("delivers no images; check its cable, and that no other program uses it");
    return std::nullopt;
  }
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  last_stamp_ns_ = std::max<std::int64_t>(std::chrono::nanoseconds(now).count(), last_stamp_ns_ + 1);
  began_ = true;
  RawPair pair;
  if (right_) {
    pair.left = left_->retrieve(pair.left_fault);
    pair.right = right_->retrieve(pair.right_fault);
  } else {
    const cv::Mat both = left_->retrieve(pair.left_fault);
    pair.right_fault = pair.left_fault;
    try {
      if (!both.empty()) pair = split(both);
    } catch (const std::invalid_argument& error) {
      left_->fail(error.what());
    }
  }
  pair.stamp_ns = last_stamp_ns_;
  return pair;
}

}  // namespace stereo_slam
