// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
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

/// Unpacks such data part by part: `read` fills its argument and returns the number of bytes, 0 at the end;
/// `write` takes what is unpacked. Throws like unpack(), and passes on what these throw.
void unpack_stream(Compression compression, const std::function<std::size_t(std::span<std::uint8_t>)>& read,
                   const std::function<void(std::span<const std::uint8_t>)>& write);

/// How a format is decoded.
class FrameDecoder;

/// Unpacks such data only as far as it is read.
class UnpackStream {
 public:
  /// Fills its argument with packed data, and returns the number of bytes; 0 at the end.
  using ReadPacked = std::function<std::size_t(std::span<std::uint8_t>)>;

  explicit UnpackStream(Compression compression);
  ~UnpackStream();

  /// Begins with other data.
  void begin(ReadPacked read_packed);

  /// Fills `room`. Returns the number of bytes there; fewer than its size if there are no more. Throws like
  /// unpack(), and passes on what `read_packed` throws.
  std::size_t read(std::span<std::uint8_t> room);

 private:
  std::unique_ptr<FrameDecoder> decoder_;
  ReadPacked read_packed_;
  std::vector<std::uint8_t> part_;
  std::span<const std::uint8_t> packed_;  ///< what of the part is not decoded yet
};

/// Whether data begins as zstd does.
[[nodiscard]] bool begins_as_zstd(std::span<const std::uint8_t> bytes);

}  // namespace stereo_slam
