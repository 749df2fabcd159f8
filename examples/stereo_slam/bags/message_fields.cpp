// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/message_fields.hpp"

#include <stdexcept>

#include <fmt/format.h>

namespace stereo_slam {

static_assert(std::endian::native == std::endian::little, "the numbers in a message are little-endian");

Serialization serialization_of(std::string_view name) {
  if (name == "ros1") return Serialization::kRos1;
  if (name == "cdr") return Serialization::kCdr;
  throw std::invalid_argument(fmt::format(
      "is serialised as '{}', which is not read; record messages of ROS, as 'cdr' or 'ros1'", name));
}

MessageFields::MessageFields(std::span<const std::uint8_t> message, Serialization serialization)
    : message_(message), is_cdr_(serialization == Serialization::kCdr) {
  if (!is_cdr_) return;
  constexpr std::size_t kHeaderBytes = 4;  // representation, and options without meaning here
  const auto header = take(kHeaderBytes);
  if (header[0] != 0 || header[1] > 1) {
    throw std::invalid_argument(fmt::format(
        "a message has the representation {:02x}{:02x} of CDR, which is not read; record it as plain CDR",
        header[0], header[1]));
  }
  big_endian_ = header[1] == 0;
  message_ = message_.subspan(kHeaderBytes);
  at_ = 0;
}

std::span<const std::uint8_t> MessageFields::take(std::uint64_t count) {
  if (count > message_.size() - at_)
    throw std::invalid_argument("a message ends within its fields; copy the bag again, or record it again");
  const auto taken = message_.subspan(at_, count);
  at_ += count;
  return taken;
}

void MessageFields::align(std::size_t size) {
  if (is_cdr_) (void)take((size - at_ % size) % size);
}

std::string MessageFields::text() {
  auto characters = bytes();
  if (is_cdr_ && !characters.empty()) characters = characters.first(characters.size() - 1);  // a zero ends it
  return {characters.begin(), characters.end()};
}

std::span<const std::uint8_t> MessageFields::bytes() { return take(next<std::uint32_t>()); }

std::int64_t MessageFields::stamp_ns() {
  if (!is_cdr_) (void)next<std::uint32_t>();  // seq
  const std::int64_t seconds = is_cdr_ ? std::int64_t{next<std::int32_t>()} : next<std::uint32_t>();
  return seconds * 1'000'000'000 + next<std::uint32_t>();
}

void MessageFields::skip_header() {
  (void)stamp_ns();
  (void)text();  // frame_id
}

}  // namespace stereo_slam
