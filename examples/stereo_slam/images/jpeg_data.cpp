// SPDX-License-Identifier: MIT
#include "stereo_slam/images/jpeg_data.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace stereo_slam {
namespace {

using JpegBytes = std::span<const std::uint8_t>;

/// Thrown where the data cannot be what an encoder wrote.
struct JpegDamage {};

[[nodiscard]] std::size_t two_bytes(JpegBytes bytes, std::size_t at) {
  if (at + 2 > bytes.size()) throw JpegDamage{};
  return std::size_t{bytes[at]} << 8 | bytes[at + 1];
}

/// The bits of an entropy-coded segment, where the bytes FF 00 stand for FF (ITU T.81, F.2.2.5).
class EntropyCodedBits {
 public:
  explicit EntropyCodedBits(JpegBytes bytes) : bytes_(bytes) {}

  /// The next 16 bits; bits beyond the end of the segment are ones.
  [[nodiscard]] std::uint32_t peek() {
    while (count_ < 16) {
      const bool ended = at_ >= bytes_.size() || is_marker();
      missing_ += ended ? 8 : 0;
      buffer_ = buffer_ << 8 | (ended ? 0xFFU : bytes_[at_]);
      if (!ended) at_ += bytes_[at_] == 0xFF ? 2 : 1;
      count_ += 8;
    }
    return static_cast<std::uint32_t>(buffer_ >> (count_ - 16)) & 0xFFFFU;
  }

  /// Skips `bits`. Throws if the segment has fewer left.
  void skip(unsigned bits) {
    (void)peek();
    count_ -= bits;
    if (count_ < missing_) throw JpegDamage{};
  }

  /// Goes to the marker behind the segment, and returns its place. Throws if much is left of the segment.
  [[nodiscard]] std::size_t end() {
    constexpr std::size_t kMostLeft = 4;  // some encoders pad
    const std::size_t whole = (count_ - missing_) / 8;
    std::size_t left = whole;
    for (; at_ < bytes_.size() && !is_marker(); ++at_) ++left;
    if (left > kMostLeft || at_ >= bytes_.size()) throw JpegDamage{};
    count_ = missing_ = 0;
    return at_;
  }

  void restart_behind(std::size_t marker) { at_ = marker + 2; }

 private:
  [[nodiscard]] bool is_marker() const {
    return bytes_[at_] == 0xFF && (at_ + 1 >= bytes_.size() || bytes_[at_ + 1] != 0);
  }

  JpegBytes bytes_;
  std::size_t at_ = 0;
  std::uint64_t buffer_ = 0;
  unsigned count_ = 0;    ///< of bits in the buffer
  unsigned missing_ = 0;  ///< of these, beyond the end of the segment
};

/// Codes of up to 16 bits (T.81, annex C): symbol and length by the next 16 bits.
class HuffmanTable {
 public:
  /// Reads a table: numbers of codes by length (16), symbols. Returns its size.
  [[nodiscard]] std::size_t read(JpegBytes bytes) {
    if (bytes.size() < 16) throw JpegDamage{};
    entries_.assign(std::size_t{1} << 16, {});
    std::size_t code = 0;  // left-aligned
    std::size_t next = 16;
    for (unsigned length = 1; length <= 16; ++length) {
      const std::size_t width = std::size_t{1} << (16 - length);
      for (unsigned i = 0; i < bytes[length - 1]; ++i, code += width, ++next) {
        if (next >= bytes.size() || code + width > entries_.size()) throw JpegDamage{};
        std::fill_n(entries_.begin() + static_cast<std::ptrdiff_t>(code), width,
                    Entry{static_cast<std::uint8_t>(length), bytes[next]});
      }
    }
    return next;
  }

  [[nodiscard]] unsigned decode(EntropyCodedBits& bits) const {
    if (entries_.empty()) throw JpegDamage{};
    const Entry entry = entries_[bits.peek()];
    if (entry.length == 0) throw JpegDamage{};
    bits.skip(entry.length);
    return entry.symbol;
  }

 private:
  struct Entry {
    std::uint8_t length = 0;
    std::uint8_t symbol = 0;
  };
  std::vector<Entry> entries_;
};

struct JpegComponent {
  std::uint8_t id = 0;
  std::size_t across = 1;  ///< blocks in a unit of all components
  std::size_t down = 1;
};

/// Walks the segments of a sequential JPEG and decodes its codes, but no pixels.
class JpegWalk {
 public:
  explicit JpegWalk(JpegBytes bytes) : bytes_(bytes) {}

  void run() {
    for (std::size_t at = 2; at < bytes_.size();) {
      const std::size_t marker = two_bytes(bytes_, at);
      if (marker == 0xFFFF) {  // padding
        ++at;
        continue;
      }
      if (marker < 0xFF00) throw JpegDamage{};
      if (marker == 0xFFD9) return;
      const std::size_t length = two_bytes(bytes_, at + 2);
      if (length < 2 || length > bytes_.size() - at - 2) throw JpegDamage{};
      const JpegBytes segment = bytes_.subspan(at + 4, length - 2);
      at += 2 + length;
      if (marker == 0xFFC4) read_tables(segment);
      if (marker == 0xFFDD) restart_interval_ = two_bytes(segment, 0);
      if (marker == 0xFFC0 || marker == 0xFFC1) read_frame(segment);
      if (marker != 0xFFDA) continue;
      if (components_.empty()) return;  // progressive, lossless or arithmetic
      at = check_scan(segment, at);
    }
    throw JpegDamage{};
  }

 private:
  void read_tables(JpegBytes segment) {
    constexpr int kMostTables = 256;  // each takes 128 KB to write
    while (!segment.empty()) {
      if (++tables_read_ > kMostTables) throw JpegDamage{};
      const unsigned kind = segment[0] >> 4, id = segment[0] & 15U;
      if (kind > 1 || id > 3) throw JpegDamage{};
      segment = segment.subspan(1);
      segment = segment.subspan(tables_[kind][id].read(segment));
    }
  }

  /// Precision (1), height (2), width (2), number of components (1), and of each: id, factors, table.
  void read_frame(JpegBytes segment) {
    height_ = two_bytes(segment, 1);
    width_ = two_bytes(segment, 3);
    const std::size_t count = segment.size() > 5 ? segment[5] : 0;
    if (count == 0 || count > 4 || segment.size() < 6 + 3 * count) throw JpegDamage{};
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint8_t factors = segment[7 + 3 * i];
      components_.push_back(
          {segment[6 + 3 * i], static_cast<std::size_t>(factors >> 4), factors & std::size_t{15}});
      if (components_.back().across - 1 > 3 || components_.back().down - 1 > 3) throw JpegDamage{};
      most_across_ = std::max(most_across_, components_.back().across);
      most_down_ = std::max(most_down_, components_.back().down);
    }
  }

  struct ScanPart {
    std::size_t blocks;
    const HuffmanTable& dc;
    const HuffmanTable& ac;
  };

  /// Number of components (1), and of each: id, tables. Returns the place of the marker behind the scan.
  [[nodiscard]] std::size_t check_scan(JpegBytes header, std::size_t begin) const {
    const std::size_t count = header.empty() ? 0 : header[0];
    if (count == 0 || header.size() < 1 + 2 * count) throw JpegDamage{};
    std::vector<ScanPart> parts;
    std::size_t units = divide_up(width_, 8 * most_across_) * divide_up(height_, 8 * most_down_);
    for (std::size_t i = 0; i < count; ++i) {
      const auto component = std::ranges::find_if(
          components_, [&](const JpegComponent& c) { return c.id == header[1 + 2 * i]; });
      const unsigned dc = header[2 + 2 * i] >> 4, ac = header[2 + 2 * i] & 15U;
      if (component == components_.end() || dc > 3 || ac > 3) throw JpegDamage{};
      parts.push_back({count == 1 ? 1 : component->across * component->down, tables_[0][dc], tables_[1][ac]});
      if (count > 1) continue;  // one component: its own blocks, without padding to whole units
      units = divide_up(divide_up(width_ * component->across, most_across_), 8) *
              divide_up(divide_up(height_ * component->down, most_down_), 8);
    }
    EntropyCodedBits bits(bytes_.subspan(begin));
    for (std::size_t unit = 0; unit < units; ++unit) {
      if (restart_interval_ > 0 && unit > 0 && unit % restart_interval_ == 0) {
        const std::size_t marker = bits.end();
        const std::size_t expected = 0xFFD0 + (unit / restart_interval_ - 1) % 8;
        if (two_bytes(bytes_, begin + marker) != expected) throw JpegDamage{};
        bits.restart_behind(marker);
      }
      for (const ScanPart& part : parts) {
        for (std::size_t block = 0; block < part.blocks; ++block) check_block(bits, part);
      }
    }
    return begin + bits.end();
  }

  static void check_block(EntropyCodedBits& bits, const ScanPart& part) {
    constexpr unsigned kMostBits = 15;
    const unsigned size = part.dc.decode(bits);
    if (size > kMostBits) throw JpegDamage{};
    bits.skip(size);
    for (unsigned k = 1; k < 64; ++k) {
      const unsigned code = part.ac.decode(bits);
      const unsigned run = code >> 4, width = code & 15U;
      if (width == 0 && run < 15) return;  // end of the block
      k += run;
      if (k > 63) throw JpegDamage{};
      bits.skip(width);
    }
  }

  [[nodiscard]] static std::size_t divide_up(std::size_t a, std::size_t b) { return (a + b - 1) / b; }

  JpegBytes bytes_;
  std::array<std::array<HuffmanTable, 4>, 2> tables_;
  int tables_read_ = 0;
  std::size_t restart_interval_ = 0;
  std::size_t width_ = 0;
  std::size_t height_ = 0;
  std::vector<JpegComponent> components_;
  std::size_t most_across_ = 1;
  std::size_t most_down_ = 1;
};

}  // namespace

bool is_damaged_jpeg(std::span<const std::uint8_t> bytes) {
  try {
    JpegWalk(bytes).run();
  } catch (const JpegDamage&) {
    return true;
  }
  return false;
}

}  // namespace stereo_slam
