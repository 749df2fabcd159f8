// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

namespace stereo_slam {

/// Whether the compressed data of a JPEG is damaged: a code that is none, coefficients beyond a block, or an
/// end too early or too late. A JPEG has no checksum, and decoders go on with wrong pixels. Damage that
/// leaves valid codes for all blocks is not noticed, nor any in progressive and arithmetically coded files,
/// which cameras hardly write.
[[nodiscard]] bool is_damaged_jpeg(std::span<const std::uint8_t> bytes);

}  // namespace stereo_slam
