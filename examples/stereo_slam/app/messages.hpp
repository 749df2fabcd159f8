// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <exception>
#include <string>
#include <string_view>

/// What the program tells the user on standard error.
namespace stereo_slam {

/// Call first. Opens /dev/null for standard streams that are closed at the start, so that no file takes their
/// place, and turns writing to a closed pipe, or beyond a file's largest size, from a signal into an error.
void prepare_streams();

/// Keeps everything but print_message() from standard error: OpenCV and the decoders of images and videos
/// print there what the program says itself, in one line. Not with the environment variable OPENCV_LOG_LEVEL,
/// nor under a sanitizer. FFmpeg's environment variable still works.
void silence_libraries();

/// Prints "stereo_slam: TEXT" as one line, shortened if necessary. Never fails.
void print_message(std::string_view text);

/// What an exception says, in words for the user where it is of memory, threads or the file system.
[[nodiscard]] std::string text_of(const std::exception& error);

/// The text as one line of at most kLongestMessage bytes: what is too long has "..." in its middle, control
/// characters are replaced by '?'.
[[nodiscard]] std::string as_message(std::string_view text);

constexpr std::size_t kLongestMessage = 1000;

}  // namespace stereo_slam
