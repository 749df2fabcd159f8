// SPDX-License-Identifier: MIT
#include "stereo_slam/report/thumbnails.hpp"

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <jpeglib.h>
#include <string_view>

#include <opencv2/imgproc.hpp>

namespace stereo_slam::report {
namespace {

/// Encodes with libjpeg, whose errors end in a longjmp.
class JpegEncoder {
 public:
  JpegEncoder() {
    compressor_.err = jpeg_std_error(&failure_.manager);
    failure_.manager.error_exit = [](j_common_ptr jpeg) {
      std::longjmp(reinterpret_cast<Failure*>(jpeg->err)->leave, 1);  // NOLINT(cert-err52-cpp)
    };
  }
  ~JpegEncoder() {
    jpeg_destroy_compress(&compressor_);
    std::free(buffer_);
  }
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  /// False if libjpeg refuses the image.
  [[nodiscard]] bool encode(const cv::Mat& grey) {
    constexpr int kQuality = 60;
    if (setjmp(failure_.leave) != 0) return false;  // NOLINT(cert-err52-cpp)
    jpeg_create_compress(&compressor_);
    jpeg_mem_dest(&compressor_, &buffer_, &size_);
    compressor_.image_width = static_cast<JDIMENSION>(grey.cols);
    compressor_.image_height = static_cast<JDIMENSION>(grey.rows);
    compressor_.input_components = 1;
    compressor_.in_color_space = JCS_GRAYSCALE;
    jpeg_set_defaults(&compressor_);
    jpeg_set_quality(&compressor_, kQuality, TRUE);
    jpeg_start_compress(&compressor_, TRUE);
    while (compressor_.next_scanline < compressor_.image_height) {
      auto* row = const_cast<JSAMPLE*>(grey.ptr(static_cast<int>(compressor_.next_scanline)));
      jpeg_write_scanlines(&compressor_, &row, 1);
    }
    jpeg_finish_compress(&compressor_);
    return true;
  }

  [[nodiscard]] std::vector<std::uint8_t> bytes() const { return {buffer_, buffer_ + size_}; }

 private:
  struct Failure {
    jpeg_error_mgr manager;  // first: libjpeg knows this part only
    std::jmp_buf leave;
  };

  jpeg_compress_struct compressor_{};
  Failure failure_{};
  unsigned char* buffer_ = nullptr;
  unsigned long size_ = 0;
};

}  // namespace

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
  JpegEncoder encoder;
  const bool encoded = encoder.encode(image);
  return encoded ? encoder.bytes() : std::vector<std::uint8_t>{};
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
