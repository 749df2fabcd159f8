// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string_view>

namespace stereo_slam::report {

/// A file of page/ or vendor/, embedded when the program was built.
struct PageFile {
  std::string_view name;  ///< without folders
  std::string_view content;
};

/// All embedded files. embed_files.cmake generates the definition.
[[nodiscard]] std::span<const PageFile> page_files();

}  // namespace stereo_slam::report
