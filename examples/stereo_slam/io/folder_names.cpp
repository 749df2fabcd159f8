// SPDX-License-Identifier: MIT
#include "stereo_slam/io/folder_names.hpp"

#include <algorithm>
#include <cstddef>
#include <system_error>
#include <vector>

#include <fmt/format.h>

namespace stereo_slam {

namespace fs = std::filesystem;

std::string names_in(const fs::path& folder) {
  constexpr std::size_t kMost = 6;
  std::vector<std::string> folders;
  std::vector<std::string> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    std::error_code unknown;
    std::string name = entry->path().filename().string();
    if (name.starts_with('.')) continue;
    if (entry->is_directory(unknown)) {
      folders.push_back(std::move(name) + '/');
    } else {
      files.push_back(std::move(name));
    }
  }
  std::ranges::sort(folders);
  std::ranges::sort(files);
  folders.insert(folders.end(), files.begin(), files.end());
  const std::size_t shown = std::min(folders.size(), kMost);
  const auto more = folders.size() - shown;
  const auto end = folders.begin() + static_cast<std::ptrdiff_t>(shown);
  return fmt::format("{}{}", fmt::join(folders.begin(), end, ", "),
                     more > 0 ? fmt::format(" and {} more", more) : "");
}

}  // namespace stereo_slam
