// SPDX-License-Identifier: MIT
#include "stereo_slam/codecs/codecs.hpp"

#include <array>
#include <dlfcn.h>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>

#include <fmt/format.h>

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLibrary = STEREO_SLAM_CODECS_NAME;

/// Where the shared library may be: installed with the program, in the build folder, or in the search path of
/// the dynamic linker.
[[nodiscard]] std::array<fs::path, 3> places() {
  std::error_code error;  // without /proc the other places remain
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return {program.parent_path().parent_path() / STEREO_SLAM_CODECS_FOLDER / kLibrary,
          fs::path(STEREO_SLAM_CODECS_BUILD_FOLDER) / kLibrary, fs::path(kLibrary)};
}

[[nodiscard]] const Codecs* load() {
  std::string errors;
  for (const fs::path& place : places()) {
    std::error_code error;
    if (place.has_parent_path() && !fs::exists(place, error)) continue;
    if (void* library = ::dlopen(place.c_str(), RTLD_LAZY | RTLD_LOCAL)) {
      using Entry = const Codecs* (*)();
      if (const auto entry = reinterpret_cast<Entry>(::dlsym(library, "stereo_slam_codecs"))) return entry();
    }
    errors = ::dlerror();
    // With a limit on memory, the library is there and cannot be mapped.
    for (const auto* reason :
         {"failed to map segment", "cannot allocate memory", "cannot map zero-fill pages"}) {
      if (errors.find(reason) != std::string::npos) throw std::bad_alloc();
    }
  }
  throw std::runtime_error(
      fmt::format("{}: cannot be loaded, and this input needs it; install it with the program, in {} ({})",
                  kLibrary, STEREO_SLAM_CODECS_FOLDER, errors));
}

}  // namespace

const Codecs& opencv_codecs() {
  static const Codecs* const codecs = load();
  return *codecs;
}

}  // namespace stereo_slam
