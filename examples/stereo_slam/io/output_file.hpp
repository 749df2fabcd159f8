// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <ostream>
#include <span>
#include <string_view>

/// Files that are written so that no failure leaves half of one, and nothing else is replaced by accident.
namespace stereo_slam {

/// Writes a file completely or not at all: `write` fills a temporary file beside it, which replaces `file`
/// once it is on disk. A symbolic link stays, and the file that it leads to is replaced; devices and pipes
/// are written to. Throws std::runtime_error when that fails.
void write_file(const std::filesystem::path& file, const std::function<void(std::ostream&)>& write);

/// Whether a file has the name of one that write_file() began and did not complete: the program was killed.
[[nodiscard]] bool is_partial(const std::filesystem::path& file);

/// Throws std::runtime_error if write_file() would fail for `file`, as far as this can be checked beforehand.
void require_writable(const std::filesystem::path& file);

/// Throws std::runtime_error if writing `file` would replace one of `inputs`, or an ordinary file that the
/// program did not write: not empty, and `is_ours` returns false for its beginning.
void require_replaceable(const std::filesystem::path& file, std::span<const std::filesystem::path> inputs,
                         const std::function<bool(std::string_view)>& is_ours);

/// A file that grows by whole pieces of text while a program runs. What was appended survives the end of the
/// program, however it ends, and after sync() that of the machine. All functions throw std::runtime_error
/// when the file cannot be written.
class AppendFile {
 public:
  explicit AppendFile(std::filesystem::path file) : file_(std::move(file)) {}
  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  /// Replaces an earlier file by `text` in one step, or begins the file.
  void replace(std::string_view text);

  /// Appends in one system call; what does not fit is not appended at all. Needs replace() before.
  void append(std::string_view text);

  /// Returns once everything appended is on the disk. May run beside append(), but not beside replace(). A
  /// failure is an error of the next append().
  void sync() noexcept;

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::size_t size_ = 0;
  std::atomic<int> sync_error_ = 0;
};

}  // namespace stereo_slam
