// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace stereo_slam {

/// A file of any size whose parts are read by their places. Its functions throw std::runtime_error, without
/// the name of the file, when it cannot be read.
class RandomFile {
 public:
  explicit RandomFile(const std::filesystem::path& file);
  ~RandomFile();
  RandomFile(const RandomFile&) = delete;
  RandomFile& operator=(const RandomFile&) = delete;

  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// Fills all of `bytes` from the place `offset`.
  void read(std::uint64_t offset, std::span<std::uint8_t> bytes) const;

 private:
  int descriptor_;
  std::uint64_t size_ = 0;
};

}  // namespace stereo_slam
