// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string_view>

namespace stereo_slam {

/// A folder that no other run can use while the object exists. The lock is on the folder itself: it leaves no
/// file, and ends with the process.
class FolderLock {
 public:
  /// Throws std::runtime_error if another run has the folder, which must exist; `option` is the option that
  /// names it. File systems without locks are used without one.
  FolderLock(std::filesystem::path folder, std::string_view option);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  /// Throws std::runtime_error if the folder was moved or removed since: whatever has its name now belongs to
  /// someone else.
  void require_in_place() const;

 private:
  std::filesystem::path folder_;
  int descriptor_;
};

}  // namespace stereo_slam
