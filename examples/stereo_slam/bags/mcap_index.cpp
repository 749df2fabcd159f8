// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/mcap_index.hpp"

#include <algorithm>
#include <array>
#include <libdeflate.h>
#include <stdexcept>

#include <fmt/format.h>

#include "stereo_slam/io/counted.hpp"

namespace stereo_slam {
namespace {

void extend(std::optional<RecordTimes>& times, std::int64_t first_ns, std::int64_t last_ns) {
  if (!times) times = RecordTimes{first_ns, last_ns};
  times->first_ns = std::min(times->first_ns, first_ns);
  times->last_ns = std::max(times->last_ns, last_ns);
}

/// Adds what is known of channels.
void add_definition(const McapContent& record, McapIndex& index) {
  const auto& [op, content] = record;
  if (op == McapOp::kSchema) {
    auto [id, type] = mcap_schema(content);
    index.types.try_emplace(id, std::move(type));
  } else if (op == McapOp::kChannel) {
    auto channel = mcap_channel(content);
    index.channels.try_emplace(channel.id, std::move(channel));
  }
}

/// The bytes from the summary to the end of the footer's record, whose offset of the summary they contain.
/// Nothing if there are none, or they are damaged.
[[nodiscard]] std::vector<std::uint8_t> summary_bytes(const RandomFile& file) {
  constexpr std::uint64_t kLongestSummary_bytes = std::uint64_t{1} << 28;
  const std::uint64_t end_bytes = kMcapFooter_bytes + kMcapMagic.size();
  if (file.size() < kMcapMagic.size() + end_bytes) return {};
  std::vector<std::uint8_t> bytes(end_bytes);
  file.read(file.size() - end_bytes, bytes);
  const bool ends = std::equal(kMcapMagic.begin(), kMcapMagic.end(), bytes.end() - kMcapMagic.size(),
                               [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
  if (!ends || mcap_record(bytes).op != McapOp::kFooter) return {};
  const McapFooter footer = mcap_footer(std::span(bytes).subspan(kMcapRecordHeader_bytes));
  const std::uint64_t end = file.size() - kMcapMagic.size();
  if (footer.summary_offset == 0 || footer.summary_offset > file.size() - end_bytes) return {};
  if (end - footer.summary_offset > kLongestSummary_bytes) return {};
  bytes.resize(end - footer.summary_offset);
  file.read(footer.summary_offset, bytes);
  const auto checked = std::span(bytes).first(bytes.size() - sizeof footer.summary_checksum);
  const bool is_whole = footer.summary_checksum == 0 ||
                        libdeflate_crc32(0, checked.data(), checked.size()) == footer.summary_checksum;
  if (!is_whole) bytes.clear();
  return bytes;
}

/// Whether the index leads to all messages of the chunk.
[[nodiscard]] bool finds_messages(const McapChunkIndex& chunk, const McapIndex& index,
                                  const RandomFile& file) {
  if (chunk.offset > file.size() || chunk.bytes > file.size() - chunk.offset) return false;
  if (chunk.message_indexes.empty()) return chunk.last_ns == 0;
  return std::ranges::all_of(chunk.message_indexes,
                             [&](const auto& entry) { return index.channels.contains(entry.first); });
}

/// Reads a file from its beginning, record by record.
class RecordScan {
 public:
  RecordScan(const RandomFile& file, McapChunks& chunks) : file_(file), chunks_(chunks) {}

  [[nodiscard]] McapIndex run() {
    std::uint64_t at = kMcapMagic.size();
    while (!ended_ && file_.size() - at >= kMcapRecordHeader_bytes) {
      std::array<std::uint8_t, kMcapRecordHeader_bytes> header{};
      file_.read(at, header);
      const McapRecord record = mcap_record(header);
      const std::uint64_t rest = file_.size() - at - header.size();
      const bool is_cut = record.bytes > rest;
      if (!is_cut || record.op == McapOp::kChunk) try_to_add(at, record.op, is_cut);
      if (is_cut || record.op == McapOp{}) break;  // zeros are room for records that were not written
      at += header.size() + record.bytes;
    }
    index_.warning = warning();
    return std::move(index_);
  }

 private:
  void try_to_add(std::uint64_t offset, McapOp op, bool is_cut) {
    try {
      add(offset, op);
    } catch (const std::exception& error) {
      if (!is_cut && damaged_++ == 0) fault_ = error.what();
    }
  }

  void add(std::uint64_t offset, McapOp op) {
    switch (op) {
      case McapOp::kSchema:
      case McapOp::kChannel:
        read_mcap_content(file_, offset, file_.size(), content_);
        add_definition({op, content_}, index_);
        break;
      case McapOp::kMessage:
        read_mcap_content(file_, offset, kMcapMessageHeader_bytes, content_);
        add_message(0, offset, content_);
        break;
      case McapOp::kChunk:
        for_each_mcap_record(chunks_.records(offset), [&](std::uint64_t at, const McapContent& inner) {
          add_definition(inner, index_);
          if (inner.op == McapOp::kMessage) add_message(offset, at, inner.content);
        });
        break;
      case McapOp::kDataEnd:
      case McapOp::kFooter:
        ended_ = true;
        break;
      default:
        break;
    }
  }

  void add_message(std::uint64_t block, std::uint64_t offset, std::span<const std::uint8_t> content) {
    const McapMessage message = mcap_message(content);
    index_.places[message.channel_id].push_back({message.log_ns, block, offset});
    ++index_.counts[message.channel_id];
    extend(index_.times, message.log_ns, message.log_ns);
  }

  [[nodiscard]] std::string warning() const {
    std::string text;
    if (damaged_ > 0)
      text = fmt::format("{} cannot be read, the first because {}",
                         counted(damaged_, "chunk or record", "chunks or records"), fault_);
    if (ended_) return text;
    std::size_t messages = 0;
    for (const auto& [channel, count] : index_.counts) messages += count;
    return fmt::format(
        "{}{}the file is not whole, because it was cut off or its recording was not ended: {} at its "
        "beginning can be read, and later ones are missing",
        text, text.empty() ? "" : "; ", counted(messages, "message"));
  }

  const RandomFile& file_;
  McapChunks& chunks_;
  McapIndex index_;
  std::vector<std::uint8_t> content_;
  bool ended_ = false;
  std::size_t damaged_ = 0;
  std::string fault_;
};

}  // namespace

std::optional<McapIndex> read_mcap_summary(const RandomFile& file) {
  McapIndex index;
  try {
    for_each_mcap_record(summary_bytes(file), [&](std::uint64_t /*offset*/, const McapContent& record) {
      add_definition(record, index);
      const auto& [op, content] = record;
      if (op == McapOp::kChunkIndex) index.chunks.push_back(mcap_chunk_index(content));
      if (op == McapOp::kStatistics) index.counts = mcap_message_counts(content);
    });
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
  const auto finds = [&](const McapChunkIndex& chunk) { return finds_messages(chunk, index, file); };
  if (index.chunks.empty() || !std::ranges::all_of(index.chunks, finds)) return std::nullopt;
  for (const auto& chunk : index.chunks) {
    if (chunk.last_ns != 0) extend(index.times, chunk.first_ns, chunk.last_ns);
  }
  return index;
}

McapIndex index_mcap_records(const RandomFile& file, McapChunks& chunks) {
  return RecordScan(file, chunks).run();
}

}  // namespace stereo_slam
