// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// Which images of a topic have usable stamps.
namespace stereo_slam {

/// The times of a message.
struct MessageTime {
  std::int64_t header_ns = 0;  ///< of its header; 0 if the driver set none
  std::int64_t record_ns = 0;  ///< when it was recorded
};

/// The images of a topic in order, without those that have no time of their own.
struct TimedImages {
  std::vector<std::size_t> index;         ///< of the messages that are used
  std::vector<std::int64_t> stamps_ns;    ///< of these; they increase
  std::size_t repeated = 0;               ///< messages with the stamp of the one before
  std::vector<std::size_t> out_of_order;  ///< messages whose stamp does not fit between those around it
};

/// The images by the stamps in their headers. One of a hundred, or a single one, may be out of order or far
/// from its time. Throws std::invalid_argument, with what to do, if the stamps are zero or more are out of
/// order.
[[nodiscard]] TimedImages by_header_stamps(const std::vector<MessageTime>& times);

/// The images by the times at which they were recorded.
[[nodiscard]] TimedImages by_record_times(const std::vector<MessageTime>& times);

}  // namespace stereo_slam
