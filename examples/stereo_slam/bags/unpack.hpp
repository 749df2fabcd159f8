// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace stereo_slam {

enum class Compression { kNone, kLz4, kZstd };

/// By the name that bags have for it, which is empty for none. Throws std::runtime_error for one that is not
/// read.
[[nodiscard]] Compression compression_of(std::string_view name);

/// The largest chunk or message that is read, unpacked.
constexpr std::uint64_t kMostUnpacked_bytes = std::uint64_t{1} << 30;

/// Unpacks lz4 or zstd, each one or more frames, into `unpacked`: all of it, or its first `most_bytes`. Where
/// `packed` is cut off, as much as it contains. Throws std::runtime_error if it is damaged.
void unpack(Compression compression, std::span<const std::uint8_t> packed, std::size_t most_bytes,
            std::vector<std::uint8_t>& unpacked);

}  // namespace stereo_slam
