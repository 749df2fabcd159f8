// SPDX-License-Identifier: MIT
#pragma once

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include "stereo_slam/support/support.hpp"

#ifndef __has_feature
#define __has_feature(x) 0
#endif

/// The program stereo_slam as scripts see it: exit status, standard output, standard error.
namespace stereo_slam::test {

struct Result {
  int status = -1;
  std::string out;
  std::string err;
};

/// Whether the program is built with a sanitizer that reserves terabytes of addresses.
#if defined(__SANITIZE_ADDRESS__) || __has_feature(address_sanitizer)
constexpr bool kReservesAddresses = true;
#else
constexpr bool kReservesAddresses = false;
#endif

/// Switches the search for leaks off in a program built with the address sanitizer: it crashes in every
/// second process that has loaded OpenCV's readers of videos. Tests that call the same code in their own
/// process have it.
inline void switch_leak_check_off() {
  if (kReservesAddresses) setenv("ASAN_OPTIONS", "detect_leaks=0", 1);
}

/// A running stereo_slam with its output in files.
class Program {
 public:
  /// Calls `prepare` in the new process, after its output was connected.
  Program(
      const fs::path& folder, std::vector<std::string> arguments,
      const std::function<void()>& prepare = [] {})
      : out_(folder / "stdout"), err_(folder / "stderr") {
    arguments.insert(arguments.begin(), STEREO_SLAM_PROGRAM);
    write_text(out_, "");
    process_ = fork();
    if (process_ != 0) return;
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    if (std::freopen(out_.c_str(), "w", stdout) == nullptr ||
        std::freopen(err_.c_str(), "w", stderr) == nullptr)
      _exit(99);
    // A job in the background of a script ignores SIGINT, one below nohup SIGHUP: the tests may be such a
    // job.
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) (void)std::signal(number, SIG_DFL);
    switch_leak_check_off();
    prepare();
    execv(argv[0], argv.data());
    _exit(98);
  }

  [[nodiscard]] std::string output_so_far() const { return read_text(out_); }
  void signal(int number) const { kill(process_, number); }

  /// Returns once the program has printed `text`, or after a minute.
  void wait_for_output(const std::string& text) const {
    for (int ms = 0; ms < 60'000 && output_so_far().find(text) == std::string::npos; ++ms) usleep(1000);
  }

  Result wait() const {
    int status = 0;
    waitpid(process_, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status), read_text(out_),
            read_text(err_)};
  }

 private:
  fs::path out_;
  fs::path err_;
  pid_t process_ = 0;
};

inline Result call(
    std::vector<std::string> arguments, const std::function<void()>& prepare = [] {}) {
  const TemporaryFolder folder;
  return Program(folder.path(), std::move(arguments), prepare).wait();
}

/// Runs the SLAM on a recording with these options in addition. The results are in `folder`/out.
inline Result run_on(const fs::path& recording, const TemporaryFolder& folder,
                     const std::vector<std::string>& options) {
  std::vector<std::string> arguments = {"run",          "--dataset", recording,    "--output",
                                        folder / "out", "--quiet",   "--overwrite"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return call(arguments);
}

/// What a program may use at most, for call(). The signal of the alarm ends one that hangs.
inline void bound_time_and_memory() {
  constexpr rlimit kBytes = {std::size_t{3} << 30, std::size_t{3} << 30};  // addresses, not memory in use
  if (kReservesAddresses) {
    setenv("ASAN_OPTIONS", "detect_leaks=0:hard_rss_limit_mb=3072", 1);
  } else {
    setrlimit(RLIMIT_AS, &kBytes);
  }
  alarm(30);
}

/// A failure is one line on standard error that begins with the program's name.
inline void check_one_line_failure(const Result& result, const std::string& part) {
  CAPTURE(result.out, result.err);
  CHECK(result.status == 1);
  CHECK(split_lines(result.err).size() == 1);
  CHECK_THAT(result.err, Catch::StartsWith("stereo_slam: ") && Catch::Contains(part));
}

/// The same within bounds of time and memory.
inline void check_bounded_failure(const std::vector<std::string>& arguments, const std::string& part) {
  CAPTURE(arguments);
  check_one_line_failure(call(arguments, bound_time_and_memory), part);
}

/// Something that makes a recording unusable, and a part of what is said about it.
struct Breaking {
  const char* part;
  std::function<void(const fs::path&)> breaking;
};

/// Each of them, done to a recording of five frames, is one failure of `info` and of `run`.
inline void check_refused(const std::function<void(const fs::path&, int)>& write_recording,
                          const std::vector<Breaking>& cases) {
  for (const auto& [part, breaking] : cases) {
    CAPTURE(part);
    const TemporaryFolder folder;
    write_recording(folder / "in", 5);
    breaking(folder / "in");
    check_one_line_failure(call({"info", "--dataset", folder / "in"}), part);
    check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "out", "--strict"}),
                           part);
  }
}

}  // namespace stereo_slam::test
