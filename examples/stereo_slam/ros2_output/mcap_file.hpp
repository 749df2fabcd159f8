// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <sys/types.h>

#include "stereo_slam/io/output_file.hpp"

namespace stereo_slam {

/// The program's name in the MCAP files that it writes; its version follows.
inline constexpr std::string_view kMcapLibrary = "stereo_slam ";

/// What the command line says of --mcap.
struct McapOptions {
  std::filesystem::path file;
  bool with_images = false;  ///< small left images, --mcap-images
  bool overwrite = false;    ///< may replace the file of an earlier run
};

/// Throws std::runtime_error unless a run into the folder `output` can write the file, and replaces nothing
/// but, with --overwrite, the file of an earlier run.
void check_mcap(const McapOptions& options, const std::filesystem::path& output);

/// The file of --mcap, which grows during the run. That of an earlier run stays until this one has finished:
/// until then this one is written beside it, under another name. Functions throw std::runtime_error when the
/// file cannot be written.
class McapFile {
 public:
  /// Creates the file.
  explicit McapFile(const McapOptions& options);

  /// Appends all of the bytes, or none.
  void append(std::string_view bytes) { content_.append(bytes); }

  /// Puts what was appended on the disk.
  void sync() noexcept { content_.sync(); }

  /// Where the file is now.
  [[nodiscard]] const std::filesystem::path& path() const { return written_; }

  /// The same if that is beside the file of an earlier run.
  [[nodiscard]] std::optional<std::filesystem::path> beside() const {
    return written_ == file_ ? std::nullopt : std::optional(written_);
  }

  /// Throws if another file took its place during the run.
  void require_in_place() const;

  /// Replaces the file of the earlier run.
  void publish();

  /// Removes the file that this run wrote.
  void discard();

 private:
  std::filesystem::path file_;     // as the user named it, or where that link leads
  std::filesystem::path written_;  // where this run writes
  EarlierFile earlier_;
  AppendFile content_;
  dev_t device_ = 0;
  ino_t number_ = 0;
};

}  // namespace stereo_slam
