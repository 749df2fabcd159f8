// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/unpacked_file.hpp"

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <unistd.h>

#include <fmt/format.h>

#include "stereo_slam/bags/unpack.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse_room(const fs::path& folder) {
  throw std::runtime_error(fmt::format(
      "has no room to be unpacked in {}; set TMPDIR to a folder with more, or unpack it with `unzstd`",
      folder.string()));
}

/// A new empty file in the folder.
[[nodiscard]] fs::path make_temporary(const fs::path& folder) {
  std::string name = (folder / "stereo_slam_XXXXXX").string();
  const int descriptor = ::mkstemp(name.data());
  if (descriptor < 0) refuse_room(folder);
  ::close(descriptor);
  return name;
}

/// Writes the content of `packed` to `file`, up to `most_bytes`. Returns whether that was all.
[[nodiscard]] bool unpack_file(const fs::path& packed, const fs::path& file, std::uint64_t most_bytes) {
  std::ifstream in(packed, std::ios::binary);
  if (!in) throw std::runtime_error("cannot be read; check its permissions");
  std::ofstream out(file, std::ios::binary);
  std::uint64_t written = 0;
  const auto read = [&](std::span<std::uint8_t> bytes) {
    if (written > most_bytes || !out) return std::size_t{0};
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return static_cast<std::size_t>(in.gcount());
  };
  unpack_stream(Compression::kZstd, read, [&](std::span<const std::uint8_t> bytes) {
    written += bytes.size();
    if (written > most_bytes) return;
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  });
  return written <= most_bytes && out.flush().good();
}

}  // namespace

UnpackedFile::UnpackedFile(const fs::path& packed) {
  constexpr double kShareOfRoom = 0.9;
  std::error_code error;
  const fs::path folder = fs::temp_directory_path(error);
  if (error) throw std::runtime_error("cannot be unpacked: TMPDIR is no folder; set it to one");
  const auto room = fs::space(folder, error).available;
  path_ = make_temporary(folder);
  try {
    const auto most_bytes = static_cast<std::uint64_t>(kShareOfRoom * static_cast<double>(room));
    if (!unpack_file(packed, path_, most_bytes)) refuse_room(folder);
  } catch (...) {
    fs::remove(path_, error);
    throw;
  }
}

UnpackedFile::~UnpackedFile() {
  std::error_code error;
  fs::remove(path_, error);
}

}  // namespace stereo_slam
