// SPDX-License-Identifier: MIT
#include "stereo_slam/io/folder_lock.hpp"

#include <cerrno>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {

FolderLock::FolderLock(std::filesystem::path folder, std::string_view option)
    : folder_(std::move(folder)), descriptor_(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ >= 0 && ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(descriptor_);
    fail(folder_, "another run is writing to it; wait for its end, or choose another {}", option);
  }
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void FolderLock::require_in_place() const {
  struct stat opened = {};
  struct stat named = {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &opened) != 0) return;
  const bool there = ::stat(folder_.c_str(), &named) == 0;
  if (there && opened.st_dev == named.st_dev && opened.st_ino == named.st_ino) return;
  if (opened.st_nlink == 0) fail(folder_, "was removed during the run, with the frames in it");
  fail(folder_, "was moved during the run, which ends here; the frames before are in the moved folder");
}

}  // namespace stereo_slam
