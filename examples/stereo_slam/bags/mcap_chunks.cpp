// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/mcap_chunks.hpp"

#include <algorithm>
#include <libdeflate.h>
#include <stdexcept>

#include <fmt/format.h>
namespace stereo_slam {
namespace {

[[noreturn]] void refuse_chunk(std::uint64_t offset, std::string_view why) {
  throw std::runtime_error(
      fmt::format("the chunk at byte {} {}; copy or download the bag again", offset, why));
}

}  // namespace

std::span<const std::uint8_t> mcap_message_data(const McapContent& record) {
  if (record.op != McapOp::kMessage || record.content.size() < kMcapMessageHeader_bytes)
    throw std::runtime_error("the index of the bag leads to other records; copy or download the bag again");
  return record.content.subspan(kMcapMessageHeader_bytes);
}

McapOp read_mcap_content(const RandomFile& file, std::uint64_t offset, std::uint64_t most_bytes,
                         std::vector<std::uint8_t>& content) {
  std::array<std::uint8_t, kMcapRecordHeader_bytes> header{};
  if (offset > file.size() || file.size() - offset < header.size())
    throw std::runtime_error(fmt::format("has no record at byte {}, where its index says", offset));
  file.read(offset, header);
  const std::uint64_t begin = offset + header.size();
  const McapRecord record = mcap_record(header);
  const std::uint64_t bytes = std::min({record.bytes, file.size() - begin, most_bytes});
  if (bytes > kMostUnpacked_bytes)
    throw std::runtime_error(
        fmt::format("the record at byte {} has more than 1 GB, which is not read", offset));
  content.resize(bytes);
  file.read(begin, content);
  return record.op;
}

void McapChunks::load(std::uint64_t offset, Chunk& chunk) const {
  chunk.offset = 0;  // until it is whole
  read_mcap_content(file_, offset, file_.size(), chunk.content);
  const McapChunkHeader header = mcap_chunk_header(chunk.content);
  if (header.unpacked_bytes > kMostUnpacked_bytes)
    refuse_chunk(offset, "unpacks to more than 1 GB, which is not read");
  const auto packed = std::span<const std::uint8_t>(chunk.content).subspan(header.bytes);
  const bool is_cut = packed.size() < header.packed_bytes;
  chunk.records = packed.first(std::min<std::uint64_t>(packed.size(), header.packed_bytes));
  const Compression compression = compression_of(header.compression);
  if (compression != Compression::kNone) {
    unpack(compression, chunk.records, header.unpacked_bytes, chunk.unpacked);
    chunk.records = chunk.unpacked;
  }
  if (is_cut) return;
  if (chunk.records.size() != header.unpacked_bytes)
    refuse_chunk(offset, fmt::format("has {} bytes and not {}", chunk.records.size(), header.unpacked_bytes));
  if (header.checksum != 0 &&
      libdeflate_crc32(0, chunk.records.data(), chunk.records.size()) != header.checksum)
    refuse_chunk(offset, "is damaged, it has another checksum");
}

std::span<const std::uint8_t> McapChunks::records(std::uint64_t offset) {
  constexpr std::size_t kMostKept_bytes = std::size_t{1} << 28;
  const auto known = std::ranges::find(chunks_, offset, &Chunk::offset);
  if (known != chunks_.end()) return known->records;
  std::size_t kept_bytes = 0;
  for (const auto& chunk : chunks_) kept_bytes += chunk.content.capacity() + chunk.unpacked.capacity();
  if (kept_bytes > kMostKept_bytes) release();
  Chunk& chunk = chunks_.at(next_);
  load(offset, chunk);
  chunk.offset = offset;
  next_ = (next_ + 1) % chunks_.size();
  return chunk.records;
}

void McapBeginnings::begin_chunk(std::uint64_t offset) {
  constexpr std::uint64_t kLongestHeader_bytes = 256;  // with the name of the compression
  chunk_ = 0;                                          // until it is begun
  read_mcap_content(file_, offset, kLongestHeader_bytes, bytes_);
  const McapChunkHeader header = mcap_chunk_header(bytes_);
  const Compression compression = compression_of(header.compression);
  records_ = offset + kMcapRecordHeader_bytes + header.bytes;
  at_ = 0;
  stream_ = nullptr;
  if (compression != Compression::kNone) {
    stream_ = &streams_.try_emplace(compression, compression).first->second;
    const std::uint64_t end = std::min(header.packed_bytes, file_.size() - records_) + records_;
    stream_->begin([this, at = records_, end](std::span<std::uint8_t> room) mutable {
      const auto part = room.first(std::min<std::uint64_t>(room.size(), end - at));
      file_.read(at, part);
      at += part.size();
      return part.size();
    });
  }
  chunk_ = offset;
}

std::span<const std::uint8_t> McapBeginnings::read_record(std::uint64_t offset) {
  constexpr std::size_t kSkippedAtOnce_bytes = std::size_t{1} << 16;
  constexpr std::size_t kNeeded_bytes = kMcapRecordHeader_bytes + kMcapMessageHeader_bytes + kStampedBytes;
  while (at_ < offset) {
    bytes_.resize(std::min<std::uint64_t>(offset - at_, kSkippedAtOnce_bytes));
    const std::size_t count = stream_->read(bytes_);
    at_ += count;
    if (count < bytes_.size()) break;
  }
  bytes_.resize(kNeeded_bytes);
  bytes_.resize(stream_->read(bytes_));
  at_ += bytes_.size();
  return bytes_;
}

std::span<const std::uint8_t> McapBeginnings::read(const MessagePlace& place) {
  constexpr std::uint64_t kNeeded_bytes = kMcapMessageHeader_bytes + kStampedBytes;
  if (place.block != 0 && (place.block != chunk_ || place.offset < at_)) begin_chunk(place.block);
  if (place.block == 0 || stream_ == nullptr) {
    const std::uint64_t begin = place.block == 0 ? 0 : records_;
    const McapOp op = read_mcap_content(file_, begin + place.offset, kNeeded_bytes, bytes_);
    return mcap_message_data({op, bytes_});
  }
  const auto bytes = read_record(place.offset);
  if (bytes.size() < kMcapRecordHeader_bytes) return mcap_message_data({});
  const McapRecord record = mcap_record(bytes);
  const auto content = bytes.subspan(kMcapRecordHeader_bytes);
  return mcap_message_data({record.op, content.first(std::min<std::uint64_t>(content.size(), record.bytes))});
}

}  // namespace stereo_slam
