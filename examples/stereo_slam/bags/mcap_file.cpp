// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/bags/mcap_chunks.hpp"
#include "stereo_slam/bags/mcap_index.hpp"
#include "stereo_slam/bags/mcap_records.hpp"
#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/bags/random_file.hpp"

namespace stereo_slam {
namespace {

/// A bag in the format MCAP. The block of a place is the offset of its chunk, or 0 outside of chunks; its
/// offset is that of the message's record in the chunk or in the file.
class McapFile : public MessageFile {
 public:
  explicit McapFile(const std::filesystem::path& file) : file_(file), chunks_(file_) {
    std::array<std::uint8_t, kMcapMagic.size()> magic{};
    if (file_.size() == 0) throw std::runtime_error("is empty; its recording was not begun, or not copied");
    if (file_.size() >= magic.size()) file_.read(0, magic);
    if (!std::equal(magic.begin(), magic.end(), kMcapMagic.begin(),
                    [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); }))
      throw std::runtime_error("is no MCAP file, its first bytes are others; check its name");
    auto summary = read_mcap_summary(file_);
    index_ = summary ? std::move(*summary) : index_mcap_records(file_, chunks_);
  }

  [[nodiscard]] std::vector<BagTopic> topics() override {
    std::map<std::string, BagTopic> by_name;
    for (const auto& [id, channel] : index_.channels) {
      const auto type = index_.types.find(channel.schema_id);
      BagTopic& topic = by_name[channel.topic];
      topic = {.name = channel.topic,
               .type = type == index_.types.end() ? "" : type->second,
               .messages = topic.messages + count(id),
               .serialization = channel.message_encoding};
    }
    std::vector<BagTopic> topics;
    topics.reserve(by_name.size());
    for (auto& [name, topic] : by_name) topics.push_back(std::move(topic));
    return topics;
  }

  [[nodiscard]] std::optional<RecordTimes> times() override { return index_.times; }

  [[nodiscard]] std::vector<MessagePlace> places(const std::string& topic) override {
    std::vector<MessagePlace> places;
    for (const auto& [id, channel] : index_.channels) {
      if (channel.topic != topic) continue;
      const auto more = places_of(id);
      places.insert(places.end(), more.begin(), more.end());
    }
    return places;
  }

  using MessageFile::read;
  [[nodiscard]] std::span<const std::uint8_t> read(const MessagePlace& place,
                                                   std::size_t most_bytes) override {
    if (place.block == 0) return read_from_file(place.offset, most_bytes);
    // The beginning of a message need not wait for its whole chunk.
    if (most_bytes < kMostUnpacked_bytes) {
      if (const auto records = chunks_.plain_records_offset(place.block); records != 0)
        return read_from_file(records + place.offset, most_bytes);
    }
    const auto records = chunks_.records(place.block);
    const auto record = first_mcap_record(records.subspan(std::min(place.offset, records.size())));
    if (!record) refuse_index();
    return message_data(*record);
  }

  void release() override {
    chunks_.release();
    bytes_ = {};
  }

  [[nodiscard]] std::string warning() const override { return index_.warning; }

 private:
  [[nodiscard]] std::size_t count(std::uint16_t channel) {
    if (!index_.counts.empty() || index_.chunks.empty()) return index_.counts[channel];
    return places_of(channel).size();
  }

  [[nodiscard]] std::vector<MessagePlace> places_of(std::uint16_t channel) {
    if (index_.chunks.empty()) return index_.places[channel];
    std::vector<MessagePlace> places;
    for (const auto& chunk : index_.chunks) {
      const auto index = chunk.message_indexes.find(channel);
      if (index == chunk.message_indexes.end()) continue;
      const McapOp op = read_mcap_content(file_, index->second, file_.size(), bytes_);
      if (op != McapOp::kMessageIndex) refuse_index();
      for (const auto& [log_ns, offset] : mcap_message_index(bytes_))
        places.push_back({log_ns, chunk.offset, offset});
    }
    return places;
  }

  /// The data of a message whose record is at this place in the file, or its first bytes.
  [[nodiscard]] std::span<const std::uint8_t> read_from_file(std::uint64_t offset, std::size_t most_bytes) {
    const std::uint64_t most = std::min<std::uint64_t>(most_bytes, file_.size()) + kMcapMessageHeader_bytes;
    const McapOp op = read_mcap_content(file_, offset, most, bytes_);
    return message_data({op, bytes_});
  }

  static std::span<const std::uint8_t> message_data(const McapContent& record) {
    if (record.op != McapOp::kMessage || record.content.size() < kMcapMessageHeader_bytes) refuse_index();
    return record.content.subspan(kMcapMessageHeader_bytes);
  }

  [[noreturn]] static void refuse_index() {
    throw std::runtime_error("the index of the bag leads to other records; copy or download the bag again");
  }

  RandomFile file_;
  McapChunks chunks_;
  McapIndex index_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::unique_ptr<MessageFile> open_mcap_file(const std::filesystem::path& file) {
  return std::make_unique<McapFile>(file);
}

}  // namespace stereo_slam
