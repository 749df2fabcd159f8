// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/bags/mcap_chunks.hpp"
#include "stereo_slam/bags/mcap_index.hpp"
#include "stereo_slam/bags/mcap_records.hpp"
#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/bags/random_file.hpp"
#include "stereo_slam/core/parallel.hpp"

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

  [[nodiscard]] std::span<const std::uint8_t> read(const MessagePlace& place) override {
    if (place.block == 0) {
      const McapOp op = read_mcap_content(file_, place.offset, file_.size(), bytes_);
      return mcap_message_data({op, bytes_});
    }
    const auto records = chunks_.records(place.block);
    const auto record = first_mcap_record(records.subspan(std::min(place.offset, records.size())));
    return mcap_message_data(record.value_or(McapContent{}));
  }

  /// In the order of the file, in parts at the same time: more than there are threads, so that these end at
  /// about the same time.
  [[nodiscard]] std::vector<MessageBeginning> read_beginnings(std::span<const MessagePlace> places) override {
    std::vector<std::size_t> order(places.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t i) { return std::pair(places[i].block, places[i].offset); });
    std::vector<MessageBeginning> beginnings(places.size());
    constexpr std::size_t kPartsOfThread = 4;
    const std::size_t parts = kPartsOfThread * static_cast<std::size_t>(cv::getNumThreads());
    run_each(parts, [&](std::size_t part) {
      McapBeginnings reader(file_);
      for (std::size_t k = part * order.size() / parts; k < (part + 1) * order.size() / parts; ++k)
        fill_beginning(beginnings[order[k]], [&] { return reader.read(places[order[k]]); });
    });
    return beginnings;
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
      if (op != McapOp::kMessageIndex)
        throw std::runtime_error(
            "the index of the bag leads to other records; copy or download the bag again");
      for (const auto& [log_ns, offset] : mcap_message_index(bytes_))
        places.push_back({log_ns, chunk.offset, offset});
    }
    return places;
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
