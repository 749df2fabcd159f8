// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace stereo_slam {

/// Width and height as the header of an image says.
struct ImageSize {
  std::uint64_t width_px = 0;
  std::uint64_t height_px = 0;
};

/// The header of an image.
struct ImageHeader {
  int width_px = 0;
  int height_px = 0;
  bool colour = false;
};

/// The largest image that is read, in pixels: 11585 x 11585.
constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 27;

/// Whether an image of this size is read: not empty, and at most kMostPixels.
[[nodiscard]] bool is_supported(const ImageSize& size);

/// The size of a PNG, JPEG, WebP, PNM, BMP or TIFF image, recognised by its first bytes, without decoding it.
/// Nothing for another format, and for a file that ends within its header.
[[nodiscard]] std::optional<ImageSize> image_size(std::span<const std::uint8_t> bytes);

/// Whether the header of a binary PGM or PPM ends with CR LF, as text does on Windows. Decoders take the LF
/// for the first pixel, and shift the image by one.
[[nodiscard]] bool is_shifted_pnm(std::span<const std::uint8_t> bytes);

/// Whether the pixels of a BMP are compressed. OpenCV decodes run-length encoding wrongly, without an error.
[[nodiscard]] bool is_compressed_bmp(std::span<const std::uint8_t> bytes);

/// Whether the pixels of a BMP begin within its header or palette. OpenCV decodes these as pixels, too, and
/// so shifts the image.
[[nodiscard]] bool is_shifted_bmp(std::span<const std::uint8_t> bytes);

/// Whether a TIFF has an orientation other than 1. OpenCV turns or mirrors such an image, even if told not
/// to.
[[nodiscard]] bool is_turned_tiff(std::span<const std::uint8_t> bytes);

}  // namespace stereo_slam
