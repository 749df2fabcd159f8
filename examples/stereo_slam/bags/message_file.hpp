// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stereo_slam/bags/message_fields.hpp"
#include "stereo_slam/bags/topic_pair.hpp"

/// What every kind of bag is: messages on topics. The rules for topics, calibrations, stamps and pairs see
/// only this.
namespace stereo_slam {

/// Where a message is in its file.
struct MessagePlace {
  std::int64_t record_ns = 0;  ///< when it was recorded
  std::uint64_t block = 0;     ///< of what is read as a whole; its meaning is that of the file
  std::uint64_t offset = 0;    ///< in the block
};

/// The first bytes of a message, which contain the stamp of its header.
struct MessageBeginning {
  std::array<std::uint8_t, kStampedBytes> bytes{};
  std::size_t count = 0;  ///< fewer only if the message has no more
  std::string fault{};    ///< why the message cannot be read; else empty
};

/// When the first and the last message of a file were recorded.
struct RecordTimes {
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
};

/// A file of messages. Its functions throw std::runtime_error with what is wrong and what to do, without the
/// name of the file. Not thread-safe.
class MessageFile {
 public:
  MessageFile() = default;
  MessageFile(const MessageFile&) = delete;
  MessageFile& operator=(const MessageFile&) = delete;
  virtual ~MessageFile() = default;

  /// The topics with their numbers of messages. A topic that was written in several ways may come several
  /// times.
  [[nodiscard]] virtual std::vector<BagTopic> topics() = 0;

  /// Nothing if there are no messages.
  [[nodiscard]] virtual std::optional<RecordTimes> times() = 0;

  /// Where the messages of a topic are, in any order; none of a topic that the file does not have.
  [[nodiscard]] virtual std::vector<MessagePlace> places(const std::string& topic) = 0;

  /// The serialised message. Valid until the next call.
  [[nodiscard]] virtual std::span<const std::uint8_t> read(const MessagePlace& place) = 0;

  /// The beginnings of messages, by reading as little as possible: checksums are not compared.
  [[nodiscard]] virtual std::vector<MessageBeginning> read_beginnings(std::span<const MessagePlace> places);

  /// Frees what is kept of messages that were read.
  virtual void release() {}

  /// What the file lacks, as far as it has been read: one warning. Empty if it is whole.
  [[nodiscard]] virtual std::string warning() const { return {}; }
};

/// Fills the beginning of a message by `read`, which returns the message or its first bytes, or throws.
template <class Read>
void fill_beginning(MessageBeginning& beginning, const Read& read) {
  beginning = {};
  try {
    const std::span<const std::uint8_t> message = read();
    beginning.count = std::min(message.size(), beginning.bytes.size());
    std::copy_n(message.begin(), beginning.count, beginning.bytes.begin());
  } catch (const std::exception& error) {
    beginning.fault = error.what();
  }
}

/// A bag of ROS 1. Throws std::runtime_error like the functions of MessageFile; in a program built without
/// librosbag-storage-dev always.
[[nodiscard]] std::unique_ptr<MessageFile> open_ros1_bag(const std::filesystem::path& file);

/// Opens a bag by its name, also one that is packed as a whole (.zstd), for which it needs room in the folder
/// of temporary files. Messages that are packed one by one are unpacked. Throws std::runtime_error like the
/// functions of MessageFile.
[[nodiscard]] std::unique_ptr<MessageFile> open_message_file(const std::filesystem::path& file);

/// A bag of ROS 2 in a database of SQLite, by rosbag2's plugin sqlite3.
[[nodiscard]] std::unique_ptr<MessageFile> open_db3_file(const std::filesystem::path& file);

/// A bag in the format MCAP, of ROS 2 or ROS 1. Without an index at its end, or if it is cut off, all of it
/// is read once, and everything that is there in full is used. Throws std::runtime_error if it is no such
/// file.
[[nodiscard]] std::unique_ptr<MessageFile> open_mcap_file(const std::filesystem::path& file);

}  // namespace stereo_slam
