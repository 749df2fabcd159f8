// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stereo_slam {

/// A topic of an MCAP file.
struct McapTopic {
  std::string name;
  std::string type;    ///< nav_msgs/msg/Odometry, say
  std::string schema;  ///< the definition of the type, see ros2_definition()
  std::string qos{};   ///< of its publisher, as rosbag2 writes it; may be empty
};

/// Writes messages of ROS 2 as an MCAP file (https://mcap.dev/spec) that grows chunk by chunk: a chunk is
/// compressed by zstd and followed by its message indexes. end() adds the summary, by which readers seek. A
/// file without it, of a killed program, is complete up to its last chunk.
class McapWriter {
 public:
  /// Appends bytes to the file, all or none. What it throws is passed on; then the writer is of no more use.
  using Append = std::function<void(std::string_view)>;

  /// How a file begins, which `append` gets first. `library` is the program that writes it.
  McapWriter(Append append, std::string_view library);

  /// Whether the first 512 bytes of a file are those of one that was written with this `library`, of any
  /// version.
  [[nodiscard]] static bool is_of(std::string_view beginning, std::string_view library);

  /// Returns the channel of the topic, for add().
  [[nodiscard]] std::uint16_t add_topic(const McapTopic& topic);

  /// Adds a message in CDR to the chunk. `log_ns` is what readers order messages by; not negative.
  void add(std::uint16_t channel, std::int64_t log_ns, std::span<const std::uint8_t> message);

  /// Bytes of the chunk so far, not compressed.
  [[nodiscard]] std::size_t chunk_bytes() const { return records_.size(); }

  /// Ends the chunk and appends it to the file.
  void end_chunk();

  /// Ends the file. Nothing can be added any more.
  void end();

 private:
  struct Times {
    std::uint64_t first_ns = 0;
    std::uint64_t last_ns = 0;
    std::uint64_t messages = 0;

    void add(std::uint64_t ns);
  };

  void append(std::string_view bytes);
  [[nodiscard]] std::string statistics() const;
  [[nodiscard]] std::string summary() const;

  Append append_;
  std::uint64_t position_ = 0;  // of the end of the file
  std::uint32_t checksum_ = 0;  // of the file so far
  std::uint16_t channels_ = 0;
  std::string schemas_;          // records, for the summary
  std::string channel_records_;  // the same
  std::string chunk_indexes_;    // the same
  std::uint32_t chunks_ = 0;
  Times times_;
  std::map<std::uint16_t, std::uint64_t> counts_;  // of messages by channel

  // The present chunk.
  std::string records_;
  Times chunk_times_;
  std::map<std::uint16_t, std::string> indexes_;  // entries of the message index by channel
  std::uint32_t sequence_ = 0;
};

}  // namespace stereo_slam
