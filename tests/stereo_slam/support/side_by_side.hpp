// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/support/tiny_video.hpp"

/// The tiny recording with both images in one.
namespace stereo_slam::test {

/// Joins the images of the folders left and right of `two`.
inline void write_side_by_side(const fs::path& two, const fs::path& folder, int frames) {
  fs::create_directories(folder);
  for (int i = 0; i < frames; ++i) {
    cv::Mat both;
    cv::hconcat(cv::imread((two / "left" / frame_name(i)).string()),
                cv::imread((two / "right" / frame_name(i)).string()), both);
    cv::imwrite((folder / frame_name(i)).string(), both);
  }
}

inline void write_side_by_side_video(const fs::path& images, const fs::path& file, int frames) {
  write_video(images, file, frames, cv::Size(2 * TinySequence::kWidth, TinySequence::kHeight));
}

}  // namespace stereo_slam::test
