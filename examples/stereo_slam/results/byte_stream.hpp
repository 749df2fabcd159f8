// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

/// Conversion of numbers of fixed width to and from bytes, least significant byte first, on any host.
/// Floating-point numbers are IEEE 754.
namespace stereo_slam {

template <class T>
concept PlainNumber = std::integral<T> || std::floating_point<T>;

/// Appends to a buffer.
class ByteWriter {
 public:
  template <PlainNumber Number>
  void put(Number value) {
    auto bytes = std::bit_cast<std::array<char, sizeof(Number)>>(value);
    if constexpr (std::endian::native == std::endian::big) std::ranges::reverse(bytes);
    bytes_.append(bytes.data(), bytes.size());
  }
  void put_bytes(std::string_view bytes) { bytes_.append(bytes); }

  [[nodiscard]] std::string_view bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Reads from the front of bytes that the caller keeps alive. Throws std::out_of_range beyond their end.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  /// Number of bytes not read yet.
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size(); }

  template <PlainNumber Number>
  [[nodiscard]] Number get() {
    std::array<char, sizeof(Number)> bytes;
    std::memcpy(bytes.data(), get_bytes(sizeof(Number)).data(), sizeof(Number));
    if constexpr (std::endian::native == std::endian::big) std::ranges::reverse(bytes);
    return std::bit_cast<Number>(bytes);
  }

  [[nodiscard]] std::string_view get_bytes(std::size_t size) {
    if (size > left()) {
      throw std::out_of_range(fmt::format("{} bytes where {} are left", size, left()));
    }
    const auto front = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return front;
  }

  /// The number of elements that follow, each of at least `min_bytes`. Throws std::out_of_range if they do
  /// not fit into the remaining bytes.
  [[nodiscard]] std::size_t get_count(std::size_t min_bytes) {
    const auto count = get<std::uint64_t>();
    if (count > left() / min_bytes) {
      throw std::out_of_range(
          fmt::format("{} elements of {} bytes or more where {} bytes are left", count, min_bytes, left()));
    }
    return static_cast<std::size_t>(count);
  }

 private:
  std::string_view bytes_;
};

}  // namespace stereo_slam
