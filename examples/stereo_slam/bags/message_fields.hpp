// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace stereo_slam {

/// How the fields of messages become bytes.
enum class Serialization {
  kRos1,  ///< little-endian, one after another
  kCdr    ///< OMG's Common Data Representation, version 1, as ROS 2 uses it: in either byte order, aligned
};

/// By the name that a bag has for it. Throws std::invalid_argument for one that is not read.
[[nodiscard]] Serialization serialization_of(std::string_view name);

/// The fields of a serialised message, one after another. Every function throws std::invalid_argument if the
/// message ends within its fields.
class MessageFields {
 public:
  /// Throws std::invalid_argument too if CDR does not begin with the header of one of its byte orders.
  MessageFields(std::span<const std::uint8_t> message, Serialization serialization);

  template <class Number>
  [[nodiscard]] Number next() {
    std::array<std::uint8_t, sizeof(Number)> bytes;
    align(bytes.size());
    std::ranges::copy(take(bytes.size()), bytes.begin());
    if (big_endian_) std::ranges::reverse(bytes);
    return std::bit_cast<Number>(bytes);
  }

  [[nodiscard]] std::string text();

  /// An array of bytes, which belong to the message.
  [[nodiscard]] std::span<const std::uint8_t> bytes();

  /// So many bytes, which belong to the message.
  [[nodiscard]] std::span<const std::uint8_t> take(std::uint64_t count);

  [[nodiscard]] std::span<const std::uint8_t> rest() { return take(message_.size() - at_); }

  [[nodiscard]] bool at_end() const { return at_ == message_.size(); }

  /// Fills numbers of a fixed count.
  template <class Numbers>
  void fill(Numbers& numbers) {
    for (auto& number : numbers) number = next<typename Numbers::value_type>();
  }

  /// The beginning of std_msgs/Header, which ends with its stamp.
  [[nodiscard]] std::int64_t stamp_ns();

  void skip_header();

 private:
  /// A number of CDR begins at a multiple of its size.
  void align(std::size_t size);

  std::span<const std::uint8_t> message_;  ///< without CDR's header, where its alignment begins
  bool is_cdr_ = false;
  bool big_endian_ = false;
  std::size_t at_ = 0;
};

/// So many bytes of a message contain the stamp of its header: after seq in ROS 1, after CDR's own header in
/// ROS 2.
constexpr std::size_t kStampedBytes = 12;

}  // namespace stereo_slam
