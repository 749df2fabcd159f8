// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "stereo_slam/bags/mcap_chunks.hpp"
#include "stereo_slam/bags/mcap_records.hpp"
#include "stereo_slam/bags/message_file.hpp"

namespace stereo_slam {

/// What is where in an MCAP file.
struct McapIndex {
  std::map<std::uint16_t, McapChannel> channels;
  std::map<std::uint16_t, std::string> types;     ///< by schema
  std::optional<RecordTimes> times;               ///< nothing without messages
  std::map<std::uint16_t, std::uint64_t> counts;  ///< of messages by channel; may be empty

  /// Of a file with an index: its chunks, which say where their messages are.
  std::vector<McapChunkIndex> chunks;
  /// Of a file without one: its messages by channel. A place outside of chunks has block 0.
  std::map<std::uint16_t, std::vector<MessagePlace>> places;
  std::string warning;  ///< what such a file lacks
};

/// The index at the end of the file; nothing if it has none that finds all messages.
[[nodiscard]] std::optional<McapIndex> read_mcap_summary(const RandomFile& file);

/// The index of a file that has none, by reading all its records up to the first that is not there in full.
[[nodiscard]] McapIndex index_mcap_records(const RandomFile& file, McapChunks& chunks);

}  // namespace stereo_slam
