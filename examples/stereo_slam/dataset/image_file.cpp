// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/image_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "stereo_slam/dataset/image_size.hpp"
#include "stereo_slam/dataset/jpeg_data.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/input_file.hpp"

namespace stereo_slam {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes read_bytes(const std::filesystem::path& file) {
  constexpr std::size_t kMostImageBytes = std::size_t{256} << 20;
  std::error_code error;  // read_file() says what else is wrong
  if (!std::filesystem::exists(file, error) && !error)
    fail(file, "missing; restore the image or cut the sequence before it");
  const std::string content = read_file(file, kMostImageBytes);
  return {content.begin(), content.end()};
}

/// Throws for an image without pixels, and for one that would take more memory than there may be.
void require_size(const std::filesystem::path& file, const ImageSize& size) {
  if (is_supported(size)) return;
  if (size.width_px == 0 || size.height_px == 0) {
    fail(file, fmt::format("is {} x {} pixels, an empty image; copy or record it again", size.width_px,
                           size.height_px));
  }
  fail(file, fmt::format("is {} x {} pixels; images may have up to {} pixels, scale them down", size.width_px,
                         size.height_px, kMostPixels));
}

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         bytes[3];
}

/// Tables of crc32: entry [k][byte] is the checksum of the byte followed by k zeros.
using CrcTables = std::array<std::array<std::uint32_t, 256>, 4>;

constexpr CrcTables make_crc_tables() {
  CrcTables tables{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0U ? 0xEDB88320U ^ (c >> 1) : c >> 1;
    tables[0][i] = c;
  }
  for (std::size_t k = 1; k < tables.size(); ++k) {
    for (std::size_t i = 0; i < 256; ++i) {
      const std::uint32_t c = tables[k - 1][i];
      tables[k][i] = (c >> 8) ^ tables[0][c & 0xFFU];
    }
  }
  return tables;
}

/// CRC-32 of ISO 3309 (PNG specification, annex D), four bytes at a time.
std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  static constexpr CrcTables kTables = make_crc_tables();
  std::uint32_t c = 0xFFFFFFFFU;
  for (; bytes.size() >= 4; bytes = bytes.subspan(4)) {
    c ^= std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8 | std::uint32_t{bytes[2]} << 16 |
         std::uint32_t{bytes[3]} << 24;
    c = kTables[3][c & 0xFFU] ^ kTables[2][c >> 8 & 0xFFU] ^ kTables[1][c >> 16 & 0xFFU] ^
        kTables[0][c >> 24];
  }
  for (const std::uint8_t byte : bytes) c = kTables[0][(c ^ byte) & 0xFFU] ^ (c >> 8);
  return ~c;
}

/// Walks the chunks: length (4), type (4), data, checksum of type and data (4).
ImageHeader check_chunks(const std::filesystem::path& file, std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 8> kSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  constexpr std::size_t kOverhead = 12;
  constexpr std::size_t kHeaderSize = 13;
  constexpr std::string_view kTruncated = "the PNG is truncated; copy or download it again";
  if (bytes.empty()) fail(file, "the file is empty; copy or download it again");
  if (bytes.size() < kSignature.size()) fail(file, kTruncated);
  if (!std::equal(kSignature.begin(), kSignature.end(), bytes.begin()))
    fail(file, "not a PNG image; convert it");

  if (const auto size = image_size(bytes)) require_size(file, *size);
  ImageHeader header;
  auto rest = bytes.subspan(kSignature.size());
  while (true) {
    if (rest.size() < kOverhead) fail(file, kTruncated);
    const std::size_t length = big_endian(rest);
    if (length > rest.size() - kOverhead) fail(file, kTruncated);
    const std::string_view type(reinterpret_cast<const char*>(rest.data()) + 4, 4);
    const auto data = rest.subspan(8, length);
    if (crc32(rest.subspan(4, length + 4)) != big_endian(rest.subspan(8 + length))) {
      fail(file, "the PNG is damaged (checksum); copy or download it again");
    }
    if (type == "IHDR" && length == kHeaderSize) {
      constexpr std::uint8_t kColourFlag = 2;
      header = {static_cast<int>(big_endian(data)), static_cast<int>(big_endian(data.subspan(4))),
                (data[9] & kColourFlag) != 0};
    }
    if (type == "IEND") return header;
    rest = rest.subspan(kOverhead + length);
  }
}

std::string lower_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
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

cv::Mat decode(const std::filesystem::path& file, int mode) {
  const Bytes bytes = read_bytes(file);
  const std::string extension = lower_extension(file);
  if (bytes.empty()) fail(file, "the file is empty; copy or download it again");
  if (extension == ".png") check_chunks(file, bytes);
  const auto size = image_size(bytes);
  if (size) require_size(file, *size);
  if (extension == ".jpg" || extension == ".jpeg") check_jpeg(file, bytes);
  if (!size) fail(file, "the image cannot be decoded; convert or download it again");
  if (is_compressed_bmp(bytes))
    fail(file, "the BMP is compressed, which is not decoded reliably; store it uncompressed or as PNG");
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, mode);
  } catch (const cv::Exception&) {  // the message below says it
  }
  if (image.empty()) fail(file, "the image cannot be decoded; convert or download it again");
  return image;
}

}  // namespace

ImageHeader check_png(const std::filesystem::path& file) { return check_chunks(file, read_bytes(file)); }

bool has_image_name(const std::filesystem::path& file) {
  constexpr std::array<std::string_view, 7> kNames = {".png", ".jpg", ".jpeg", ".pgm",
                                                      ".bmp", ".tif", ".tiff"};
  return std::find(kNames.begin(), kNames.end(), lower_extension(file)) != kNames.end();
}

ImageHeader check_image(const std::filesystem::path& file) {
  if (lower_extension(file) == ".png") return check_png(file);
  const cv::Mat image = decode(file, cv::IMREAD_UNCHANGED);
  return {image.cols, image.rows, image.channels() > 1};
}

cv::Mat load_gray_image(const std::filesystem::path& file) {
  return decode(file, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);  // the sensor is calibrated
}

}  // namespace stereo_slam
