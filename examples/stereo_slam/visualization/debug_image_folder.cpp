// SPDX-License-Identifier: MIT
#include "stereo_slam/visualization/debug_image_folder.hpp"

#include <ostream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/codecs/codecs.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/visualization/debug_image.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// Whether it is the name of a debug image: debug_000012.png, of six or more digits.
[[nodiscard]] bool is_debug_image(std::string_view name) {
  constexpr std::string_view kBegin = "debug_";
  constexpr std::string_view kEnd = ".png";
  constexpr std::size_t kLeastDigits = 6;
  if (!name.starts_with(kBegin) || !name.ends_with(kEnd)) return false;
  if (name.size() < kBegin.size() + kLeastDigits + kEnd.size()) return false;
  name.remove_prefix(kBegin.size());
  name.remove_suffix(kEnd.size());
  return name.find_first_not_of("0123456789") == std::string_view::npos;
}

[[nodiscard]] std::vector<fs::path> debug_images_in(const fs::path& folder) {
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (is_debug_image(entry.path().filename().string())) images.push_back(entry.path());
  }
  return images;
}

/// Calls a step. Errors of the file system become errors that name the folder.
template <class Step>
void use_folder(const fs::path& folder, const Step& step) {
  try {
    step();
  } catch (const fs::filesystem_error& error) {
    fail(folder, "cannot be used for debug images ({}); choose another folder", error.code().message());
  }
}

}  // namespace

DebugImageFolder::DebugImageFolder(fs::path folder, bool overwrite, const fs::path& locked)
    : folder_(std::move(folder)), working_(folder_) {
  use_folder(folder_, [&] {
    fs::create_directories(folder_);
    std::error_code absent;
    if (!fs::equivalent(folder_, locked, absent)) lock_.emplace(folder_, "--debug-images");
    const auto earlier = debug_images_in(folder_);
    if (earlier.empty()) return;
    if (!overwrite) {
      fail(folder_,
           "holds the debug images of an earlier run; choose another folder, or replace them with "
           "--overwrite");
    }
    for (const auto& image : earlier) {
      if (!fs::is_regular_file(fs::symlink_status(image)))
        fail(folder_, "cannot be used for debug images ({} is not an ordinary file); choose another folder",
             image.filename().string());
    }
    working_ = folder_ / kUnfinished;
    if (fs::is_symlink(fs::symlink_status(working_)))
      fail(working_, "is a symbolic link, which no run made; remove it, or choose another --debug-images");
    fs::create_directories(working_);
  });
}

void DebugImageFolder::write(const StereoFrame& frame, const FrameResult& result,
                             const AssociationTrace& trace) {
  if (!std::exchange(begun_, true)) {
    use_folder(working_, [&] {  // left by a run that did not finish
      for (const auto& image : debug_images_in(working_)) fs::remove(image);
    });
  }
  const auto png = opencv_codecs().encode(draw_debug_image(frame, result, trace), ".png", {});
  write_file(working_ / fmt::format("debug_{:06}.png", result.index), [&](std::ostream& out) {
    out.write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  });
}

void DebugImageFolder::publish() {
  if (working_ == folder_ || !begun_) return;
  use_folder(folder_, [&] {
    auto stale = debug_images_in(folder_);
    std::erase_if(stale, [&](const auto& image) { return fs::exists(working_ / image.filename()); });
    for (const auto& image : debug_images_in(working_)) fs::rename(image, folder_ / image.filename());
    for (const auto& image : stale) fs::remove(image);
    std::error_code not_empty;
    fs::remove(working_, not_empty);
  });
}

}  // namespace stereo_slam
