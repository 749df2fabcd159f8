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

/// Throws std::runtime_error if the stacks of this program's threads are limited to less than it needs.
void require_stack();

/// Keeps the output of OpenCV and of the image and video decoders from standard error, where only
/// print_message() writes from then on: the program reports the same errors itself, in one line. If the
/// environment variable OPENCV_LOG_LEVEL is set, only FFmpeg is silenced, unless OPENCV_FFMPEG_LOGLEVEL is
/// set, too. Reports of a sanitizer are still written to standard error.
void silence_libraries();

/// Prints "stereo_slam: TEXT" as one line, shortened if necessary. Never fails.
void print_message(std::string_view text);

/// The message of an exception. Errors of memory, threads and the file system are reworded for the user.
[[nodiscard]] std::string text_of(const std::exception& error);

/// The text as one line of at most kLongestMessage bytes. "..." replaces the middle of a longer text, '?'
/// each control character.
[[nodiscard]] std::string as_message(std::string_view text);

constexpr std::size_t kLongestMessage = 1000;

}  // namespace stereo_slam
