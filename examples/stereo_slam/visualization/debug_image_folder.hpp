// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/io/folder_lock.hpp"
#include "stereo_slam/tracking/associate.hpp"

namespace stereo_slam {

/// The folder with draw_debug_image() of each frame: debug_000000.png, debug_000001.png, ... The images of an
/// earlier run stay until this run has finished. No other run can write to the folder meanwhile.
class DebugImageFolder {
 public:
  /// Subfolder for the images of this run until they replace those of an earlier run.
  static constexpr const char* kUnfinished = "unfinished";

  /// Creates the folder. Throws std::runtime_error when it cannot be used, another run uses it, or it holds
  /// images of an earlier run and `overwrite` is false. `locked` is a folder that this run has already.
  DebugImageFolder(std::filesystem::path folder, bool overwrite, const std::filesystem::path& locked = {});

  /// Throws std::runtime_error when the image cannot be written.
  void write(const StereoFrame& frame, const FrameResult& result, const AssociationTrace& trace);

  /// Replaces the images of an earlier run by those that were written. Throws std::runtime_error when that
  /// fails.
  void publish();

 private:
  std::filesystem::path folder_;
  std::filesystem::path working_;  // where this run writes
  std::optional<FolderLock> lock_;
  bool begun_ = false;
};

}  // namespace stereo_slam
