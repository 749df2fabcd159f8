// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "stereo_slam/bags/unpack.hpp"

/// The records of an MCAP file (https://mcap.dev/spec), from their bytes. The functions throw
/// std::invalid_argument if a record ends within its fields.
namespace stereo_slam {

constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};  ///< begins and ends a file

/// The kinds of records that are read or written.
enum class McapOp : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F
};

/// The kind of a record and the length of its content.
constexpr std::size_t kMcapRecordHeader_bytes = 9;
/// A message before its data: channel, sequence, two times.
constexpr std::size_t kMcapMessageHeader_bytes = 22;
/// A footer record: where the summary and its offsets begin, a checksum.
constexpr std::size_t kMcapFooter_bytes = kMcapRecordHeader_bytes + 20;

struct McapRecord {
  McapOp op{};
  std::uint64_t bytes = 0;  ///< of the content
};
[[nodiscard]] McapRecord mcap_record(std::span<const std::uint8_t> header);

struct McapFooter {
  std::uint64_t summary_offset = 0;  ///< in the file; 0 if there is no summary
  std::uint32_t summary_checksum = 0;
};
[[nodiscard]] McapFooter mcap_footer(std::span<const std::uint8_t> content);

/// The id of a schema, and the name of the type that it describes.
[[nodiscard]] std::pair<std::uint16_t, std::string> mcap_schema(std::span<const std::uint8_t> content);

struct McapChannel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;
  std::string topic;
  std::string message_encoding;
};
[[nodiscard]] McapChannel mcap_channel(std::span<const std::uint8_t> content);

struct McapMessage {
  std::uint16_t channel_id = 0;
  std::int64_t log_ns = 0;  ///< when it was recorded
};
/// Needs kMcapMessageHeader_bytes of the content; the rest is the data.
[[nodiscard]] McapMessage mcap_message(std::span<const std::uint8_t> content);

/// What stands before the records of a chunk.
struct McapChunkHeader {
  std::uint64_t unpacked_bytes = 0;
  std::uint32_t checksum = 0;  ///< of the unpacked records; 0 if there is none
  std::string compression;
  std::uint64_t packed_bytes = 0;
  std::size_t bytes = 0;  ///< of this header
};
[[nodiscard]] McapChunkHeader mcap_chunk_header(std::span<const std::uint8_t> content);

/// Where the messages of a channel are in a chunk: time of recording and offset.
[[nodiscard]] std::vector<std::pair<std::int64_t, std::uint64_t>> mcap_message_index(
    std::span<const std::uint8_t> content);

struct McapChunkIndex {
  std::int64_t first_ns = 0;  ///< both times are 0 if it has no messages
  std::int64_t last_ns = 0;
  std::uint64_t offset = 0;                                ///< of the chunk's record in the file
  std::uint64_t bytes = 0;                                 ///< of the record
  std::map<std::uint16_t, std::uint64_t> message_indexes;  ///< offsets in the file, by channel
};
[[nodiscard]] McapChunkIndex mcap_chunk_index(std::span<const std::uint8_t> content);

/// The numbers of messages by channel; none if the file does not say.
[[nodiscard]] std::map<std::uint16_t, std::uint64_t> mcap_message_counts(
    std::span<const std::uint8_t> content);

/// A record with its content.
struct McapContent {
  McapOp op{};
  std::span<const std::uint8_t> content;
};

/// The first of these records; nothing if it is not there in full.
[[nodiscard]] std::optional<McapContent> first_mcap_record(std::span<const std::uint8_t> records);

/// Calls `visit` with each record that is there in full, and with its offset.
void for_each_mcap_record(std::span<const std::uint8_t> records,
                          const std::function<void(std::uint64_t offset, const McapContent& record)>& visit);

}  // namespace stereo_slam
