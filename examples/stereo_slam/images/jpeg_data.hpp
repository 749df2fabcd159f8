// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

namespace stereo_slam {

/// Whether the compressed data of a JPEG is damaged: an invalid code, more coefficients than a block has, or
/// an end too early or too late. A JPEG has no checksum, and decoders continue with wrong pixels. Not
/// detected are damage that leaves valid codes for all blocks, and any damage of progressive or
/// arithmetically coded files, which cameras hardly ever write.
[[nodiscard]] bool is_damaged_jpeg(std::span<const std::uint8_t> bytes);

}  // namespace stereo_slam
