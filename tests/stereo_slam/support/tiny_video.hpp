// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include <opencv2/videoio.hpp>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/support.hpp"

/// The tiny recording as two videos.
namespace stereo_slam::test {

/// Writes the images of a folder as a video without loss of more than a few grey levels.
inline void write_video(const fs::path& images, const fs::path& file, int frames,
                        const cv::Size& size = {TinySequence::kWidth, TinySequence::kHeight}) {
  cv::VideoWriter video(file.string(), cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'),
                        10.0, size);
  REQUIRE(video.isOpened());
  for (int i = 0; i < frames; ++i) video.write(cv::imread((images / frame_name(i)).string()));
}

/// The tiny recording as left.avi, right.avi and calibration.yaml.
inline void write_tiny_video(const fs::path& folder, int left_frames, int right_frames) {
  write_tiny_folders(folder, std::max(left_frames, right_frames));
  write_video(folder / "left", folder / "left.avi", left_frames);
  write_video(folder / "right", folder / "right.avi", right_frames);
  fs::rename(folder / "left", folder / "images_left");
  fs::rename(folder / "right", folder / "images_right");
  write_text(folder / "calibration.yaml", tiny_calibration(""));
}

/// Writes another number of frames into the headers of an AVI file (of the file and of its stream).
inline void promise_frames(const fs::path& file, std::uint32_t frames) {
  std::string bytes = read_text(file);
  for (const auto& [header, offset] : {std::pair{"avih", 24}, std::pair{"strh", 40}}) {
    const std::size_t at = bytes.find(header) + static_cast<std::size_t>(offset);
    for (std::size_t i = 0; i < 4; ++i) bytes.at(at + i) = static_cast<char>(frames >> (8 * i) & 0xFFU);
  }
  write_text(file, bytes);
}

/// Writes a video in which frame `repeated` is the frame before it.
inline void write_video_with_repetition(const fs::path& images, const fs::path& file, int frames,
                                        int repeated) {
  fs::copy_file(images / frame_name(repeated - 1), images / frame_name(repeated),
                fs::copy_options::overwrite_existing);
  write_video(images, file, frames);
}

/// Makes a frame of an AVI file one of no bytes, in its chunk and in the index.
inline void empty_frame(const fs::path& file, int frame) {
  std::string bytes = read_text(file);
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes.at(at + i));
    return value;
  };
  const auto put = [&](std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) bytes.at(at + i) = static_cast<char>(value >> (8 * i) & 0xFFU);
  };
  std::size_t at = bytes.find("movi") + 4;
  for (int i = 0; i < frame; ++i) at += 8 + (number(at + 4) + 1) / 2 * 2;
  const std::uint32_t length = number(at + 4);
  put(at + 4, 0);
  bytes.replace(at + 8, 4, "JUNK");
  put(at + 12, length - 8);
  put(bytes.find("idx1") + 8 + 16 * static_cast<std::size_t>(frame) + 12, 0);
  write_text(file, bytes);
}

/// Removes the frames of an AVI file: only its headers remain, which promise none.
inline void remove_frames(const fs::path& file) {
  promise_frames(file, 0);
  std::string bytes = read_text(file);
  const std::size_t movi = bytes.find("movi");
  bytes.resize(movi + 4);
  const auto put = [&](std::size_t at, std::size_t value) {
    for (std::size_t i = 0; i < 4; ++i) bytes.at(at + i) = static_cast<char>(value >> (8 * i) & 0xFFU);
  };
  put(movi - 4, 4);
  put(4, bytes.size() - 8);
  write_text(file, bytes);
}

/// Opens the recording as if its header promised `frames` frames.
inline StereoSequence open_with_false_header(const fs::path& folder, std::size_t frames) {
  auto sequence = open_sequence(folder, "auto");
  sequence.frames.resize(frames, sequence.frames.back());
  return sequence;
}

}  // namespace stereo_slam::test
