// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <libdeflate.h>
#include <lz4frame.h>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>
#include <zstd.h>

#include "stereo_slam/support/cdr.hpp"

namespace stereo_slam::test {

struct McapLayout {
  std::string compression{};  ///< "", "lz4", "zstd"; another one is declared, and is none
  bool has_chunks = true;
  bool has_index = true;             ///< message indexes and a summary
  std::size_t chunk_bytes = 60'000;  ///< it ends with the message that reaches them
  std::string encoding = "cdr";
  std::uint32_t wrong_checksum = 0;  ///< is added to those of chunks
  std::uint64_t hole_bytes = 0;      ///< an attachment of so many bytes, which are not written, comes first
};

/// A file, and where its messages are complete: the ends of their records, or of their chunks if these are
/// compressed.
struct McapBytes {
  std::string bytes;
  std::vector<std::size_t> message_ends;
  std::size_t hole_at = 0;  ///< where the bytes of the attachment are missing
};

/// Writes MCAP as its specification has it; deliberately simple, and able to write what should not be.
class McapWriter {
 public:
  explicit McapWriter(McapLayout layout) : layout_(std::move(layout)) {
    file_.bytes = kMagic;
    file_.bytes += record(0x01, text("ros2") + text("tests"));
    if (layout_.hole_bytes > 0) file_.bytes += std::string(1, '\x09') + number(layout_.hole_bytes);
    file_.hole_at = file_.bytes.size();
  }

  void add(const TestMessage& message) {
    std::string& records = layout_.has_chunks ? chunk_ : file_.bytes;
    const auto [channel, is_new] = channels_.try_emplace(message.topic, channels_.size() + 1);
    const auto id = static_cast<std::uint16_t>(channel->second);
    if (is_new) {
      const std::string definitions =
          record(0x03, number(id) + text(message.type) + text("ros2msg") + text("")) +
          record(0x04, number(id) + number(id) + text(message.topic) + text(layout_.encoding) + text(""));
      records += definitions;
      definitions_ += definitions;
    }
    if (layout_.has_chunks) index_[id] += number(message.record_ns) + number(std::uint64_t{records.size()});
    records +=
        record(0x05, number(id) + number(std::uint32_t{0}) + number(message.record_ns) +
                         number(message.record_ns) + std::string(message.bytes.begin(), message.bytes.end()));
    ++counts_[id];
    if (!layout_.has_chunks) {
      file_.message_ends.push_back(file_.bytes.size());
      return;
    }
    ends_in_chunk_.push_back(chunk_.size());
    first_ns_ = chunk_messages_++ == 0 ? message.record_ns : std::min(first_ns_, message.record_ns);
    last_ns_ = std::max(last_ns_, message.record_ns);
    if (chunk_.size() >= layout_.chunk_bytes) end_chunk();
  }

  /// Takes the bytes so far, so that they need not be kept. The offsets of McapBytes are then of no use.
  [[nodiscard]] std::string take() {
    taken_bytes_ += file_.bytes.size();
    return std::exchange(file_.bytes, {});
  }

  /// What has not been taken, and the end of the file.
  [[nodiscard]] McapBytes end() {
    end_chunk();
    file_.bytes += record(0x0F, number(std::uint32_t{0}));
    std::string footer = number(std::uint64_t{0}) + number(std::uint64_t{0});
    std::string summary;
    if (layout_.has_index) {
      summary = definitions_ + chunk_indexes_ + record(0x0B, statistics());
      footer = number(position()) + number(std::uint64_t{0});
    }
    std::string checked = summary + std::string(1, '\x02') + number(std::uint64_t{20}) + footer;
    file_.bytes += checked + number(layout_.has_index ? checksum(checked) : 0) + kMagic;
    return std::move(file_);
  }

  template <class Number>
  static std::string number(Number value) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return bytes;
  }
  static std::string text(const std::string& value) {
    return number(static_cast<std::uint32_t>(value.size())) + value;
  }
  static std::string record(char op, const std::string& content) {
    return std::string(1, op) + number(std::uint64_t{content.size()}) + content;
  }

 private:
  static inline const std::string kMagic{"\x89MCAP0\r\n", 8};

  static std::uint32_t checksum(const std::string& bytes) {
    return libdeflate_crc32(0, bytes.data(), bytes.size());
  }

  /// In the file, with the attachment.
  [[nodiscard]] std::uint64_t position() const {
    return taken_bytes_ + file_.bytes.size() + layout_.hole_bytes;
  }

  [[nodiscard]] std::string packed() const {
    std::string bytes = chunk_;
    if (layout_.compression == "lz4") {
      bytes.resize(LZ4F_compressFrameBound(chunk_.size(), nullptr));
      bytes.resize(LZ4F_compressFrame(bytes.data(), bytes.size(), chunk_.data(), chunk_.size(), nullptr));
    } else if (layout_.compression == "zstd") {
      bytes.resize(ZSTD_compressBound(chunk_.size()));
      bytes.resize(ZSTD_compress(bytes.data(), bytes.size(), chunk_.data(), chunk_.size(), 1));
    }
    return bytes;
  }

  void end_chunk() {
    if (chunk_.empty()) return;
    const std::string records = packed();
    const std::uint64_t begin = position();
    file_.bytes +=
        record(0x06, number(first_ns_) + number(last_ns_) + number(std::uint64_t{chunk_.size()}) +
                         number(checksum(chunk_) + layout_.wrong_checksum) + text(layout_.compression) +
                         number(std::uint64_t{records.size()}) + records);
    const std::size_t end = file_.bytes.size();
    const std::uint64_t after_chunk = position();
    for (const std::size_t at : ends_in_chunk_)
      file_.message_ends.push_back(layout_.compression.empty() ? end - chunk_.size() + at : end);
    std::string offsets;
    for (const auto& [channel, entries] : index_) {
      offsets += number(channel) + number(position());
      if (layout_.has_index) file_.bytes += record(0x07, number(channel) + text(entries));
    }
    chunk_indexes_ +=
        record(0x08, number(first_ns_) + number(last_ns_) + number(begin) + number(after_chunk - begin) +
                         text(offsets) + number(position() - after_chunk) + text(layout_.compression) +
                         number(std::uint64_t{records.size()}) + number(std::uint64_t{chunk_.size()}));
    chunk_.clear();
    index_.clear();
    ends_in_chunk_.clear();
    chunk_messages_ = 0;
    last_ns_ = 0;
  }

  [[nodiscard]] std::string statistics() const {
    std::string counts;
    std::uint64_t messages = 0;
    for (const auto& [channel, count] : counts_) {
      counts += number(channel) + number(count);
      messages += count;
    }
    return number(messages) + number(std::uint16_t{0}) + std::string(16, '\0') + std::string(16, '\0') +
           text(counts);
  }

  McapLayout layout_;
  McapBytes file_;
  std::map<std::string, std::size_t> channels_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::map<std::uint16_t, std::string> index_;
  std::string chunk_, definitions_, chunk_indexes_;
  std::vector<std::size_t> ends_in_chunk_;
  std::size_t chunk_messages_ = 0;
  std::uint64_t taken_bytes_ = 0;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
};

inline McapBytes mcap_of(const std::vector<TestMessage>& messages, const McapLayout& layout = {}) {
  McapWriter writer(layout);
  for (const auto& message : messages) writer.add(message);
  return writer.end();
}

}  // namespace stereo_slam::test
