// SPDX-License-Identifier: MIT
#include "stereo_slam/io/output_file.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <streambuf>
#include <string>
#include <string_view>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail_to_write(const fs::path& file, int error) {
  fail(file, "cannot be written ({}); check permissions and free space",
       std::generic_category().message(error));
}

/// Writes all bytes; returns zero or an errno.
[[nodiscard]] int write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return written < 0 ? errno : ENOSPC;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

/// A file descriptor, closed with the object.
class FileDescriptor {
 public:
  explicit FileDescriptor(int descriptor) : descriptor_(descriptor) {}
  ~FileDescriptor() { (void)close(); }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;

  [[nodiscard]] int get() const { return descriptor_; }
  [[nodiscard]] int release() { return std::exchange(descriptor_, -1); }

  /// Returns zero or an errno.
  [[nodiscard]] int close() {
    return descriptor_ >= 0 && ::close(std::exchange(descriptor_, -1)) != 0 ? errno : 0;
  }

 private:
  int descriptor_;
};

/// Buffers what a stream writes to a descriptor, and keeps the first error.
class FileDescriptorBuffer : public std::streambuf {
 public:
  explicit FileDescriptorBuffer(int descriptor) : descriptor_(descriptor) {
    setp(buffer_.data(), buffer_.data() + buffer_.size());
  }

  [[nodiscard]] int error() const { return error_; }

 protected:
  int_type overflow(int_type character) override {
    if (sync() != 0) return traits_type::eof();
    if (!traits_type::eq_int_type(character, traits_type::eof())) sputc(traits_type::to_char_type(character));
    return traits_type::not_eof(character);
  }

  int sync() override {
    if (error_ == 0) error_ = write_all(descriptor_, {pbase(), static_cast<std::size_t>(pptr() - pbase())});
    setp(buffer_.data(), buffer_.data() + buffer_.size());
    return error_ == 0 ? 0 : -1;
  }

 private:
  int descriptor_;
  int error_ = 0;
  std::array<char, 1 << 16> buffer_;
};

/// Lets `write` fill an open file; returns zero or an errno.
[[nodiscard]] int fill(int descriptor, const std::function<void(std::ostream&)>& write) {
  FileDescriptorBuffer buffer(descriptor);
  std::ostream stream(&buffer);
  write(stream);
  stream.flush();
  return buffer.error() != 0 ? buffer.error() : stream ? 0 : EIO;
}

/// Where a file is to be written.
struct Target {
  fs::path file;
  bool in_place = false;  ///< a device or a pipe
};

/// Whether the name is that of a descriptor of a process. Other names in /dev may be files, as in /dev/shm.
[[nodiscard]] bool is_descriptor(std::string_view name) {
  if (name == "/dev/stdin" || name == "/dev/stdout" || name == "/dev/stderr") return true;
  return name.starts_with("/dev/fd/") ||
         (name.starts_with("/proc/") && name.find("/fd/") != std::string_view::npos);
}

/// Follows symbolic links. A descriptor such as /dev/fd/63 or /dev/stdout is written to in place, even if it
/// is a regular file.
[[nodiscard]] Target target_of(const fs::path& file) {
  const auto refuse = [&](const char* why) { fail(file, why); };
  if (file.empty()) throw std::runtime_error("the name of the file to write is empty; name a file");
  std::error_code error;
  const auto status = fs::status(file, error);
  if (fs::is_directory(status)) refuse("is a folder; name a file");
  if (fs::is_block_file(status) || fs::is_socket(status)) refuse("is not an ordinary file; name another one");
  if (fs::is_character_file(status) || fs::is_fifo(status)) return {.file = file, .in_place = true};
  if (is_descriptor(file.lexically_normal().string())) return {.file = file, .in_place = true};
  if (!fs::is_symlink(fs::symlink_status(file, error))) return {.file = file};
  if (!fs::exists(status)) refuse("is a symbolic link that leads nowhere; name another file");
  return {.file = fs::canonical(file)};
}

void write_in_place(const fs::path& file, const std::function<void(std::ostream&)>& write) {
  // The file may be standard output, where the text must follow what was printed before.
  std::cout.flush();
  std::fflush(stdout);
  // Without O_NONBLOCK a pipe that nobody reads would block for ever.
  FileDescriptor out(::open(file.c_str(), O_WRONLY | O_APPEND | O_NOCTTY | O_CLOEXEC | O_NONBLOCK));
  if (out.get() < 0) fail_to_write(file, errno);
  ::fcntl(out.get(), F_SETFL, ::fcntl(out.get(), F_GETFL) & ~O_NONBLOCK);
  int error = fill(out.get(), write);
  if (error == 0) error = out.close();
  if (error != 0) fail_to_write(file, error);
}

constexpr std::string_view kPartial = ".partial-";  // part of the name of a temporary file

/// A new file beside `file`, which is removed again unless it was renamed.
class Partial {
 public:
  explicit Partial(const fs::path& file) : file_(file) {
    constexpr int kAttempts = 100;
    for (int i = 0; i < kAttempts && descriptor_ < 0; ++i) {
      path_ = fmt::format("{}{}{}-{}", file.string(), kPartial, ::getpid(), i);
      descriptor_ = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (descriptor_ < 0 && errno != EEXIST) fail_to_write(file, errno);
    }
    if (descriptor_ < 0) fail_to_write(file, EEXIST);
  }
  ~Partial() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  Partial(const Partial&) = delete;
  Partial& operator=(const Partial&) = delete;

  [[nodiscard]] int descriptor() const { return descriptor_; }

  /// Gives the file its name; returns its descriptor.
  [[nodiscard]] int put_in_place() {
    if (::fdatasync(descriptor_) != 0 && errno != EINVAL) fail_to_write(file_, errno);
    if (::rename(path_.c_str(), file_.c_str()) != 0) fail_to_write(file_, errno);
    path_.clear();
    return std::exchange(descriptor_, -1);
  }

 private:
  fs::path file_;
  std::string path_;
  int descriptor_ = -1;
};

}  // namespace

void write_file(const fs::path& file, const std::function<void(std::ostream&)>& write) {
  const Target target = target_of(file);
  if (target.in_place) return write_in_place(target.file, write);
  Partial partial(target.file);
  if (const int error = fill(partial.descriptor(), write)) fail_to_write(file, error);
  FileDescriptor out(partial.put_in_place());
  if (const int error = out.close()) fail_to_write(file, error);
}

bool is_partial(const fs::path& file) { return file.filename().string().find(kPartial) != std::string::npos; }

void require_writable(const fs::path& file) {
  const Target target = target_of(file);
  if (!target.in_place) Partial{target.file};
}

void require_replaceable(const fs::path& file, std::span<const fs::path> inputs,
                         const std::function<bool(std::string_view)>& is_ours) {
  std::error_code error;
  for (const auto& input : inputs) {
    if (!fs::equivalent(file, input, error) || error) continue;
    fail(file, "is to be read, too ({}); name another file to write", input.string());
  }
  const fs::file_status status = fs::status(file, error);
  if (!fs::is_regular_file(status) || is_descriptor(file.lexically_normal().string())) return;
  constexpr fs::perms kWrite = fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write;
  // The system lets root write any file, and anyone replace a file whose folder is writable.
  if ((status.permissions() & kWrite) == fs::perms::none || ::access(file.c_str(), W_OK) != 0) {
    fail(file, "is read-only; name another file to write, or allow that with chmod u+w");
  }
  if (fs::file_size(file, error) == 0) return;
  std::ifstream stream(file, std::ios::binary);
  std::string beginning(512, '\0');
  stream.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  beginning.resize(static_cast<std::size_t>(stream.gcount()));
  if (is_ours(beginning)) return;
  fail(file, "exists, and is not a file of this kind; name another file to write, or remove it");
}

EarlierFile earlier_file(const fs::path& file) {
  const Target target = target_of(file);
  std::error_code absent;
  const auto written = fs::last_write_time(target.file, absent);
  return absent || target.in_place ? std::nullopt : EarlierFile(written);
}

void require_unchanged(const fs::path& file, const EarlierFile& earlier) {
  const EarlierFile now = earlier_file(file);
  if (now && now != earlier) fail(file, "was written by another program during the run");
}

fs::path free_name_beside(const fs::path& file) {
  for (int n = 2;; ++n) {
    fs::path name = file;
    name.replace_filename(fmt::format("{}-{}{}", file.stem().string(), n, file.extension().string()));
    if (!fs::exists(fs::symlink_status(name))) return name;
  }
}

void check_or_write_beside(const fs::path& file, std::string_view what, const std::function<void()>& check,
                           const std::function<void(const fs::path&)>& write) {
  try {
    check();
  } catch (const std::runtime_error& error) {
    const fs::path other = free_name_beside(file);
    write(other);
    throw std::runtime_error(fmt::format("{}; the {} is in {}", error.what(), what, other.string()));
  }
}

AppendFile::~AppendFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void AppendFile::replace(std::string_view text) {
  Partial partial(file_);
  if (const int error = write_all(partial.descriptor(), text)) fail_to_write(file_, error);
  const int descriptor = partial.put_in_place();
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = descriptor;
  size_ = text.size();
}

void AppendFile::append(std::string_view text) {
  if (sync_error_ != 0) fail_to_write(file_, sync_error_);
  if (const int error = write_all(descriptor_, text)) {
    (void)::ftruncate(descriptor_, static_cast<off_t>(size_));
    fail_to_write(file_, error);
  }
  size_ += text.size();
}

void AppendFile::sync() noexcept {
  if (::fdatasync(descriptor_) != 0 && errno != EINVAL) sync_error_ = errno;
}

}  // namespace stereo_slam
