// SPDX-License-Identifier: MIT
#include "stereo_slam/images/png_data.hpp"

#include <algorithm>
#include <array>
#include <functional>
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

/// The predictors of filter types 1, 3 and 4 (PNG specification, section 9).
constexpr auto kSub = [](int left, int, int) { return left; };
constexpr auto kAverage = [](int left, int above, int) { return (left + above) / 2; };

/// The one of the three neighbours whose value is nearest to left + above - above_left. That is above_left if
/// its value lies in the middle third between the other two, and else the one further from it. Written with
/// two comparisons instead of three distances, because every pixel waits for the one before.
constexpr auto kPaeth = [](int left, int above, int above_left) {
  const int low = std::min(left, above);
  const int high = std::max(left, above);
  const int threshold = 3 * above_left - left - above;
  const int not_high = high <= threshold ? low : above_left;
  return threshold <= low ? high : not_high;
};

/// Undoes the filter of a row of one byte a pixel, from left to right.
template <class Predict>
class RowDecoder {
 public:
  RowDecoder(const std::uint8_t* filtered, std::uint8_t* row, const Predict& predict)
      : filtered_(filtered), row_(row), predict_(predict) {}

  /// The next pixel, below one of value `above`.
  std::uint8_t decode(std::uint8_t above) {
    left_ = static_cast<std::uint8_t>(*filtered_++ + predict_(left_, above, above_left_));
    above_left_ = above;
    return *row_++ = left_;
  }

 private:
  const std::uint8_t* filtered_;
  std::uint8_t* row_;
  Predict predict_;
  std::uint8_t left_ = 0;
  std::uint8_t above_left_ = 0;
};

/// Decodes the rows of one or two filters of one kind. The second row follows one pixel behind the first: a
/// processor computes them at the same time.
template <class Predict>
void decode_rows(const std::uint8_t* filtered, cv::Mat rows, const std::uint8_t* above,
                 const Predict& predict) {
  const int width = rows.cols;
  RowDecoder first(filtered, rows.ptr(0), predict);
  if (rows.rows == 1) {
    for (int x = 0; x < width; ++x) first.decode(above[x]);
    return;
  }
  RowDecoder second(filtered + width + 1, rows.ptr(1), predict);
  std::uint8_t pixel = first.decode(above[0]);
  for (int x = 1; x < width; ++x) {
    const std::uint8_t above_second = pixel;
    pixel = first.decode(above[x]);
    second.decode(above_second);
  }
  second.decode(pixel);
}

/// Decodes rows of filter type 2, which add the pixel above: many pixels at a time.
void add_rows_above(const std::uint8_t* filtered, cv::Mat rows, const std::uint8_t* above) {
  for (int y = 0; y < rows.rows; ++y) {
    std::uint8_t* row = rows.ptr(y);
    std::transform(filtered, filtered + rows.cols, above, row, std::plus<>());
    filtered += rows.cols + 1;
    above = row;
  }
}

/// Decodes rows of filter type 0, which are not filtered.
void copy_rows(const std::uint8_t* filtered, cv::Mat rows) {
  for (int y = 0; y < rows.rows; ++y) {
    std::copy_n(filtered, rows.cols, rows.ptr(y));
    filtered += rows.cols + 1;
  }
}

/// Undoes the filter of one or two rows. False for an unknown filter type.
bool undo_filter(std::uint8_t type, const std::uint8_t* filtered, const cv::Mat& rows,
                 const std::uint8_t* above) {
  switch (type) {
    case 0:
      copy_rows(filtered, rows);
      return true;
    case 1:
      decode_rows(filtered, rows, above, kSub);
      return true;
    case 2:
      add_rows_above(filtered, rows, above);
      return true;
    case 3:
      decode_rows(filtered, rows, above, kAverage);
      return true;
    case 4:
      decode_rows(filtered, rows, above, kPaeth);
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
  if (!std::ranges::equal(kSignature, bytes.first(kSignature.size())))
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
  cv::Mat image(static_cast<int>(size->height_px), static_cast<int>(size->width_px), CV_8UC1);
  for (int y = 0; y < image.rows;) {
    const std::uint8_t* row = filtered.data() + static_cast<std::size_t>(y) * stride;
    const bool two = y + 1 < image.rows && row[0] == row[stride];
    const int end = two ? y + 2 : y + 1;
    const std::uint8_t* above = y == 0 ? zeros.data() : image.ptr(y - 1);
    if (!undo_filter(row[0], row + 1, image.rowRange(y, end), above)) return {};
    y = end;
  }
  return image;
}

}  // namespace stereo_slam
