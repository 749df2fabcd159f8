// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/message_fields.hpp"

#include <stdexcept>

#include <fmt/format.h>

namespace stereo_slam {

static_assert(std::endian::native == std::endian::little, "the numbers in a message are little-endian");

Serialization serialization_of(std::string_view name) {
  if (name == "ros1") return Serialization::kRos1;
  throw std::invalid_argument(
      fmt::format("is serialised as '{}', which is not read; record it as ROS does", name));
}

MessageFields::MessageFields(std::span<const std::uint8_t> message, Serialization /*serialization*/)
    : message_(message) {}

std::span<const std::uint8_t> MessageFields::take(std::size_t count) {
  if (count > message_.size() - at_)
    throw std::invalid_argument("a message ends within its fields; copy the bag again, or record it again");
  const auto taken = message_.subspan(at_, count);
  at_ += count;
  return taken;
}

std::string MessageFields::text() {
  const auto characters = bytes();
  return {characters.begin(), characters.end()};
}

std::span<const std::uint8_t> MessageFields::bytes() { return take(next<std::uint32_t>()); }

std::int64_t MessageFields::stamp_ns() {
  (void)next<std::uint32_t>();  // seq
  const auto seconds = next<std::uint32_t>();
  return std::int64_t{seconds} * 1'000'000'000 + next<std::uint32_t>();
}

void MessageFields::skip_header() {
  (void)stamp_ns();
  (void)text();  // frame_id
}

}  // namespace stereo_slam
