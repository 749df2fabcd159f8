// SPDX-License-Identifier: MIT
#include "dataset/image_file.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

namespace stereo_slam {
namespace {

using Bytes = std::vector<std::uint8_t>;

[[noreturn]] void fail(const std::filesystem::path& file, std::string_view what) {
  throw std::runtime_error(fmt::format("{}: {}", file.string(), what));
}

Bytes read_bytes(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) fail(file, "missing; restore the image or cut the sequence before it");
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) fail(file, "cannot be read; check its permissions");
  Bytes bytes(std::filesystem::file_size(file));
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         bytes[3];
}

/// Tables of crc32: entry [k][byte] is the checksum of the byte followed by k zeros.
using CrcTables = std::array<std::array<std::uint32_t, 256>, 4>;

constexpr CrcTables make_crc_tables() {
  CrcTables tables{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0U ? 0xEDB88320U ^ (c >> 1) : c >> 1;
    tables[0][i] = c;
  }
  for (std::size_t k = 1; k < tables.size(); ++k) {
    for (std::size_t i = 0; i < 256; ++i) {
      const std::uint32_t c = tables[k - 1][i];
      tables[k][i] = (c >> 8) ^ tables[0][c & 0xFFU];
    }
  }
  return tables;
}

/// CRC-32 of ISO 3309 (PNG specification, annex D), four bytes at a time.
std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  static constexpr CrcTables kTables = make_crc_tables();
  std::uint32_t c = 0xFFFFFFFFU;
  for (; bytes.size() >= 4; bytes = bytes.subspan(4)) {
    c ^= std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8 | std::uint32_t{bytes[2]} << 16 |
         std::uint32_t{bytes[3]} << 24;
    c = kTables[3][c & 0xFFU] ^ kTables[2][c >> 8 & 0xFFU] ^ kTables[1][c >> 16 & 0xFFU] ^
        kTables[0][c >> 24];
  }
  for (const std::uint8_t byte : bytes) c = kTables[0][(c ^ byte) & 0xFFU] ^ (c >> 8);
  return ~c;
}

/// Walks the chunks: length (4), type (4), data, checksum of type and data (4).
PngHeader check_chunks(const std::filesystem::path& file, std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 8> kSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  constexpr std::size_t kOverhead = 12;
  constexpr std::size_t kHeaderSize = 13;
  constexpr std::string_view kTruncated = "the PNG is truncated; copy or download it again";
  if (bytes.empty()) fail(file, "the file is empty; copy or download it again");
  if (bytes.size() < kSignature.size()) fail(file, kTruncated);
  if (!std::equal(kSignature.begin(), kSignature.end(), bytes.begin()))
    fail(file, "not a PNG image; convert it");

  PngHeader header;
  auto rest = bytes.subspan(kSignature.size());
  while (true) {
    if (rest.size() < kOverhead) fail(file, kTruncated);
    const std::size_t length = big_endian(rest);
    if (length > rest.size() - kOverhead) fail(file, kTruncated);
    const std::string_view type(reinterpret_cast<const char*>(rest.data()) + 4, 4);
    const auto data = rest.subspan(8, length);
    if (crc32(rest.subspan(4, length + 4)) != big_endian(rest.subspan(8 + length))) {
      fail(file, "the PNG is damaged (checksum); copy or download it again");
    }
    if (type == "IHDR" && length == kHeaderSize) {
      constexpr std::uint8_t kColourFlag = 2;
      header = {static_cast<int>(big_endian(data)), static_cast<int>(big_endian(data.subspan(4))),
                (data[9] & kColourFlag) != 0};
    }
    if (type == "IEND") return header;
    rest = rest.subspan(kOverhead + length);
  }
}

}  // namespace

PngHeader check_png(const std::filesystem::path& file) { return check_chunks(file, read_bytes(file)); }

cv::Mat load_gray_png(const std::filesystem::path& file) {
  const Bytes bytes = read_bytes(file);
  check_chunks(file, bytes);
  cv::Mat image = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  if (image.empty()) fail(file, "the PNG cannot be decoded; convert or download it again");
  return image;
}

}  // namespace stereo_slam
