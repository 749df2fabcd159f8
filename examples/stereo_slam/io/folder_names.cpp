// SPDX-License-Identifier: MIT
#include "stereo_slam/io/folder_names.hpp"

#include <algorithm>
#include <cstddef>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace stereo_slam {

namespace fs = std::filesystem;
namespace {

/// What is in a folder, but for hidden files.
struct FolderContents {
  std::vector<std::string> folders;
  std::vector<std::string> files;
};

FolderContents contents_of(const fs::path& folder) {
  FolderContents contents;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    std::error_code unknown;
    std::string name = entry->path().filename().string();
    if (name.starts_with('.')) continue;
    (entry->is_directory(unknown) ? contents.folders : contents.files).push_back(std::move(name));
  }
  std::ranges::sort(contents.folders);
  std::ranges::sort(contents.files);
  return contents;
}

}  // namespace

std::string names_in(const fs::path& folder) {
  constexpr std::size_t kMost = 6;
  auto [names, files] = contents_of(folder);
  for (auto& name : names) name += '/';
  names.insert(names.end(), files.begin(), files.end());
  const std::size_t shown = std::min(names.size(), kMost);
  const auto more = names.size() - shown;
  const auto end = names.begin() + static_cast<std::ptrdiff_t>(shown);
  return fmt::format("{}{}", fmt::join(names.begin(), end, ", "),
                     more > 0 ? fmt::format(" and {} more", more) : "");
}

std::vector<fs::path> folders_in(const fs::path& folder) {
  constexpr std::size_t kMost = 100;
  std::vector<fs::path> folders;
  for (const auto& name : contents_of(folder).folders) {
    if (folders.size() < kMost) folders.push_back(folder / name);
  }
  return folders;
}

}  // namespace stereo_slam
