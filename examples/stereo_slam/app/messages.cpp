// SPDX-License-Identifier: MIT
#include "stereo_slam/app/messages.hpp"

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <fcntl.h>
#include <new>
#include <stdexcept>
#include <sys/resource.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>

#include "stereo_slam/io/file_error.hpp"

#ifndef __has_feature
#define __has_feature(x) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || __has_feature(address_sanitizer) || \
    __has_feature(thread_sanitizer)
#define ANTIPODE_SANITIZED
#include <sanitizer/common_interface_defs.h>
#endif

namespace stereo_slam {
namespace {

/// Lets the sanitizer that the program is built with, if any, write to a descriptor.
void report_sanitizer_to([[maybe_unused]] int descriptor) {
#ifdef ANTIPODE_SANITIZED
  // The interface takes the number as a pointer.
  __sanitizer_set_report_fd(reinterpret_cast<void*>(static_cast<std::intptr_t>(descriptor)));
#endif
}

/// The descriptor of messages: standard error, or after silence_libraries() a copy of the original one.
int message_descriptor = STDERR_FILENO;

}  // namespace

void prepare_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // open() returns the lowest free descriptor, which is this one. Read-only, so that writing still fails.
    if (::fcntl(descriptor, F_GETFD) < 0 && errno == EBADF) (void)::open("/dev/null", O_RDONLY);
  }
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

void require_stack() {
  constexpr rlim_t kNeeded_kB = 512;
  rlimit stack{};
  if (::getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= kNeeded_kB * 1024) return;
  throw std::runtime_error(
      fmt::format("the stack is limited to {} kB, but must have at least {} kB; raise it with ulimit -s {}",
                  stack.rlim_cur / 1024, kNeeded_kB, kNeeded_kB));
}

void silence_libraries() {
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", /*overwrite=*/0);
  if (std::getenv("OPENCV_LOG_LEVEL") != nullptr) return;
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  const int copy = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int nobody = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (copy >= 0 && nobody >= 0 && ::dup2(nobody, STDERR_FILENO) >= 0) {
    message_descriptor = copy;
    report_sanitizer_to(copy);
  }
  if (nobody >= 0) ::close(nobody);
}

std::string text_of(const std::exception& error) {
  constexpr auto kNoMemory = "there is not enough memory; end other programs, or use smaller images";
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) return kNoMemory;
  if (const auto* opencv = dynamic_cast<const cv::Exception*>(&error)) {
    return opencv->code == cv::Error::StsNoMem ? kNoMemory : error.what();
  }
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  const bool in_system = system != nullptr && system->code() == std::errc::resource_unavailable_try_again;
  const bool in_library = std::string_view(error.what()).starts_with("pthread_create has failed");  // of TBB
  if (in_system || in_library) {
    return "no thread can be started; there are too many processes, or there is too little memory (see "
           "ulimit -u and ulimit -v)";
  }
  return file_error_text(error);
}

std::string as_message(std::string_view text) {
  constexpr std::string_view kGap = " ... ";
  constexpr std::size_t kHead = 300;
  std::string line(text);
  if (text.size() > kLongestMessage) {
    line = fmt::format("{}{}{}", text.substr(0, kHead), kGap,
                       text.substr(text.size() - (kLongestMessage - kHead - kGap.size())));
  }
  return printable(std::move(line));
}

void print_message(std::string_view text) {
  const std::string line = fmt::format("stereo_slam: {}\n", as_message(text));
  std::string_view rest = line;
  while (!rest.empty()) {
    const ssize_t written = ::write(message_descriptor, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;  // the failure cannot be reported
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace stereo_slam
