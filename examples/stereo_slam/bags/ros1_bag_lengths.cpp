// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/ros1_bag_lengths.hpp"

#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace stereo_slam {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint32_t kLongestHeader_bytes = 1U << 20;

static_assert(std::endian::native == std::endian::little, "the lengths in a bag are little-endian");

/// A bag, read record by record: the length of a header, the header, the length of the data, the data.
class Records {
 public:
  explicit Records(const std::filesystem::path& file)
      : stream_(file, std::ios::binary), left_bytes_(std::filesystem::file_size(file)) {}

  [[nodiscard]] bool at_end() const { return left_bytes_ == 0; }

  [[nodiscard]] std::string take(std::uint64_t bytes) {
    require_left(bytes);
    std::string text(bytes, '\0');
    stream_.read(text.data(), static_cast<std::streamsize>(bytes));
    if (!stream_) throw std::runtime_error("the bag cannot be read");
    return text;
  }

  [[nodiscard]] std::uint32_t take_length() {
    std::uint32_t length = 0;
    std::memcpy(&length, take(sizeof length).data(), sizeof length);
    return length;
  }

  void skip(std::uint64_t bytes) {
    require_left(bytes);
    stream_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur);
  }

 private:
  void require_left(std::uint64_t bytes) {
    if (bytes > left_bytes_) throw std::runtime_error("a record is longer than the rest of the file");
    left_bytes_ -= bytes;
  }

  std::ifstream stream_;
  std::uint64_t left_bytes_;
};

/// The fields NAME=VALUE of a header, each after its length.
[[nodiscard]] std::map<std::string, std::string> fields_of(const std::string& header) {
  std::map<std::string, std::string> fields;
  for (std::size_t at = 0; at + sizeof(std::uint32_t) <= header.size();) {
    std::uint32_t length = 0;
    std::memcpy(&length, header.data() + at, sizeof length);
    at += sizeof length;
    if (length > header.size() - at) throw std::runtime_error("a field is longer than its header");
    const std::string field = header.substr(at, length);
    const std::size_t equals = field.find('=');
    if (equals == std::string::npos) throw std::runtime_error("a field of a header has no name");
    fields[field.substr(0, equals)] = field.substr(equals + 1);
    at += length;
  }
  return fields;
}

template <class Number>
[[nodiscard]] Number number_of(const std::map<std::string, std::string>& fields, const std::string& name) {
  const auto field = fields.find(name);
  Number number = 0;
  if (field == fields.end() || field->second.size() != sizeof number)
    throw std::runtime_error(fmt::format("a header has no valid {}", name));
  std::memcpy(&number, field->second.data(), sizeof number);
  return number;
}

}  // namespace

void require_possible_lengths(const std::filesystem::path& file) {
  constexpr std::uint8_t kFileHeader = 3;
  constexpr std::uint8_t kChunk = 5;
  constexpr std::uint32_t kLargestChunk_bytes = 1U << 30;
  Records records(file);
  if (std::filesystem::file_size(file) < kMagic.size() || records.take(kMagic.size()) != kMagic) return;
  while (!records.at_end()) {
    const std::uint32_t header_bytes = records.take_length();
    if (header_bytes > kLongestHeader_bytes) throw std::runtime_error("a header is longer than 1 MB");
    const auto fields = fields_of(records.take(header_bytes));
    const auto op = number_of<std::uint8_t>(fields, "op");
    if (op == kFileHeader && number_of<std::uint64_t>(fields, "index_pos") == 0) return;
    if (op == kChunk && number_of<std::uint32_t>(fields, "size") > kLargestChunk_bytes)
      throw std::runtime_error("a chunk unpacks to more than 1 GB");
    records.skip(records.take_length());
  }
}

}  // namespace stereo_slam
