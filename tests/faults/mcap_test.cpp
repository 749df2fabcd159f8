// SPDX-License-Identifier: MIT
// What is left of the file of run --mcap, and what it does not replace.
#include <algorithm>
#include <csignal>
#include <random>
#include <sys/resource.h>
#include <sys/stat.h>

#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/support/program.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

[[nodiscard]] std::vector<std::string> run_with_mcap(const TemporaryFolder& folder, const std::string& input,
                                                     const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {"run",          "--dataset", folder / input,     "--output",
                                        folder / "out", "--mcap",    folder / "run.mcap"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

/// The number of messages on the topic. Every one can be read.
[[nodiscard]] std::size_t messages_in(const fs::path& mcap, const std::string& topic) {
  const auto file = open_message_file(mcap);
  const auto places = file->places(topic);
  for (const auto& place : places) CHECK_FALSE(file->read(place).empty());
  return places.size();
}

[[nodiscard]] std::size_t frames_in(const fs::path& output) {
  const fs::path poses = output / "trajectory_online.txt";
  return fs::exists(poses) ? split_lines(read_text(poses)).size() : 0;
}

}  // namespace

TEST_CASE("The messages of all chunks of a killed run can be read", "[faults][mcap]") {
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", 4000);
  std::mt19937 random(59);
  std::size_t most = 0;
  for (int i = 0; i < 20; ++i) {
    const Program program(folder.path(), run_with_mcap(folder, "in", {"--overwrite", "--mcap-images"}));
    program.wait_for_output("frame 1/");
    usleep(std::uniform_int_distribution<unsigned>(300'000, 1'300'000)(random));
    program.signal(SIGKILL);
    CHECK(program.wait().status == 1000 + SIGKILL);
    // The file of a killed run is one of a run that did not finish: the next one writes beside it.
    const fs::path mcap = fs::exists(folder / "run-2.mcap") ? folder / "run-2.mcap" : folder / "run.mcap";
    const auto text = read_text(mcap);
    if (text.find("/stereo_slam/odometry") == text.npos && text.size() < 100) continue;  // no chunk yet
    const auto odometry = messages_in(mcap, "/stereo_slam/odometry");
    CHECK(odometry == messages_in(mcap, "/tf"));
    most = std::max(most, odometry);
    fs::remove(folder / "run-2.mcap");
    fs::remove_all(folder / "out");
  }
  CHECK(most > 0);
}

TEST_CASE("A full disk leaves the messages before it, and the other results", "[faults][mcap]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 300);
  const auto limit_files = [] {
    constexpr rlimit kBytes = {400'000, 400'000};  // more than the other results have, except for the report
    setrlimit(RLIMIT_FSIZE, &kBytes);
  };
  const auto result = call(run_with_mcap(folder, "in", {"--mcap-images", "--quiet"}), limit_files);
  check_one_line_failure(result, "run.mcap: cannot be written (File too large)");
  CHECK_THAT(result.err, Catch::Contains("(the results are in " + (folder / "out").string()));
  CHECK(frames_in(folder / "out") == 300);
  CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == 300);
  CHECK(fs::exists(folder / "out/map.ply"));
  CHECK(fs::file_size(folder / "run.mcap") <= 400'000);
  CHECK_NOTHROW(open_message_file(folder / "run.mcap"));
}

TEST_CASE("--mcap replaces nothing but the messages of an earlier run, and these with --overwrite",
          "[faults][mcap]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  fs::create_directories(folder / "folder.mcap");
  write_text(folder / "mine.mcap", std::string("\x89MCAP0\r\n\x01", 9) + "a recording of the robot");
  write_text(folder / "readonly.mcap", "");
  fs::permissions(folder / "readonly.mcap", fs::perms::owner_read);
  REQUIRE(mkfifo((folder / "pipe.mcap").c_str(), 0600) == 0);
  fs::create_symlink("nowhere", folder / "link.mcap");
  REQUIRE(call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / "first", "--mcap",
                folder / "first.mcap"})
              .status == 0);
  const std::vector<std::tuple<std::string, std::string, const char*>> cases = {
      {"folder.mcap", "--overwrite", "is a folder; name a file"},
      {"mine.mcap", "--overwrite", "exists, and is not a file of this kind"},
      {"readonly.mcap", "--overwrite", "is read-only"},
      {"pipe.mcap", "--overwrite", "is not an ordinary file, which --mcap needs"},
      {"link.mcap", "--overwrite", "is a symbolic link that leads nowhere"},
      {"first.mcap", "--quiet", "holds the messages of an earlier run; name another file, or replace it"},
      {"none/run.mcap", "--overwrite", "cannot be written (No such file or directory)"},
      {"out/covariances.csv", "--overwrite", "is the name of a result file"},
      {"out", "--overwrite", "will be a folder"},
  };
  for (const auto& [name, more, part] : cases) {
    CAPTURE(name);
    const fs::path file = folder / name;
    const auto before = fs::is_regular_file(file) ? read_text(file) : "";
    check_one_line_failure(
        call({"run", "--dataset", folder / "in", "--output", folder / "out", "--mcap", file.string(), more}),
        part);
    if (fs::is_regular_file(file)) CHECK(read_text(file) == before);
    CHECK_FALSE(fs::exists(folder / "out/trajectory_online.txt"));
  }
  for (const auto* option : {"--save-map", "--json"}) {
    check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "out", "--mcap",
                                 folder / "same", option, folder / "same"}),
                           "same: is the file of --");
  }
  CHECK(call({"run", "--dataset", folder / "in", "--output", folder / "out", "--mcap-images"}).status == 2);
}

TEST_CASE("The messages of an earlier run are replaced only by a run that finishes", "[faults][mcap]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  write_long_sequence(folder / "long", 4000);
  REQUIRE(call(run_with_mcap(folder, "in", {"--quiet"})).status == 0);
  const auto earlier = read_text(folder / "run.mcap");
  const Program program(folder.path(), run_with_mcap(folder, "long", {"--overwrite"}));
  program.wait_for_output("frame 50/");
  program.signal(SIGINT);
  const auto result = program.wait();
  CHECK(result.status == 130);
  CHECK(read_text(folder / "run.mcap") == earlier);
  CHECK_THAT(result.out, Catch::Contains("; the messages are in " + (folder / "run-2.mcap").string() + ", " +
                                         (folder / "run.mcap").string() + " has those of the earlier run"));
  CHECK(messages_in(folder / "run-2.mcap", "/stereo_slam/odometry") >= 50);
  fs::remove(folder / "run-2.mcap");
  CHECK(call(run_with_mcap(folder, "in", {"--quiet", "--overwrite", "--max-frames", "3"})).status == 0);
  CHECK(messages_in(folder / "run.mcap", "/stereo_slam/odometry") == 3);
  CHECK_FALSE(fs::exists(folder / "run-2.mcap"));
}

TEST_CASE("A run that fails before its first frame leaves no messages but those of an earlier run",
          "[faults][mcap]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  const auto run = [&] { return call(run_with_mcap(folder, "in", {"--quiet", "--overwrite", "--strict"})); };
  fs::rename(folder / "in/image_1/000000.png", folder / "missing.png");
  CHECK(run().status == 1);
  CHECK_FALSE(fs::exists(folder / "run.mcap"));
  fs::rename(folder / "missing.png", folder / "in/image_1/000000.png");
  REQUIRE(run().status == 0);
  fs::remove(folder / "in/image_1/000000.png");
  const auto earlier = read_text(folder / "run.mcap");
  CHECK(run().status == 1);
  CHECK(read_text(folder / "run.mcap") == earlier);
  CHECK_FALSE(fs::exists(folder / "run-2.mcap"));
}

TEST_CASE("A file that takes the place of --mcap during the run is kept, and so are the results",
          "[faults][mcap]") {
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", 300);
  const Program program(folder.path(), run_with_mcap(folder, "in"));
  program.wait_for_output("frame 1/");
  fs::remove(folder / "run.mcap");
  write_text(folder / "run.mcap", "of the user");
  const auto result = program.wait();
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::Contains("run.mcap: was replaced by another program during the run"));
  CHECK(read_text(folder / "run.mcap") == "of the user");
  CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == 300);
}
