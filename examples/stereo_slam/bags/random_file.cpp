// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/random_file.hpp"

#include <cerrno>
#include <fcntl.h>
#include <stdexcept>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include <fmt/format.h>

namespace stereo_slam {
namespace {

[[noreturn]] void refuse_file(int error) {
  throw std::runtime_error(fmt::format("cannot be read ({}); check the path and its permissions",
                                       std::generic_category().message(error)));
}

}  // namespace

RandomFile::RandomFile(const std::filesystem::path& file)
    : descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (descriptor_ < 0) refuse_file(errno);
  struct stat status = {};
  if (::fstat(descriptor_, &status) == 0) size_ = static_cast<std::uint64_t>(status.st_size);
}

RandomFile::~RandomFile() { ::close(descriptor_); }

void RandomFile::read(std::uint64_t offset, std::span<std::uint8_t> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) refuse_file(errno);
    if (count == 0) throw std::runtime_error("ended earlier than before; it may still be written");
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    offset += static_cast<std::uint64_t>(count);
  }
}

}  // namespace stereo_slam
