// SPDX-License-Identifier: MIT
#include "stereo_slam/io/input_file.hpp"

#include <array>
#include <cerrno>
#include <fcntl.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail_with(const fs::path& file, int error) {
  fail(file, "cannot be read ({}); check the path and its permissions",
       std::generic_category().message(error));
}

/// Whether the name is that of a descriptor that the program was started with.
[[nodiscard]] bool is_handed_over(const fs::path& file) {
  const std::string name = file.string();
  return name == "/dev/stdin" || name.starts_with("/dev/fd/") || name.starts_with("/proc/self/fd/");
}

/// A descriptor that is open for reading.
class Source {
 public:
  // Without O_NONBLOCK, a pipe that nobody writes to and /proc/kmsg would block for ever.
  explicit Source(const fs::path& file)
      : file_(file), descriptor_(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)) {
    if (descriptor_ < 0) fail_with(file, errno);
    if (::fstat(descriptor_, &status_) != 0) status_ = {};
    if (S_ISFIFO(status_.st_mode)) ::fcntl(descriptor_, F_SETFL, ::fcntl(descriptor_, F_GETFL) & ~O_NONBLOCK);
  }
  ~Source() { ::close(descriptor_); }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  [[nodiscard]] const struct stat& status() const { return status_; }

  /// Reads up to `most` bytes. Returns their number, 0 at the end.
  [[nodiscard]] std::size_t read(char* bytes, std::size_t most) const {
    ssize_t count = -1;
    do count = ::read(descriptor_, bytes, most);
    while (count < 0 && errno == EINTR);
    if (count < 0) fail_with(file_, errno);
    return static_cast<std::size_t>(count);
  }

 private:
  const fs::path& file_;
  int descriptor_;
  struct stat status_ = {};
};

}  // namespace

std::string read_file(const fs::path& file, std::size_t most_bytes) {
  const auto too_large = [&] {
    fail(file,
         "is larger than {} bytes, the most that is read of such a file; check that it is the right one",
         most_bytes);
  };
  const Source source(file);
  const auto mode = source.status().st_mode;
  if (S_ISDIR(mode)) fail(file, "cannot be read: it is a folder; name a file");
  if (!S_ISREG(mode) && !(S_ISFIFO(mode) && is_handed_over(file)))
    fail(file, "cannot be read: it is not an ordinary file; name one");
  if (S_ISREG(mode) && source.status().st_size > static_cast<off_t>(most_bytes)) too_large();

  std::string bytes;
  bytes.reserve(S_ISREG(mode) ? static_cast<std::size_t>(source.status().st_size) : 0);
  std::array<char, 1 << 16> part;
  while (const std::size_t count = source.read(part.data(), part.size())) {
    bytes.append(part.data(), count);
    if (bytes.size() > most_bytes) too_large();  // a pipe, or a file that has grown meanwhile
  }
  return bytes;
}

}  // namespace stereo_slam
