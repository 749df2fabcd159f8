// SPDX-License-Identifier: MIT
#include "stereo_slam/images/image_file.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include <opencv2/imgcodecs.hpp>

#include "stereo_slam/codecs/codecs.hpp"
#include "stereo_slam/images/jpeg_data.hpp"
#include "stereo_slam/images/png_data.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/input_file.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

std::string read_content(const std::filesystem::path& file) {
  constexpr std::size_t kMostImageBytes = std::size_t{256} << 20;
  std::error_code error;  // read_file() reports other errors
  if (!std::filesystem::exists(file, error) && !error) {
    fail(file, std::filesystem::is_symlink(file, error)
                   ? "is a link to a file that does not exist; restore the file or remove the link"
                   : "missing; restore the image");
  }
  std::string content = read_file(file, kMostImageBytes);
  if (content.empty()) fail(file, "the file is empty; copy or download it again");
  if (content.starts_with("version https://git-lfs.github.com/"))
    fail(file, "is a Git LFS pointer, not an image; run `git lfs pull`");
  return content;
}

std::span<const std::uint8_t> bytes_of(std::string_view content) {
  return {reinterpret_cast<const std::uint8_t*>(content.data()), content.size()};
}

/// Throws for an image without pixels, and for one that is larger than kMostPixels.
void require_size(const std::filesystem::path& file, const ImageSize& size) {
  if (is_supported(size)) return;
  if (size.width_px == 0 || size.height_px == 0) {
    fail(file, "is {} x {} pixels, an empty image; copy or record it again", size.width_px, size.height_px);
  }
  fail(file, "is {} x {} pixels; images may have up to {} pixels", size.width_px, size.height_px,
       kMostPixels);
}

PngHeader check_png_content(const std::filesystem::path& file, std::span<const std::uint8_t> bytes) {
  if (const auto size = image_size(bytes)) require_size(file, *size);
  return check_png_data(file, bytes);
}

std::string lower_extension(const std::filesystem::path& file) {
  return lower_case(file.extension().string());
}

/// A JPEG ends with the marker FF D9, perhaps padded; the decoder would fill up a shorter one with grey.
void check_jpeg(const std::filesystem::path& file, std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kPadding = 1024;
  if (bytes.size() < 4 || bytes[0] != 0xFF || bytes[1] != 0xD8) fail(file, "not a JPEG image; convert it");
  const auto tail = bytes.last(std::min(bytes.size() - 2, kPadding));
  constexpr std::array<std::uint8_t, 2> kEnd = {0xFF, 0xD9};
  if (std::search(tail.begin(), tail.end(), kEnd.begin(), kEnd.end()) == tail.end())
    fail(file, "the JPEG is truncated; copy or download it again");
  if (is_damaged_jpeg(bytes)) fail(file, "the JPEG is damaged; copy or download it again");
}

/// The orientation in the file is ignored: the calibration is of the sensor's pixels.
constexpr int kGrey = cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION;

/// Whether the content is of a format, or of an unknown one and the name says so.
bool is_format(const std::filesystem::path& file, std::string_view content, std::string_view beginning,
               std::initializer_list<std::string_view> extensions) {
  if (content.starts_with(beginning)) return true;
  const bool named = std::ranges::find(extensions, lower_extension(file)) != extensions.end();
  return named && !image_size(bytes_of(content));
}

bool is_png(const std::filesystem::path& file, std::string_view content) {
  return is_format(file, content, "\x89PNG\r\n\x1A\n", {".png"});
}

bool is_jpeg(const std::filesystem::path& file, std::string_view content) {
  return is_format(file, content, "\xFF\xD8", {".jpg", ".jpeg"});
}

/// Images of other types, as with 32 bits, are decoded as they are only.
[[noreturn]] void fail_to_decode(const std::filesystem::path& file, std::span<const std::uint8_t> bytes) {
  const cv::Mat image = opencv_codecs().decode(bytes, cv::IMREAD_UNCHANGED);
  if (image.empty()) fail(file, "the image cannot be decoded; convert or download it again");
  fail(file, "has pixels of {} bits; convert it to grey or colour with 8 or 16 bits", 8 * image.elemSize1());
}

/// `flags` are cv::ImreadModes; for a plain grey PNG all give the same image. The content decides on the
/// format, whatever the name says.
cv::Mat decode(const std::filesystem::path& file, int flags) {
  const std::string content = read_content(file);
  const auto bytes = bytes_of(content);
  const bool plain_grey_png = is_png(file, content) && check_png_content(file, bytes).plain_grey;
  const auto size = image_size(bytes);
  if (size) require_size(file, *size);
  if (is_jpeg(file, content)) check_jpeg(file, bytes);
  if (!size) fail(file, "the image cannot be decoded; convert or download it again");
  if (is_compressed_bmp(bytes))
    fail(file, "the BMP is compressed, which is not decoded reliably; store it uncompressed or as PNG");
  if (is_shifted_bmp(bytes))
    fail(file,
         "the pixels of the BMP begin within its header or palette; it is damaged, convert or copy it again");
  if (is_turned_tiff(bytes))
    fail(file,
         "the TIFF has an orientation other than 1, by which it would be turned, while a calibration is of "
         "the sensor's pixels; write it with orientation 1, or as PNG");
  if (is_shifted_pnm(bytes))
    fail(
        file,
        "the header ends with CR LF, which shifts the pixels; write it in binary mode, or convert it to PNG");
  cv::Mat image = plain_grey_png ? decode_plain_grey_png(bytes) : cv::Mat();
  if (image.empty()) image = opencv_codecs().decode(bytes, flags);
  if (image.empty()) fail_to_decode(file, bytes);
  return image;
}

}  // namespace

bool has_image_name(const std::filesystem::path& file) {
  constexpr std::array<std::string_view, 10> kNames = {".png", ".jpg", ".jpeg", ".pgm",  ".ppm",
                                                       ".pnm", ".bmp", ".tif",  ".tiff", ".webp"};
  return std::ranges::find(kNames, lower_extension(file)) != kNames.end();
}

ImageHeader check_image(const std::filesystem::path& file) {
  const std::string content = read_content(file);
  if (is_png(file, content)) return check_png_content(file, bytes_of(content)).image;
  const cv::Mat image = decode(file, cv::IMREAD_UNCHANGED);
  return {image.cols, image.rows, image.channels() > 1};
}

cv::Mat load_16_bit_image(const std::filesystem::path& file) {
  const cv::Mat image = decode(file, kGrey | cv::IMREAD_ANYDEPTH);
  return image.depth() == CV_16U ? image : cv::Mat();
}

cv::Mat load_gray_image(const std::filesystem::path& file, const GreyScale& scale) {
  if (scale == GreyScale{}) return decode(file, kGrey);
  const cv::Mat image = decode(file, kGrey | cv::IMREAD_ANYDEPTH);
  return image.depth() == CV_16U ? to_grey(image, scale) : decode(file, kGrey);
}

}  // namespace stereo_slam
