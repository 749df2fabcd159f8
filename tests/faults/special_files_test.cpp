// SPDX-License-Identifier: MIT
// Pipes and devices in place of files.
#include <sys/stat.h>

#include "stereo_slam/support/program.hpp"

using namespace stereo_slam::test;

namespace {

void make_pipe(const fs::path& path) {
  fs::remove(path);
  REQUIRE(mkfifo(path.c_str(), 0600) == 0);
}

void make_link(const fs::path& path, const char* target) {
  fs::remove(path);
  fs::create_symlink(target, path);
}

constexpr auto kNoFile = "it is not an ordinary file";

}  // namespace

TEST_CASE("Pipes and devices in place of a recording's files are refused", "[faults]") {
  for (const auto* name : {"calib.txt", "times.txt", "image_0/000001.png", "image_1/000000.png"}) {
    const TemporaryFolder folder;
    write_tiny_sequence(folder / "in", 3);
    make_pipe(folder / "in" / name);
    check_bounded_failure({"info", "--dataset", folder / "in"}, kNoFile);
    make_link(folder / "in" / name, "/dev/zero");
    check_bounded_failure({"run", "--dataset", folder / "in", "--output", folder / "out", "--strict"},
                          kNoFile);
  }
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  make_pipe(folder / "in/poses.txt");  // the ground truth is not needed
  const auto info = call({"info", "--dataset", folder / "in"}, bound_time_and_memory);
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains(kNoFile));
}

TEST_CASE("Pipes and devices in place of other inputs are refused", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  const std::string pipe = folder / "pipe";
  make_pipe(pipe);
  const std::string poses = folder / "in/poses.txt", estimate = folder / "estimate.txt";
  write_text(estimate,
             "1 0 0 0.01 0 1 0 0 0 0 1 0\n" + read_text(poses).substr(read_text(poses).find('\n') + 1));
  for (const auto& source : std::vector<std::string>{pipe, "/dev/urandom", "/dev/tty0"}) {
    if (!fs::exists(source)) continue;
    check_bounded_failure({"run", "--dataset", folder / "in", "--output", folder / "out", "--config", source},
                          "");
    check_bounded_failure(
        {"run", "--dataset", folder / "in", "--output", folder / "out", "--load-map", source},
        "is not an ordinary file");
    check_bounded_failure({"evaluate", "--groundtruth", source, "--estimate", poses}, "");
    check_bounded_failure({"evaluate", "--groundtruth", poses, "--estimate", estimate, "--loops", source},
                          "");
    check_bounded_failure({"simulate", "--output", folder / "s", "--trajectory", source}, "");
  }
}

TEST_CASE("A pipe that the program is started with is read", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 5);
  const std::string poses = folder / "in/poses.txt";
  const std::string text = read_text(poses);
  const auto evaluate = [&](bool endless) {
    return call({"evaluate", "--groundtruth", "/dev/stdin", "--estimate", poses}, [&] {
      bound_time_and_memory();
      if (endless) {
        (void)!std::freopen("/dev/zero", "r", stdin);
        return;
      }
      int ends[2];
      if (pipe(ends) != 0) _exit(97);
      (void)!write(ends[1], text.data(), text.size());
      dup2(ends[0], STDIN_FILENO);
      close(ends[0]);
      close(ends[1]);
    });
  };
  CHECK(evaluate(false).status == 0);
  check_one_line_failure(evaluate(true), kNoFile);
}
