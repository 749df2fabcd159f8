// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/message_file.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "stereo_slam/bags/unpack.hpp"
#include "stereo_slam/bags/unpacked_file.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// A bag whose messages may be packed by zstd, each one by itself: rosbag2's compression mode `message`. No
/// message of ROS begins as zstd does, so that it need not be known.
class UnpackedMessages : public MessageFile {
 public:
  explicit UnpackedMessages(std::unique_ptr<MessageFile> file) : file_(std::move(file)) {}

  [[nodiscard]] std::vector<BagTopic> topics() override { return file_->topics(); }
  [[nodiscard]] std::optional<RecordTimes> times() override { return file_->times(); }
  [[nodiscard]] std::vector<MessagePlace> places(const std::string& topic) override {
    return file_->places(topic);
  }
  [[nodiscard]] std::string warning() const override { return file_->warning(); }
  void release() override {
    unpacked_ = {};
    file_->release();
  }

  [[nodiscard]] std::span<const std::uint8_t> read(const MessagePlace& place) override {
    const auto bytes = file_->read(place);
    if (!begins_as_zstd(bytes)) return bytes;
    unpack(Compression::kZstd, bytes, kMostUnpacked_bytes, unpacked_);
    if (unpacked_.size() == kMostUnpacked_bytes)
      throw std::runtime_error("the message unpacks to more than 1 GB, which is not read");
    return unpacked_;
  }

  [[nodiscard]] std::vector<MessageBeginning> read_beginnings(std::span<const MessagePlace> places) override {
    auto beginnings = file_->read_beginnings(places);
    for (std::size_t i = 0; i < places.size(); ++i) {
      auto& beginning = beginnings[i];
      if (!begins_as_zstd(std::span(beginning.bytes).first(beginning.count))) continue;
      fill_beginning(beginning, [&] {
        unpack(Compression::kZstd, file_->read(places[i]), kStampedBytes, unpacked_);
        return std::span<const std::uint8_t>(unpacked_);
      });
    }
    return beginnings;
  }

 private:
  std::unique_ptr<MessageFile> file_;
  std::vector<std::uint8_t> unpacked_;
};

/// Opens a file by the name of a bag, which may be that of another file.
[[nodiscard]] std::unique_ptr<MessageFile> open_by_name(const fs::path& file, const fs::path& name) {
  const std::string extension = lower_case(name.extension().string());
  if (extension == ".mcap") return std::make_unique<UnpackedMessages>(open_mcap_file(file));
  if (extension == ".db3") return std::make_unique<UnpackedMessages>(open_db3_file(file));
  return open_ros1_bag(file);
}

}  // namespace

std::vector<MessageBeginning> MessageFile::read_beginnings(std::span<const MessagePlace> places) {
  std::vector<std::size_t> order(places.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  // In order of recording, so that no part of the file is unpacked twice.
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return places[i].record_ns; });
  std::vector<MessageBeginning> beginnings(places.size());
  for (const std::size_t i : order) fill_beginning(beginnings[i], [&] { return read(places[i]); });
  return beginnings;
}

std::unique_ptr<MessageFile> open_message_file(const fs::path& file) {
  if (lower_case(file.extension().string()) != ".zstd") return open_by_name(file, file);
  const UnpackedFile unpacked(file);  // it can be removed when it is open
  return open_by_name(unpacked.path(), file.stem());
}

}  // namespace stereo_slam
