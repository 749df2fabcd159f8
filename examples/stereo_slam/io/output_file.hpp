// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <ostream>
#include <span>
#include <string_view>

/// Writes files so that a failure never leaves an incomplete file, and no other file is replaced by accident.
namespace stereo_slam {

/// Writes a file completely or not at all: `write` fills a temporary file beside it, which replaces `file`
/// once it is on disk. If `file` is a symbolic link, its target is replaced. Devices, pipes and descriptors
/// such as /dev/stdout are written in place. Throws std::runtime_error when writing fails.
void write_file(const std::filesystem::path& file, const std::function<void(std::ostream&)>& write);

/// Whether the name is that of a temporary file of write_file(), which is left when the program is killed.
[[nodiscard]] bool is_partial(const std::filesystem::path& file);

/// Throws std::runtime_error if write_file() would fail for `file`, as far as this can be checked beforehand.
void require_writable(const std::filesystem::path& file);

/// Throws std::runtime_error if writing `file` would replace one of `inputs`, a read-only file, or a regular
/// file that is not empty and that the program did not write: `is_ours` returns false for its first 512
/// bytes.
void require_replaceable(const std::filesystem::path& file, std::span<const std::filesystem::path> inputs,
                         const std::function<bool(std::string_view)>& is_ours);

/// When the file was written that write_file() would replace; nothing if there is none.
using EarlierFile = std::optional<std::filesystem::file_time_type>;
[[nodiscard]] EarlierFile earlier_file(const std::filesystem::path& file);

/// Throws std::runtime_error if `file` was written since it was `earlier`.
void require_unchanged(const std::filesystem::path& file, const EarlierFile& earlier);

/// A file beside `file` that does not exist: street-2.map, street-3.map ...
[[nodiscard]] std::filesystem::path free_name_beside(const std::filesystem::path& file);

/// Calls `check`. If that throws, `write` gets a free name beside `file`, and std::runtime_error says where
/// `what` was written: "...; the map is in street-2.map".
void check_or_write_beside(const std::filesystem::path& file, std::string_view what,
                           const std::function<void()>& check,
                           const std::function<void(const std::filesystem::path&)>& write);

/// A file to which whole pieces of text are appended while a program runs. Appended text survives when the
/// program is killed; after sync() also when the machine fails. Functions except sync() throw
/// std::runtime_error when the file cannot be written.
class AppendFile {
 public:
  explicit AppendFile(std::filesystem::path file) : file_(std::move(file)) {}
  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  /// Creates the file with `text`, or replaces an earlier file by it in one step.
  void replace(std::string_view text);

  /// Appends `text`, normally in one system call. On an error, such as a full disk, nothing of it remains.
  /// Call replace() first.
  void append(std::string_view text);

  /// Returns once everything appended is on the disk. May run concurrently with append(), but not with
  /// replace(). If it fails, the next append() throws.
  void sync() noexcept;

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::size_t size_ = 0;
  std::atomic<int> sync_error_ = 0;
};

}  // namespace stereo_slam
