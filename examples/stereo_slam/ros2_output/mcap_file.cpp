// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/mcap_file.hpp"

#include <string_view>
#include <sys/stat.h>
#include <system_error>

#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/results/run_folder.hpp"
#include "stereo_slam/ros2_output/mcap_writer.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// Where a symbolic link leads; other names are as they are.
[[nodiscard]] fs::path target_of_link(const fs::path& file) {
  return fs::is_symlink(fs::symlink_status(file)) ? fs::canonical(file) : file;
}

[[nodiscard]] bool holds_bytes(const fs::path& file) {
  std::error_code absent;
  return fs::file_size(file, absent) > 0 && !absent;
}

}  // namespace

void check_mcap(const McapOptions& options, const fs::path& output) {
  const fs::path& file = options.file;
  if (fs::exists(file) && !fs::is_regular_file(file) && !fs::is_directory(file))
    fail(file, "is not an ordinary file, which --mcap needs; name another one");
  require_replaceable(file, {}, [&](std::string_view beginning) {
    const bool is_ours = McapWriter::is_of(beginning, kMcapLibrary);
    if (is_ours && !options.overwrite)
      fail(file, "holds the messages of an earlier run; name another file, or replace it with --overwrite");
    return is_ours;
  });
  require_writable_besides_results(file, output);
}

McapFile::McapFile(const McapOptions& options)
    : file_(target_of_link(options.file)),
      written_(holds_bytes(file_) ? free_name_beside(file_) : file_),
      earlier_(earlier_file(file_)),
      content_(written_) {
  content_.replace("");
  struct stat status {};
  if (::stat(written_.c_str(), &status) != 0) fail(written_, "was removed during the run");
  device_ = status.st_dev;
  number_ = status.st_ino;
}

void McapFile::require_in_place() const {
  struct stat status {};
  if (::stat(written_.c_str(), &status) != 0) fail(written_, "was moved or removed during the run");
  if (status.st_dev != device_ || status.st_ino != number_)
    fail(written_, "was replaced by another program during the run");
}

void McapFile::discard() {
  std::error_code error;
  fs::remove(written_, error);
  if (error) fail(written_, "cannot be removed ({})", error.message());
  written_ = file_;
}

void McapFile::publish() {
  if (written_ == file_) return;
  require_unchanged(file_, earlier_);
  std::error_code error;
  fs::rename(written_, file_, error);
  if (error) fail(file_, "cannot be replaced ({})", error.message());
  written_ = file_;
}

}  // namespace stereo_slam
