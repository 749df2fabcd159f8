// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/unpack.hpp"

#include <algorithm>
#include <array>
#include <lz4frame.h>
#include <memory>
#include <stdexcept>
#include <utility>
#include <zstd.h>

#include <fmt/format.h>

namespace stereo_slam {

/// A decoder of one of the two formats.
class FrameDecoder {
 public:
  FrameDecoder() = default;
  FrameDecoder(const FrameDecoder&) = delete;
  FrameDecoder& operator=(const FrameDecoder&) = delete;
  virtual ~FrameDecoder() = default;

  /// Forgets what came before.
  virtual void reset() = 0;

  /// Takes bytes off `packed`, and fills `room` from its beginning. Returns the number of bytes there; 0 if
  /// none of `packed` was taken either.
  virtual std::size_t decode(std::span<const std::uint8_t>& packed, std::span<std::uint8_t> room) = 0;
};

namespace {

class Lz4Decoder : public FrameDecoder {
 public:
  Lz4Decoder() { check(LZ4F_createDecompressionContext(&context_, LZ4F_VERSION)); }
  ~Lz4Decoder() override { LZ4F_freeDecompressionContext(context_); }
  Lz4Decoder(const Lz4Decoder&) = delete;
  Lz4Decoder& operator=(const Lz4Decoder&) = delete;

  void reset() override { LZ4F_resetDecompressionContext(context_); }

  std::size_t decode(std::span<const std::uint8_t>& packed, std::span<std::uint8_t> room) override {
    std::size_t taken = packed.size();
    std::size_t filled = room.size();
    check(LZ4F_decompress(context_, room.data(), &filled, packed.data(), &taken, nullptr));
    packed = packed.subspan(taken);
    return filled;
  }

 private:
  static void check(std::size_t result) {
    if (LZ4F_isError(result) != 0)
      throw std::runtime_error(fmt::format("lz4 is damaged: {}", LZ4F_getErrorName(result)));
  }

  LZ4F_dctx* context_ = nullptr;
};

class ZstdDecoder : public FrameDecoder {
 public:
  void reset() override { ZSTD_DCtx_reset(context_.get(), ZSTD_reset_session_only); }

  std::size_t decode(std::span<const std::uint8_t>& packed, std::span<std::uint8_t> room) override {
    ZSTD_inBuffer in{packed.data(), packed.size(), 0};
    ZSTD_outBuffer out{room.data(), room.size(), 0};
    const std::size_t result = ZSTD_decompressStream(context_.get(), &out, &in);
    if (ZSTD_isError(result) != 0)
      throw std::runtime_error(fmt::format("zstd is damaged: {}", ZSTD_getErrorName(result)));
    packed = packed.subspan(in.pos);
    return out.pos;
  }

 private:
  std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context_{ZSTD_createDCtx(), ZSTD_freeDCtx};
};

/// The size that the first frame declares for its content; a usual one if it declares none.
[[nodiscard]] std::size_t declared_bytes(Compression compression, std::span<const std::uint8_t> packed) {
  constexpr std::size_t kUnknown_bytes = std::size_t{4} << 20;
  if (compression != Compression::kZstd) return kUnknown_bytes;
  const auto declared = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (declared == ZSTD_CONTENTSIZE_UNKNOWN || declared == ZSTD_CONTENTSIZE_ERROR) return kUnknown_bytes;
  return declared;
}

[[nodiscard]] std::unique_ptr<FrameDecoder> decoder_of(Compression compression) {
  if (compression == Compression::kLz4) return std::make_unique<Lz4Decoder>();
  return std::make_unique<ZstdDecoder>();
}

}  // namespace

Compression compression_of(std::string_view name) {
  if (name.empty() || name == "none") return Compression::kNone;
  if (name == "lz4") return Compression::kLz4;
  if (name == "zstd") return Compression::kZstd;
  throw std::runtime_error(
      fmt::format("is compressed by '{}', which is not read; write it with lz4, zstd or none", name));
}

void unpack(Compression compression, std::span<const std::uint8_t> packed, std::size_t most_bytes,
            std::vector<std::uint8_t>& unpacked) {
  // Beyond this ratio memory grows with what is really there, whatever the file declares.
  constexpr std::size_t kUsualRatio = 64;
  const std::size_t first_bytes =
      std::min({most_bytes, declared_bytes(compression, packed), kUsualRatio * packed.size()});
  const auto decoder = decoder_of(compression);
  std::size_t filled = 0;
  while (filled < most_bytes) {
    if (filled >= unpacked.size() || filled == 0)
      unpacked.resize(std::clamp(2 * filled, first_bytes, most_bytes));
    const std::size_t before = packed.size();
    const std::size_t count = decoder->decode(packed, std::span(unpacked).subspan(filled));
    filled += count;
    if (count == 0 && packed.size() == before) break;
  }
  unpacked.resize(filled);
}

void unpack_stream(Compression compression, const std::function<std::size_t(std::span<std::uint8_t>)>& read,
                   const std::function<void(std::span<const std::uint8_t>)>& write) {
  constexpr std::size_t kPart_bytes = std::size_t{1} << 20;
  const auto decoder = decoder_of(compression);
  std::vector<std::uint8_t> packed_part(kPart_bytes);
  std::vector<std::uint8_t> unpacked_part(kPart_bytes);
  while (const std::size_t bytes = read(packed_part)) {
    std::span<const std::uint8_t> packed(packed_part.data(), bytes);
    std::size_t filled = unpacked_part.size();
    while (!packed.empty() || filled == unpacked_part.size()) {  // a full part may not be all there is
      const std::size_t before = packed.size();
      filled = decoder->decode(packed, unpacked_part);
      if (filled == 0 && packed.size() == before) break;
      write(std::span(unpacked_part).first(filled));
    }
  }
}

UnpackStream::UnpackStream(Compression compression)
    : decoder_(decoder_of(compression)), part_(std::size_t{1} << 16) {}

UnpackStream::~UnpackStream() = default;

void UnpackStream::begin(ReadPacked read_packed) {
  decoder_->reset();
  read_packed_ = std::move(read_packed);
  packed_ = {};
}

std::size_t UnpackStream::read(std::span<std::uint8_t> room) {
  std::size_t filled = 0;
  while (filled < room.size()) {
    if (packed_.empty()) packed_ = std::span(part_).first(read_packed_(part_));
    const std::size_t before = packed_.size();
    const std::size_t count = decoder_->decode(packed_, room.subspan(filled));
    filled += count;
    if (count == 0 && packed_.size() == before) break;
  }
  return filled;
}

bool begins_as_zstd(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 4> kFrame = {0x28, 0xB5, 0x2F, 0xFD};
  return bytes.size() >= kFrame.size() && std::equal(kFrame.begin(), kFrame.end(), bytes.begin());
}

}  // namespace stereo_slam
