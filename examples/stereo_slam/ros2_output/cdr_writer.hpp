// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace stereo_slam {

/// Writes the fields of a message of ROS 2 as CDR (OMG's Common Data Representation, version 1),
/// little-endian: a number begins at a multiple of its size. MessageFields reads it.
class CdrWriter {
 public:
  template <class Number>
  CdrWriter& put(Number number) requires std::is_arithmetic_v<Number> {
    static_assert(std::endian::native == std::endian::little);
    const std::size_t size = sizeof number;
    const std::size_t at = bytes_.size() - kHeader_bytes;
    bytes_.resize(bytes_.size() + (size - at % size) % size + size);
    std::memcpy(bytes_.data() + bytes_.size() - size, &number, size);
    return *this;
  }

  CdrWriter& put(std::string_view text) {
    put(length(text.size() + 1));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
    return *this;
  }
  CdrWriter& put(const char* text) { return put(std::string_view(text)); }

  /// A sequence of bytes.
  CdrWriter& put(std::span<const std::uint8_t> bytes) {
    put(length(bytes.size()));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }

  /// What stands before the elements of a sequence.
  CdrWriter& put_count(std::size_t elements) { return put(length(elements)); }

  /// std_msgs/Header. Throws std::invalid_argument if the stamp is not one of ROS 2: from 0 to 2^31 - 1 s.
  CdrWriter& put_header(std::int64_t stamp_ns, std::string_view frame) {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    if (stamp_ns < 0 || stamp_ns / kSecond_ns > std::numeric_limits<std::int32_t>::max()) {
      throw std::invalid_argument(
          fmt::format("the stamp {:.9g} s is none of ROS 2, which has 32 bits for the seconds; give the "
                      "images other times",
                      1e-9 * static_cast<double>(stamp_ns)));
    }
    put(static_cast<std::int32_t>(stamp_ns / kSecond_ns));
    put(static_cast<std::uint32_t>(stamp_ns % kSecond_ns));
    return put(frame);
  }

  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  static constexpr std::size_t kHeader_bytes = 4;  ///< representation 0001 (little-endian), options 0000

  [[nodiscard]] static std::uint32_t length(std::size_t count) {
    if (count > std::numeric_limits<std::uint32_t>::max())
      throw std::length_error("a message of ROS 2 has fewer than 2^32 elements");
    return static_cast<std::uint32_t>(count);
  }

  std::vector<std::uint8_t> bytes_{0, 1, 0, 0};
};

}  // namespace stereo_slam
