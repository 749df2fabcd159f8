// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

namespace stereo_slam {

/// The content of a file that is packed by zstd, as a temporary file that is removed with this object. Of one
/// that is cut off, as much as it contains. The constructor throws std::runtime_error, without the name of
/// the file, if it is damaged, or if the content takes more than nine tenths of the room for temporary files.
class UnpackedFile {
 public:
  explicit UnpackedFile(const std::filesystem::path& packed);
  ~UnpackedFile();
  UnpackedFile(const UnpackedFile&) = delete;
  UnpackedFile& operator=(const UnpackedFile&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace stereo_slam
