// SPDX-License-Identifier: MIT
#include "stereo_slam/images/image_size.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <string_view>

namespace stereo_slam {
namespace {

/// Reads numbers at offsets; reading beyond the end makes the header invalid.
class Header {
 public:
  Header(std::span<const std::uint8_t> bytes, bool little_endian)
      : bytes_(bytes), little_endian_(little_endian) {}

  [[nodiscard]] bool valid() const { return valid_; }

  std::uint32_t number(std::size_t offset, std::size_t width) {
    if (offset > bytes_.size() || width > bytes_.size() - offset) {
      valid_ = false;
      return 0;
    }
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < width; ++i)
      value = value << 8 | bytes_[offset + (little_endian_ ? width - 1 - i : i)];
    return value;
  }

  [[nodiscard]] std::optional<ImageSize> result(std::uint64_t width_px, std::uint64_t height_px) const {
    if (!valid_) return std::nullopt;
    return ImageSize{width_px, height_px};
  }

 private:
  std::span<const std::uint8_t> bytes_;
  bool little_endian_;
  bool valid_ = true;
};

[[nodiscard]] std::optional<ImageSize> png_size(std::span<const std::uint8_t> bytes) {
  Header header(bytes, false);
  return header.result(header.number(16, 4), header.number(20, 4));
}

/// The first frame header among the segments: marker (2), length (2), precision (1), height (2), width (2).
[[nodiscard]] std::optional<ImageSize> jpeg_size(std::span<const std::uint8_t> bytes) {
  Header header(bytes, false);
  for (std::size_t at = 2; header.valid();) {
    const auto marker = header.number(at, 2);
    if (marker == 0xFFFF) {  // padding
      ++at;
      continue;
    }
    const bool is_frame =
        marker >= 0xFFC0 && marker <= 0xFFCF && marker != 0xFFC4 && marker != 0xFFC8 && marker != 0xFFCC;
    if (is_frame) {
      const auto height_px = header.number(at + 5, 2);
      return header.result(header.number(at + 7, 2), height_px);
    }
    const auto length = header.number(at + 2, 2);
    if (marker < 0xFF00 || length < 2) return std::nullopt;
    at += 2 + length;
  }
  return std::nullopt;
}

/// The header of a PNM image: "P5 width height most", with comments from # to the end of a line.
class PnmHeader {
 public:
  explicit PnmHeader(std::span<const std::uint8_t> bytes)
      : text_(reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), std::size_t{4096})) {
    text_.remove_prefix(2);
  }

  [[nodiscard]] std::uint64_t next_number() {
    while (!text_.empty() && (std::string_view(" \t\r\n").find(text_[0]) != text_.npos || text_[0] == '#'))
      text_.remove_prefix(text_[0] == '#' ? std::min(text_.find('\n'), text_.size()) : 1);
    std::uint64_t value = 0;
    for (; !text_.empty() && text_[0] >= '0' && text_[0] <= '9' && value < kMostPixels;
         text_.remove_prefix(1))
      value = 10 * value + static_cast<std::uint64_t>(text_[0] - '0');
    return value;
  }

  /// What follows the last number: after the header's last one, a white space and the pixels.
  [[nodiscard]] std::string_view rest() const { return text_; }

 private:
  std::string_view text_;
};

[[nodiscard]] std::optional<ImageSize> pnm_size(std::span<const std::uint8_t> bytes) {
  PnmHeader header(bytes);
  const auto width_px = header.next_number();
  const auto height_px = header.next_number();
  if (header.rest().empty()) return std::nullopt;
  return ImageSize{width_px, height_px};
}

[[nodiscard]] std::optional<ImageSize> bmp_size(std::span<const std::uint8_t> bytes) {
  Header header(bytes, true);
  const bool old = header.number(14, 4) == 12;  // OS/2
  if (old) return header.result(header.number(18, 2), header.number(20, 2));
  const auto magnitude = [](std::uint32_t value) {  // the height is negative if the first row is the top one
    return value > 0x7FFFFFFF ? std::uint64_t{0x100000000} - value : std::uint64_t{value};
  };
  const auto width_px = magnitude(header.number(18, 4));
  return header.result(width_px, magnitude(header.number(22, 4)));
}

/// The first chunk: VP8 (a key frame), VP8L (lossless) or VP8X (extended).
[[nodiscard]] std::optional<ImageSize> webp_size(std::span<const std::uint8_t> bytes) {
  using namespace std::string_view_literals;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  Header header(bytes, true);
  const auto kind = text.size() < 16 ? ""sv : text.substr(12, 4);
  constexpr std::uint32_t kSide = 0x3FFF;  // 14 bits
  if (kind == "VP8 "sv) {
    const auto width_px = header.number(26, 2) & kSide;
    return header.result(width_px, header.number(28, 2) & kSide);
  }
  if (kind == "VP8L"sv) {
    const auto sides = header.number(21, 4);
    return header.result((sides & kSide) + 1, (sides >> 14 & kSide) + 1);
  }
  if (kind != "VP8X"sv) return std::nullopt;
  const auto width_px = header.number(24, 3) + 1;
  return header.result(width_px, header.number(27, 3) + 1);
}

/// What the first directory of a TIFF says.
struct TiffHeader {
  ImageSize size;
  std::uint64_t orientation = 1;
};

/// The tags 256, 257 and 274 of the first directory: tag (2), type (2), count (4), value (4).
[[nodiscard]] std::optional<TiffHeader> tiff_header(std::span<const std::uint8_t> bytes) {
  using namespace std::string_view_literals;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const bool little_endian = text.starts_with("II*\0"sv);
  if (!little_endian && !text.starts_with("MM\0*"sv)) return std::nullopt;
  Header header(bytes, little_endian);
  const std::size_t directory = header.number(4, 4);
  const auto entries = header.number(directory, 2);
  TiffHeader result;
  for (std::size_t i = 0; i < entries && header.valid(); ++i) {
    constexpr std::uint32_t kShort = 3;
    const std::size_t at = directory + 2 + 12 * i;
    const auto tag = header.number(at, 2);
    const std::uint64_t value = header.number(at + 8, header.number(at + 2, 2) == kShort ? 2 : 4);
    if (tag == 256) result.size.width_px = value;
    if (tag == 257) result.size.height_px = value;
    if (tag == 274) result.orientation = value;
  }
  return header.valid() ? std::optional(result) : std::nullopt;
}

}  // namespace

bool is_supported(const ImageSize& size) {
  return size.width_px > 0 && size.height_px > 0 && size.width_px <= kMostPixels &&
         size.height_px <= kMostPixels / size.width_px;
}

bool is_shifted_pnm(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 2 || bytes[0] != 'P' || (bytes[1] != '5' && bytes[1] != '6')) return false;
  PnmHeader header(bytes);
  for (int i = 0; i < 3; ++i) (void)header.next_number();
  return header.rest().starts_with("\r\n");
}

bool is_compressed_bmp(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 2 || bytes[0] != 'B' || bytes[1] != 'M') return false;
  constexpr std::uint32_t kRaw = 0;
  constexpr std::uint32_t kBitFields = 3;
  Header header(bytes, true);
  if (header.number(14, 4) == 12) return false;  // OS/2 has no compression
  const auto compression = header.number(30, 4);
  return header.valid() && compression != kRaw && compression != kBitFields;
}

bool is_shifted_bmp(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 2 || bytes[0] != 'B' || bytes[1] != 'M') return false;
  constexpr std::uint32_t kOs2 = 12;
  constexpr std::uint32_t kInfo = 40;
  constexpr std::uint64_t kFileHeader_bytes = 14;
  Header header(bytes, true);
  const std::uint32_t length = header.number(kFileHeader_bytes, 4);
  const bool old = length == kOs2;
  const std::uint32_t bits = header.number(old ? 24 : 28, 2);
  const std::uint32_t stated = old ? 0 : header.number(46, 4);
  const bool masks = length == kInfo && header.number(30, 4) == 3;
  std::uint64_t colours = 0;
  if (bits <= 8) colours = stated > 0 ? stated : 1U << bits;
  const std::uint64_t pixels = kFileHeader_bytes + length + (old ? 3 : 4) * colours + (masks ? 12 : 0);
  return header.valid() && header.number(10, 4) < pixels;
}

bool is_turned_tiff(std::span<const std::uint8_t> bytes) {
  const auto tiff = tiff_header(bytes);
  return tiff && tiff->orientation != 1;
}

std::optional<ImageSize> image_size(std::span<const std::uint8_t> bytes) {
  using namespace std::string_view_literals;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\x89PNG\r\n\x1A\n"sv)) return png_size(bytes);
  if (text.starts_with("\xFF\xD8"sv)) return jpeg_size(bytes);
  if (text.starts_with("RIFF"sv) && text.substr(std::min<std::size_t>(8, text.size())).starts_with("WEBP"sv))
    return webp_size(bytes);
  if (text.starts_with("BM"sv)) return bmp_size(bytes);
  if (const auto tiff = tiff_header(bytes)) return tiff->size;
  if (text.size() > 2 && text[0] == 'P' && text[1] >= '1' && text[1] <= '6') return pnm_size(bytes);
  return std::nullopt;
}

}  // namespace stereo_slam
