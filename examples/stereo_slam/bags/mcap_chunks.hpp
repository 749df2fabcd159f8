// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "stereo_slam/bags/mcap_records.hpp"
#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/bags/random_file.hpp"
#include "stereo_slam/bags/unpack.hpp"

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
};

/// The beginnings of messages. Of a compressed chunk no more is read and unpacked than has to be, if the
/// messages are asked for in their order. Checksums are not compared. The function throws like those of
/// McapChunks.
class McapBeginnings {
 public:
  explicit McapBeginnings(const RandomFile& file) : file_(file) {}

  /// At least the first kStampedBytes of a message, if it has as many. Valid until the next call.
  [[nodiscard]] std::span<const std::uint8_t> read(const MessagePlace& place);

 private:
  /// Makes this chunk the present one.
  void begin_chunk(std::uint64_t offset);

  /// The record at this place of the present chunk, or its beginning.
  [[nodiscard]] std::span<const std::uint8_t> read_record(std::uint64_t offset);

  const RandomFile& file_;
  std::map<Compression, UnpackStream> streams_;  ///< by which earlier chunks were unpacked
  std::vector<std::uint8_t> bytes_;

  // The present chunk.
  std::uint64_t chunk_ = 0;
  UnpackStream* stream_ = nullptr;  ///< nothing if it is not compressed
  std::uint64_t records_ = 0;       ///< where its records are in the file
  std::uint64_t at_ = 0;            ///< how much of it the stream has unpacked
};

/// The data of a message's record. Throws std::runtime_error if the record is none of a message.
[[nodiscard]] std::span<const std::uint8_t> mcap_message_data(const McapContent& record);

/// Reads the content of a record that begins at a place in the file, or the rest of the file if that is
/// shorter; `most_bytes` at most. Returns what kind it is. Throws std::runtime_error where no record can be,
/// and rather than read more than kMostUnpacked_bytes.
McapOp read_mcap_content(const RandomFile& file, std::uint64_t offset, std::uint64_t most_bytes,
                         std::vector<std::uint8_t>& content);

}  // namespace stereo_slam
