// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/mcap_writer.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <libdeflate.h>
#include <stdexcept>
#include <zstd.h>

#include <fmt/format.h>

#include "stereo_slam/bags/mcap_records.hpp"

namespace stereo_slam {
namespace {

static_assert(std::endian::native == std::endian::little, "the numbers of MCAP are little-endian");

template <class Number>
[[nodiscard]] std::string number(Number value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

[[nodiscard]] std::string length_of(std::string_view bytes) {
  return number(static_cast<std::uint32_t>(bytes.size()));
}

/// A string, or an array or map of these bytes.
[[nodiscard]] std::string text(std::string_view bytes) { return length_of(bytes) + std::string(bytes); }

[[nodiscard]] std::string record(McapOp op, std::string_view content) {
  std::string bytes = number(op) + number(std::uint64_t{content.size()});
  bytes += content;
  return bytes;
}

[[nodiscard]] std::string map_of(const std::map<std::uint16_t, std::uint64_t>& numbers) {
  std::string entries;
  for (const auto& [key, value] : numbers) entries += number(key) + number(value);
  return text(entries);
}

[[nodiscard]] std::uint32_t checksum(std::uint32_t before, std::string_view bytes) {
  return libdeflate_crc32(before, bytes.data(), bytes.size());
}

[[nodiscard]] std::string compressed(std::string_view bytes) {
  constexpr int kLevel = 1;  // larger ones take more time, and save a tenth of the bytes
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kLevel);
  if (ZSTD_isError(size) != 0)
    throw std::runtime_error(fmt::format("a chunk cannot be compressed: {}", ZSTD_getErrorName(size)));
  packed.resize(size);
  return packed;
}

}  // namespace

void McapWriter::Times::add(std::uint64_t ns) {
  first_ns = messages == 0 ? ns : std::min(first_ns, ns);
  last_ns = std::max(last_ns, ns);
  ++messages;
}

McapWriter::McapWriter(Append append, std::string_view library) : append_(std::move(append)) {
  this->append(std::string(kMcapMagic) + record(McapOp::kHeader, text("ros2") + text(library)));
}

bool McapWriter::is_of(std::string_view beginning, std::string_view library) {
  if (!beginning.starts_with(kMcapMagic)) return false;
  beginning.remove_prefix(kMcapMagic.size());
  const std::string profile = text("ros2");
  const std::size_t at = kMcapRecordHeader_bytes + profile.size() + sizeof(std::uint32_t);
  return beginning.size() > at && beginning.front() == static_cast<char>(McapOp::kHeader) &&
         beginning.substr(kMcapRecordHeader_bytes).starts_with(profile) &&
         beginning.substr(at).starts_with(library);
}

void McapWriter::append(std::string_view bytes) {
  append_(bytes);
  position_ += bytes.size();
  checksum_ = checksum(checksum_, bytes);
}

std::uint16_t McapWriter::add_topic(const McapTopic& topic) {
  const std::uint16_t id = ++channels_;  // every topic has a schema of its own, with the same id
  const std::string schema =
      record(McapOp::kSchema, number(id) + text(topic.type) + text("ros2msg") + text(topic.schema));
  const std::string qos = topic.qos.empty() ? "" : text("offered_qos_profiles") + text(topic.qos);
  const std::string channel =
      record(McapOp::kChannel, number(id) + number(id) + text(topic.name) + text("cdr") + text(qos));
  schemas_ += schema;
  channel_records_ += channel;
  records_ += schema + channel;
  return id;
}

void McapWriter::add(std::uint16_t channel, std::int64_t log_ns, std::span<const std::uint8_t> message) {
  const auto ns = static_cast<std::uint64_t>(log_ns);
  indexes_[channel] += number(ns) + number(std::uint64_t{records_.size()});
  records_ += number(McapOp::kMessage) + number(std::uint64_t{kMcapMessageHeader_bytes + message.size()});
  records_ += number(channel) + number(sequence_++) + number(ns) + number(ns);
  records_.append(reinterpret_cast<const char*>(message.data()), message.size());
  chunk_times_.add(ns);
  times_.add(ns);
  ++counts_[channel];
}

void McapWriter::end_chunk() {
  if (chunk_times_.messages == 0) return;
  const std::string packed = compressed(records_);
  const std::string times = number(chunk_times_.first_ns) + number(chunk_times_.last_ns);
  std::string bytes =
      record(McapOp::kChunk, times + number(std::uint64_t{records_.size()}) + number(checksum(0, records_)) +
                                 text("zstd") + number(std::uint64_t{packed.size()}) + packed);
  const std::uint64_t chunk_bytes = bytes.size();
  std::map<std::uint16_t, std::uint64_t> offsets;
  for (const auto& [channel, entries] : indexes_) {
    offsets[channel] = position_ + bytes.size();
    bytes += record(McapOp::kMessageIndex, number(channel) + text(entries));
  }
  chunk_indexes_ += record(McapOp::kChunkIndex, times + number(position_) + number(chunk_bytes) +
                                                    map_of(offsets) + number(bytes.size() - chunk_bytes) +
                                                    text("zstd") + number(std::uint64_t{packed.size()}) +
                                                    number(std::uint64_t{records_.size()}));
  append(bytes);
  ++chunks_;
  records_.clear();
  indexes_.clear();
  chunk_times_ = {};
}

std::string McapWriter::statistics() const {
  constexpr std::uint32_t kNone = 0;  // attachments, metadata
  return record(McapOp::kStatistics, number(times_.messages) + number(channels_) +
                                         number(std::uint32_t{channels_}) + number(kNone) + number(kNone) +
                                         number(chunks_) + number(times_.first_ns) + number(times_.last_ns) +
                                         map_of(counts_));
}

/// The summary, its offsets, and the footer without the checksum, of a file whose data ends at position_.
std::string McapWriter::summary() const {
  std::string bytes;
  std::string offsets;
  const auto add_group = [&](McapOp op, const std::string& records) {
    if (records.empty()) return;
    offsets += record(McapOp::kSummaryOffset,
                      number(op) + number(position_ + bytes.size()) + number(std::uint64_t{records.size()}));
    bytes += records;
  };
  add_group(McapOp::kSchema, schemas_);
  add_group(McapOp::kChannel, channel_records_);
  add_group(McapOp::kStatistics, statistics());
  add_group(McapOp::kChunkIndex, chunk_indexes_);
  const std::uint64_t offsets_begin = position_ + bytes.size();
  constexpr std::uint64_t kFooterContent_bytes = kMcapFooter_bytes - kMcapRecordHeader_bytes;
  return bytes + offsets + number(McapOp::kFooter) + number(kFooterContent_bytes) + number(position_) +
         number(offsets_begin);
}

void McapWriter::end() {
  end_chunk();
  append(record(McapOp::kDataEnd, number(checksum_)));
  const std::string last = summary();
  append(last + number(checksum(0, last)) + std::string(kMcapMagic));
}

}  // namespace stereo_slam
