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

std::uint64_t McapChunks::plain_records_offset(std::uint64_t offset) {
  if (offset == plain_offset_) return plain_records_;
  constexpr std::uint64_t kLongestHeader_bytes = 256;  // with the name of the compression
  std::vector<std::uint8_t> content;
  read_mcap_content(file_, offset, kLongestHeader_bytes, content);
  const McapChunkHeader header = mcap_chunk_header(content);
  const bool is_plain = compression_of(header.compression) == Compression::kNone;
  plain_records_ = is_plain ? offset + kMcapRecordHeader_bytes + header.bytes : 0;
  plain_offset_ = offset;
  return plain_records_;
}

}  // namespace stereo_slam
