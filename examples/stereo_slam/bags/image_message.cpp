// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/image_message.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/codecs/codecs.hpp"
#include "stereo_slam/images/grey_image.hpp"
#include "stereo_slam/images/image_size.hpp"
#include "stereo_slam/images/jpeg_data.hpp"
#include "stereo_slam/io/counted.hpp"

namespace stereo_slam {
namespace {

constexpr int kAsItIs = -1;

struct Encoding {
  std::string_view name;
  int type;
  int conversion;  ///< to grey, by cv::cvtColor
};

/// The rows of nv12 and nv21 are grey, and colours follow behind them. uyvy and yuyv are the names that ROS 2
/// gave to yuv422 and yuv422_yuy2. ROS names a Bayer pattern by the pixels from the first row and column on,
/// OpenCV by those from the second.
constexpr std::array<Encoding, 30> kEncodings = {{{"mono8", CV_8UC1, kAsItIs},
                                                  {"8UC1", CV_8UC1, kAsItIs},
                                                  {"mono16", CV_16UC1, kAsItIs},
                                                  {"16UC1", CV_16UC1, kAsItIs},
                                                  {"bgr8", CV_8UC3, cv::COLOR_BGR2GRAY},
                                                  {"8UC3", CV_8UC3, cv::COLOR_BGR2GRAY},
                                                  {"8UC4", CV_8UC4, cv::COLOR_BGRA2GRAY},
                                                  {"rgb8", CV_8UC3, cv::COLOR_RGB2GRAY},
                                                  {"bgra8", CV_8UC4, cv::COLOR_BGRA2GRAY},
                                                  {"rgba8", CV_8UC4, cv::COLOR_RGBA2GRAY},
                                                  {"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2GRAY},
                                                  {"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2GRAY},
                                                  {"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2GRAY},
                                                  {"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2GRAY},
                                                  {"rgb16", CV_16UC3, cv::COLOR_RGB2GRAY},
                                                  {"bgr16", CV_16UC3, cv::COLOR_BGR2GRAY},
                                                  {"rgba16", CV_16UC4, cv::COLOR_RGBA2GRAY},
                                                  {"bgra16", CV_16UC4, cv::COLOR_BGRA2GRAY},
                                                  {"16UC3", CV_16UC3, cv::COLOR_BGR2GRAY},
                                                  {"16UC4", CV_16UC4, cv::COLOR_BGRA2GRAY},
                                                  {"bayer_rggb16", CV_16UC1, cv::COLOR_BayerBG2GRAY},
                                                  {"bayer_bggr16", CV_16UC1, cv::COLOR_BayerRG2GRAY},
                                                  {"bayer_gbrg16", CV_16UC1, cv::COLOR_BayerGR2GRAY},
                                                  {"bayer_grbg16", CV_16UC1, cv::COLOR_BayerGB2GRAY},
                                                  {"nv12", CV_8UC1, kAsItIs},
                                                  {"nv21", CV_8UC1, kAsItIs},
                                                  {"uyvy", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY},
                                                  {"yuv422", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY},
                                                  {"yuyv", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2},
                                                  {"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2}}};

const Encoding& encoding_of(const ImageMessage& message) {
  const auto* found = std::ranges::find_if(
      kEncodings, [&](const Encoding& encoding) { return encoding.name == message.encoding; });
  if (found == kEncodings.end()) {
    throw std::invalid_argument(
        fmt::format("the encoding '{}' is not known; record mono, bgr, rgb or bayer images of 8 or 16 bits, "
                    "yuv422 or compressed images",
                    message.encoding));
  }
  return *found;
}

void require_pixels(const ImageSize& size) {
  if (is_supported(size)) return;
  if (size.width_px == 0 || size.height_px == 0) {
    throw std::invalid_argument(
        fmt::format("has {} x {} pixels, it is empty; record it again", size.width_px, size.height_px));
  }
  throw std::invalid_argument(fmt::format("has {} x {} pixels; images may have up to {} pixels",
                                          size.width_px, size.height_px, kMostPixels));
}

void check_size(const ImageMessage& message, std::size_t pixel_bytes) {
  require_pixels({message.width, message.height});
  const std::uint64_t needed =
      std::uint64_t{message.step} * (message.height - 1) + message.width * pixel_bytes;
  if (message.step < message.width * pixel_bytes) {
    throw std::invalid_argument(fmt::format(
        "a row (step) has {}, but its {} pixels of {} take {}; correct the driver and record it "
        "again",
        counted(message.step, "byte"), message.width, message.encoding, message.width * pixel_bytes));
  }
  if (message.data.size() < needed) throw std::invalid_argument("the image is truncated; record it again");
}

/// The upper and the lower bytes of a checked image with 16 bits a value, one channel beside the other.
std::array<cv::Mat, 2> bytes_of_16(const ImageMessage& message, int channels) {
  auto* data = const_cast<std::uint8_t*>(message.data.data());  // only read
  const cv::Mat values(static_cast<int>(message.height), static_cast<int>(message.width) * channels, CV_8UC2,
                       data, message.step);
  std::array<cv::Mat, 2> bytes;
  cv::split(values, bytes.data());
  if (!message.big_endian) std::swap(bytes[0], bytes[1]);
  return bytes;
}

/// A checked image with 16 bits a value as grey CV_16UC1.
cv::Mat checked_values_of_16(const ImageMessage& message, const Encoding& encoding) {
  const int channels = CV_MAT_CN(encoding.type);
  const auto [upper, lower] = bytes_of_16(message, channels);
  cv::Mat values;
  upper.convertTo(values, CV_16U, 256.0);
  cv::add(values, lower, values, cv::noArray(), CV_16U);
  if (encoding.conversion == kAsItIs) return values;
  cv::Mat grey;
  cv::cvtColor(values.reshape(channels), grey, encoding.conversion);
  return grey;
}

/// A checked image with 16 bits a value as CV_8UC1.
cv::Mat checked_grey_of_16(const ImageMessage& message, const Encoding& encoding, const GreyScale& scale) {
  if (scale == GreyScale{} && encoding.conversion == kAsItIs) return bytes_of_16(message, 1)[0];
  return to_grey(checked_values_of_16(message, encoding), scale);
}

bool is_jpeg(std::span<const std::uint8_t> data) {
  return data.size() > 2 && data[0] == 0xFF && data[1] == 0xD8;
}

/// The orientation in the image is ignored: the calibration is of the sensor's pixels.
constexpr int kGrey = cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION;

/// `flags` are cv::ImreadModes.
cv::Mat decode(std::span<const std::uint8_t> data, int flags) {
  const auto size = image_size(data);
  if (!size) throw std::invalid_argument("the compressed image cannot be decoded");
  require_pixels(*size);
  if (is_compressed_bmp(data))
    throw std::invalid_argument("the BMP is compressed, which is not decoded reliably; record PNG or JPEG");
  if (is_shifted_bmp(data))
    throw std::invalid_argument(
        "the pixels of the BMP begin within its header or palette; record PNG or JPEG");
  if (is_turned_tiff(data))
    throw std::invalid_argument(
        "the TIFF has an orientation other than 1, by which it would be turned; record PNG or JPEG");
  if (is_jpeg(data) && is_damaged_jpeg(data))
    throw std::invalid_argument("the JPEG is damaged; copy or download the bag again");
  cv::Mat image = opencv_codecs().decode(data, flags);
  if (image.empty()) throw std::invalid_argument("the compressed image cannot be decoded");
  return image;
}

}  // namespace

cv::Mat values_of_16(const ImageMessage& message) {
  const Encoding& encoding = encoding_of(message);
  if (CV_MAT_DEPTH(encoding.type) != CV_16U) return {};
  check_size(message, CV_ELEM_SIZE(encoding.type));
  return checked_values_of_16(message, encoding);
}

cv::Mat to_grey(const ImageMessage& message, const GreyScale& scale) {
  const Encoding& encoding = encoding_of(message);
  check_size(message, CV_ELEM_SIZE(encoding.type));
  if (CV_MAT_DEPTH(encoding.type) == CV_16U) return checked_grey_of_16(message, encoding, scale);
  // cv::Mat needs a pointer to non-const data; the image is only read.
  auto* data = const_cast<std::uint8_t*>(message.data.data());
  const cv::Mat image(static_cast<int>(message.height), static_cast<int>(message.width), encoding.type, data,
                      message.step);
  if (encoding.conversion == kAsItIs) return image.clone();
  cv::Mat grey;
  cv::cvtColor(image, grey, encoding.conversion);
  return grey;
}

cv::Mat decode_16_bit(std::span<const std::uint8_t> compressed) {
  if (is_jpeg(compressed)) return {};  // eight bits, without decoding it
  const cv::Mat image = decode(compressed, kGrey | cv::IMREAD_ANYDEPTH);
  return image.depth() == CV_16U ? image : cv::Mat();
}

cv::Mat decode_grey(std::span<const std::uint8_t> compressed, const GreyScale& scale) {
  if (scale == GreyScale{}) return decode(compressed, kGrey);
  const cv::Mat image = decode(compressed, kGrey | cv::IMREAD_ANYDEPTH);
  return image.depth() == CV_16U ? to_grey(image, scale) : image;
}

}  // namespace stereo_slam
