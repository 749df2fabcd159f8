// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stereo_slam/bags/mcap_records.hpp"
#include "stereo_slam/bags/random_file.hpp"

namespace stereo_slam {

/// The chunks of an MCAP file, of which up to four are kept unpacked, as long as they are small. The
/// functions throw std::runtime_error or std::invalid_argument if a chunk is damaged, has a wrong checksum or
/// is too large.
class McapChunks {
 public:
  explicit McapChunks(const RandomFile& file) : file_(file) {}

  /// The records of the chunk whose record begins at this place in the file. Of a chunk that is cut off,
  /// those that can be unpacked. Valid until another chunk is read.
  [[nodiscard]] std::span<const std::uint8_t> records(std::uint64_t offset);

  /// Frees the chunks.
  void release() { chunks_ = {}; }

  /// Where the first record of the chunk is in the file, if it is not compressed; otherwise 0.
  [[nodiscard]] std::uint64_t plain_records_offset(std::uint64_t offset);

 private:
  struct Chunk {
    std::uint64_t offset = 0;
    std::vector<std::uint8_t> content;
    std::vector<std::uint8_t> unpacked;
    std::span<const std::uint8_t> records;
  };

  void load(std::uint64_t offset, Chunk& chunk) const;

  const RandomFile& file_;
  std::array<Chunk, 4> chunks_;  ///< those of both cameras, if these are recorded at different times
  std::size_t next_ = 0;         ///< which is replaced next
  std::uint64_t plain_offset_ = 0;
  std::uint64_t plain_records_ = 0;
};

/// Reads the content of a record that begins at a place in the file, or the rest of the file if that is
/// shorter; `most_bytes` at most. Returns what kind it is. Throws std::runtime_error where no record can be,
/// and rather than read more than kMostUnpacked_bytes.
McapOp read_mcap_content(const RandomFile& file, std::uint64_t offset, std::uint64_t most_bytes,
                         std::vector<std::uint8_t>& content);

}  // namespace stereo_slam
