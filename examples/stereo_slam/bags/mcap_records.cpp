// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/mcap_records.hpp"

#include "stereo_slam/bags/message_fields.hpp"

namespace stereo_slam {
namespace {

/// MCAP writes its fields as ROS 1 does.
[[nodiscard]] MessageFields mcap_fields(std::span<const std::uint8_t> content) {
  return {content, Serialization::kRos1};
}

/// An array of a map from a channel to a number.
[[nodiscard]] std::map<std::uint16_t, std::uint64_t> next_map(MessageFields& fields) {
  std::map<std::uint16_t, std::uint64_t> numbers;
  MessageFields entries = mcap_fields(fields.bytes());
  while (!entries.at_end()) {
    const auto channel = entries.next<std::uint16_t>();
    numbers[channel] = entries.next<std::uint64_t>();
  }
  return numbers;
}

}  // namespace

McapRecord mcap_record(std::span<const std::uint8_t> header) {
  MessageFields fields = mcap_fields(header);
  McapRecord record;
  record.op = static_cast<McapOp>(fields.next<std::uint8_t>());
  record.bytes = fields.next<std::uint64_t>();
  return record;
}

McapFooter mcap_footer(std::span<const std::uint8_t> content) {
  MessageFields fields = mcap_fields(content);
  McapFooter footer;
  footer.summary_offset = fields.next<std::uint64_t>();
  (void)fields.next<std::uint64_t>();  // summary_offset_start
  footer.summary_checksum = fields.next<std::uint32_t>();
  return footer;
}

std::pair<std::uint16_t, std::string> mcap_schema(std::span<const std::uint8_t> content) {
  MessageFields fields = mcap_fields(content);
  const auto id = fields.next<std::uint16_t>();
  return {id, fields.text()};
}

McapChannel mcap_channel(std::span<const std::uint8_t> content) {
  MessageFields fields = mcap_fields(content);
  McapChannel channel;
  channel.id = fields.next<std::uint16_t>();
  channel.schema_id = fields.next<std::uint16_t>();
  channel.topic = fields.text();
  channel.message_encoding = fields.text();
  return channel;
}

McapMessage mcap_message(std::span<const std::uint8_t> content) {
  MessageFields fields = mcap_fields(content);
  McapMessage message;
  message.channel_id = fields.next<std::uint16_t>();
  (void)fields.next<std::uint32_t>();  // sequence
  message.log_ns = fields.next<std::int64_t>();
  (void)fields.next<std::int64_t>();  // publish_time
  return message;
}

McapChunkHeader mcap_chunk_header(std::span<const std::uint8_t> content) {
  MessageFields fields = mcap_fields(content);
  McapChunkHeader header;
  (void)fields.next<std::int64_t>();  // message_start_time
  (void)fields.next<std::int64_t>();  // message_end_time
  header.unpacked_bytes = fields.next<std::uint64_t>();
  header.checksum = fields.next<std::uint32_t>();
  header.compression = fields.text();
  header.packed_bytes = fields.next<std::uint64_t>();
  header.bytes = content.size() - fields.rest().size();
  return header;
}

std::vector<std::pair<std::int64_t, std::uint64_t>> mcap_message_index(
    std::span<const std::uint8_t> content) {
  MessageFields fields = mcap_fields(content);
  (void)fields.next<std::uint16_t>();  // channel_id
  MessageFields entries = mcap_fields(fields.bytes());
  std::vector<std::pair<std::int64_t, std::uint64_t>> messages;
  while (!entries.at_end()) {
    const auto log_ns = entries.next<std::int64_t>();
    messages.emplace_back(log_ns, entries.next<std::uint64_t>());
  }
  return messages;
}

McapChunkIndex mcap_chunk_index(std::span<const std::uint8_t> content) {
  MessageFields fields = mcap_fields(content);
  McapChunkIndex index;
  index.first_ns = fields.next<std::int64_t>();
  index.last_ns = fields.next<std::int64_t>();
  index.offset = fields.next<std::uint64_t>();
  index.bytes = fields.next<std::uint64_t>();
  index.message_indexes = next_map(fields);
  return index;
}

std::map<std::uint16_t, std::uint64_t> mcap_message_counts(std::span<const std::uint8_t> content) {
  MessageFields fields = mcap_fields(content);
  (void)fields.next<std::uint64_t>();                              // messages
  (void)fields.next<std::uint16_t>();                              // schemas
  for (int i = 0; i < 4; ++i) (void)fields.next<std::uint32_t>();  // channels, attachments, metadata, chunks
  for (int i = 0; i < 2; ++i) (void)fields.next<std::int64_t>();   // first and last time
  return next_map(fields);
}

std::optional<McapContent> first_mcap_record(std::span<const std::uint8_t> records) {
  if (records.size() < kMcapRecordHeader_bytes) return std::nullopt;
  const McapRecord record = mcap_record(records);
  const auto content = records.subspan(kMcapRecordHeader_bytes);
  if (record.bytes > content.size()) return std::nullopt;
  return McapContent{record.op, content.first(record.bytes)};
}

void for_each_mcap_record(std::span<const std::uint8_t> records,
                          const std::function<void(std::uint64_t offset, const McapContent& record)>& visit) {
  std::size_t at = 0;
  while (const auto record = first_mcap_record(records.subspan(at))) {
    visit(at, *record);
    at += kMcapRecordHeader_bytes + record->content.size();
  }
}

}  // namespace stereo_slam
