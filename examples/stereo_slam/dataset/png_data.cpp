// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/png_data.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <libdeflate.h>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         bytes[3];
}

/// The content of the chunk IHDR.
PngHeader parse_header(std::span<const std::uint8_t> data) {
  constexpr std::uint8_t kColourFlag = 2;
  PngHeader header;
  header.image.width_px = static_cast<int>(big_endian(data));
  header.image.height_px = static_cast<int>(big_endian(data.subspan(4)));
  const std::uint8_t bits = data[8];
  const std::uint8_t colour_type = data[9];
  const bool interlaced = data[12] != 0;
  header.image.colour = (colour_type & kColourFlag) != 0;
  header.plain_grey = bits == 8 && colour_type == 0 && !interlaced;
  return header;
}

/// Length, type, and the checksum of type and data.
constexpr std::size_t kChunkOverhead = 12;
constexpr std::array<std::uint8_t, 8> kSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

struct Chunk {
  std::string_view type;
  std::span<const std::uint8_t> data;
  std::span<const std::uint8_t> type_and_data;
  std::uint32_t checksum = 0;

  [[nodiscard]] bool intact() const {
    return libdeflate_crc32(0, type_and_data.data(), type_and_data.size()) == checksum;
  }
};

/// Takes the first chunk off `rest`. Nothing if it is not there in full.
std::optional<Chunk> take_chunk(std::span<const std::uint8_t>& rest) {
  if (rest.size() < kChunkOverhead) return std::nullopt;
  const std::size_t length = big_endian(rest);
  if (length > rest.size() - kChunkOverhead) return std::nullopt;
  const Chunk chunk{.type = {reinterpret_cast<const char*>(rest.data()) + 4, 4},
                    .data = rest.subspan(8, length),
                    .type_and_data = rest.subspan(4, length + 4),
                    .checksum = big_endian(rest.subspan(8 + length))};
  rest = rest.subspan(kChunkOverhead + length);
  return chunk;
}

/// The predictor of filter type 4 (PNG specification, section 9.4): the neighbour whose value is nearest to
/// left + above - above_left.
inline int paeth(int left, int above, int above_left) {
  const int from_left = std::abs(above - above_left);
  const int from_above = std::abs(left - above_left);
  const int from_above_left = std::abs(left + above - 2 * above_left);
  const int other = from_above <= from_above_left ? above : above_left;
  return from_left <= from_above && from_left <= from_above_left ? left : other;
}

/// Adds the prediction `predict(left, above, above_left)` to each byte of a row.
template <class Predict>
void add_prediction(std::span<const std::uint8_t> filtered, const std::uint8_t* above, std::uint8_t* row,
                    const Predict& predict) {
  std::uint8_t left = 0;
  std::uint8_t above_left = 0;
  for (std::size_t i = 0; i < filtered.size(); ++i) {
    left = static_cast<std::uint8_t>(filtered[i] + predict(left, above[i], above_left));
    above_left = above[i];
    row[i] = left;
  }
}

/// Undoes the filter of a row of one byte a pixel. False for an unknown filter type.
bool undo_filter(std::uint8_t type, std::span<const std::uint8_t> filtered, const std::uint8_t* above,
                 std::uint8_t* row) {
  switch (type) {
    case 0:
      std::copy(filtered.begin(), filtered.end(), row);
      return true;
    case 1:
      add_prediction(filtered, above, row, [](int left, int, int) { return left; });
      return true;
    case 2:
      add_prediction(filtered, above, row, [](int, int up, int) { return up; });
      return true;
    case 3:
      add_prediction(filtered, above, row, [](int left, int up, int) { return (left + up) / 2; });
      return true;
    case 4:
      add_prediction(filtered, above, row,
                     [](int left, int up, int up_left) { return paeth(left, up, up_left); });
      return true;
    default:
      return false;
  }
}

/// The compressed data of all IDAT chunks.
std::vector<std::uint8_t> compressed_pixels(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> data;
  data.reserve(bytes.size());
  auto rest = bytes.subspan(std::min(bytes.size(), kSignature.size()));
  while (const auto chunk = take_chunk(rest)) {
    if (chunk->type == "IEND") break;
    if (chunk->type == "IDAT") data.insert(data.end(), chunk->data.begin(), chunk->data.end());
  }
  return data;
}

/// Decompresses zlib data of a known size. False if the data are damaged or have another size.
bool inflate(std::span<const std::uint8_t> data, std::span<std::uint8_t> result) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  // With nullptr for the actual size, libdeflate fails if the data have another size.
  return decompressor &&
         libdeflate_zlib_decompress(decompressor.get(), data.data(), data.size(), result.data(),
                                    result.size(), nullptr) == LIBDEFLATE_SUCCESS;
}

}  // namespace

PngHeader check_png_data(const std::filesystem::path& file, std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kHeaderSize = 13;
  constexpr std::string_view kTruncated = "the PNG is truncated; copy or download it again";
  if (bytes.size() < kSignature.size()) fail(file, kTruncated);
  if (!std::equal(kSignature.begin(), kSignature.end(), bytes.begin()))
    fail(file, "not a PNG image; convert it");

  PngHeader header;
  auto rest = bytes.subspan(kSignature.size());
  while (true) {
    const auto chunk = take_chunk(rest);
    if (!chunk) fail(file, kTruncated);
    if (!chunk->intact()) fail(file, "the PNG is damaged (checksum); copy or download it again");
    if (chunk->type == "IHDR" && chunk->data.size() == kHeaderSize) header = parse_header(chunk->data);
    if (chunk->type == "tRNS") header.plain_grey = false;
    if (chunk->type == "IEND") return header;
  }
}

cv::Mat decode_plain_grey_png(std::span<const std::uint8_t> bytes) {
  const auto size = image_size(bytes);
  if (!size || !is_supported(*size)) return {};
  const std::size_t stride = size->width_px + 1;  // each row begins with the type of its filter
  std::vector<std::uint8_t> filtered(stride * size->height_px);
  if (!inflate(compressed_pixels(bytes), filtered)) return {};
  const std::vector<std::uint8_t> zeros(size->width_px);
  const std::uint8_t* above = zeros.data();
  cv::Mat image(static_cast<int>(size->height_px), static_cast<int>(size->width_px), CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    const auto row = std::span(filtered).subspan(static_cast<std::size_t>(y) * stride, stride);
    if (!undo_filter(row[0], row.subspan(1), above, image.ptr(y))) return {};
    above = image.ptr(y);
  }
  return image;
}

}  // namespace stereo_slam
