// SPDX-License-Identifier: MIT
#include "stereo_slam/report/thumbnails.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace stereo_slam::report {

void Thumbnails::offer(const StereoFrame& frame) {
  if (offered_++ % spacing_ != 0) return;
  images_.push_back({frame.index, small_image(frame.left)});
  if (images_.size() <= kMost) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < images_.size(); i += 2) images_[kept++] = std::move(images_[i]);
  images_.resize(kept);
  spacing_ *= 2;
}

std::vector<Thumbnail> Thumbnails::images() const {
  std::vector<Thumbnail> thumbnails;
  for (const auto& [frame, image] : images_) thumbnails.push_back({frame, to_jpeg(image)});
  return thumbnails;
}

cv::Mat small_image(const cv::Mat& image) {
  const int factor = (image.cols + Thumbnails::kWidth_px - 1) / Thumbnails::kWidth_px;
  const cv::Size size(image.cols / factor, image.rows / factor);
  if (factor == 1 || size.height == 0) return image.clone();
  cv::Mat scaled;
  cv::resize(image(cv::Rect(0, 0, factor * size.width, factor * size.height)), scaled, size, 0.0, 0.0,
             cv::INTER_AREA);
  return scaled;
}

std::vector<std::uint8_t> to_jpeg(const cv::Mat& image) {
  constexpr int kQuality = 60;
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  return jpeg;
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) -> std::uint32_t { return k < bytes.size() ? bytes[k] : 0; };
    const std::uint32_t triple = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    const std::array<char, 4> digits = {kDigits[triple >> 18], kDigits[triple >> 12 & 63],
                                        kDigits[triple >> 6 & 63], kDigits[triple & 63]};
    text.append(digits.data(), std::min<std::size_t>(4, bytes.size() - i + 1));
  }
  text.resize((bytes.size() + 2) / 3 * 4, '=');
  return text;
}

}  // namespace stereo_slam::report
