// SPDX-License-Identifier: MIT
// Output that would replace something, and streams that nobody reads.
#include <csignal>
#include <fcntl.h>
#include <new>
#include <sys/resource.h>
#include <system_error>

#include <opencv2/core.hpp>

#include "stereo_slam/app/messages.hpp"
#include "stereo_slam/support/program.hpp"

using namespace stereo_slam::test;

namespace {

/// A recording with results and a map of one run.
void prepare(const TemporaryFolder& folder) {
  write_tiny_sequence(folder / "in", 4);
  CHECK(call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / "out", "--save-map",
              folder / "street.map"})
            .status == 0);
}

}  // namespace

TEST_CASE("What is read, and what the program did not write, is never replaced", "[faults]") {
  const TemporaryFolder folder;
  prepare(folder);
  write_text(folder / "mine.txt", "mine");
  const std::string run_like = folder / "run.json";
  const std::string scores_like = folder / "scores.json";
  write_text(run_like, "{\n  \"name\": \"mine\",\n  \"stereo_slam\": {}\n}\n");
  write_text(scores_like, "{\n  \"mine\": 1,\n  \"frames_matched\": 2\n}\n");
  fs::copy(folder / "out", folder / "other");
  const std::string poses = folder / "in/poses.txt";
  const std::string map = folder / "street.map";
  const auto run = [&](const std::string& file, const std::string& more = "--overwrite") {
    return std::vector<std::string>{"run",     "--dataset",  folder / "in", "--output", folder / "out2",
                                    "--quiet", "--save-map", file,          more};
  };
  const std::vector<std::tuple<std::vector<std::string>, fs::path, const char*>> cases = {
      {run(poses), poses, "is not a file of this kind"},
      {run(folder / "in/image_0/000000.png"), folder / "in/image_0/000000.png", "is not a file of this kind"},
      {run(folder / "mine.txt"), folder / "mine.txt", "is not a file of this kind"},
      {run(map, "--quiet"), map, "replace it with --overwrite"},
      {run(folder / "out2/map.ply"), poses, "is the name of a result file"},
      {{"run", "--dataset", folder / "in", "--output", folder / "out2", "--load-map", map, "--save-map", map,
        "--overwrite"},
       map,
       "is to be read, too"},
      {{"evaluate", "--groundtruth", poses, "--estimate", folder / "out/trajectory_kitti.txt", "--json",
        poses},
       poses,
       "is to be read, too"},
      {{"evaluate", "--groundtruth", poses, "--estimate", folder / "out/trajectory_kitti.txt", "--json",
        folder / "mine.txt"},
       folder / "mine.txt",
       "is not a file of this kind"},
      {{"evaluate", "--groundtruth", poses, "--estimate", folder / "out/trajectory_kitti.txt", "--json",
        scores_like},
       scores_like,
       "is not a file of this kind"},
      {{"run", "--dataset", folder / "in", "--output", folder / "out2", "--json", run_like},
       run_like,
       "is not a file of this kind"},
      {{"run", "--dataset", folder / "in", "--output", folder / "out", "--overwrite", "--json",
        folder / "out/unfinished"},
       poses,
       "is the name of a result file"},
      {{"compare", folder / "out", "--output", folder / "other/report.html"},
       folder / "other/report.html",
       "is not a file of this kind"},
      {{"info", "--dataset", folder / "in", "--write-groundtruth", poses},
       poses,
       "is not a file of this kind"},
      {{"simulate", "--output", folder / "in", "--trajectory", poses}, poses, "in: not empty"},
  };
  for (const auto& [arguments, file, part] : cases) {
    CAPTURE(arguments);
    const auto before = read_text(file);
    check_one_line_failure(call(arguments), part);
    CHECK(read_text(file) == before);
    CHECK_FALSE(fs::exists(folder / "out2/trajectory_online.txt"));
  }
}

TEST_CASE("Nothing is written through a link that no run made", "[faults]") {
  const TemporaryFolder folder;
  prepare(folder);
  fs::create_directories(folder / "mine");
  fs::create_symlink(folder / "mine", folder / "out/unfinished");
  const auto run = [&](const std::string& output) {
    return call({"run", "--quiet", "--dataset", folder / "in", "--output", output, "--overwrite"});
  };
  check_one_line_failure(run(folder / "out"), "unfinished: is a symbolic link, which no run made");
  CHECK(fs::is_empty(folder / "mine"));
  fs::create_symlink("nowhere", folder / "link");
  check_one_line_failure(run(folder / "link"), "link: is a symbolic link that leads nowhere");
}

TEST_CASE("What the program wrote is replaced by the same command", "[faults]") {
  const TemporaryFolder folder;
  prepare(folder);
  const std::vector<std::vector<std::string>> commands = {
      {"evaluate", "--groundtruth", folder / "in/poses.txt", "--estimate",
       folder / "out/trajectory_kitti.txt", "--json", folder / "e.json"},
      {"info", "--dataset", folder / "in", "--write-groundtruth", folder / "truth.txt"},
      {"compare", folder / "out", "--output", folder / "compared.html"},
      {"run", "--quiet", "--dataset", folder / "in", "--output", folder / "out", "--json", folder / "r.json",
       "--overwrite"},
      {"run", "--quiet", "--dataset", folder / "in", "--output", folder / "out", "--save-map",
       folder / "street.map", "--overwrite"}};
  for (const auto& arguments : commands) {
    CAPTURE(arguments);
    for (int i = 0; i < 2; ++i) CHECK(call(arguments).status == 0);
  }
}

TEST_CASE("A file that takes the place of --save-map or --json during the run is kept, and so is the result",
          "[faults]") {
  struct Case {
    std::string option, file, other, what;
  };
  const auto [option, file, other, what] = GENERATE(Case{"--save-map", "street.map", "street-2.map", "map"},
                                                    Case{"--json", "run.json", "run-2.json", "JSON object"});
  CAPTURE(option);
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", 300);
  const Program program(
      folder.path(), {"run", "--dataset", folder / "in", "--output", folder / "out", option, folder / file});
  program.wait_for_output("frame 1/");
  write_text(folder / file, "of the user");
  const auto result = program.wait();
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::Contains(file + ": exists, and is not a file of this kind") &&
                             Catch::Contains("; the " + what + " is in " + (folder / other).string()) &&
                             Catch::Contains("(the results are in"));
  CHECK(read_text(folder / file) == "of the user");
  CHECK(fs::file_size(folder / other) > 0);
  if (option == "--json") CHECK_THAT(read_text(folder / other), Catch::Contains("\"state\": \"finished\""));
}

TEST_CASE("Two runs that replace the same map keep both maps", "[faults]") {
  const TemporaryFolder folder;
  prepare(folder);
  write_long_sequence(folder / "long", 300);
  const Program program(folder.path(), {"run", "--dataset", folder / "long", "--output", folder / "out2",
                                        "--save-map", folder / "street.map", "--overwrite"});
  program.wait_for_output("frame 1/");
  CHECK(call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / "out3", "--save-map",
              folder / "street.map", "--overwrite"})
            .status == 0);
  const auto map = read_text(folder / "street.map");
  const auto result = program.wait();
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::Contains("street.map: was written by another program during the run") &&
                             Catch::Contains("; the map is in " + (folder / "street-2.map").string()));
  CHECK(read_text(folder / "street.map") == map);
  CHECK(fs::file_size(folder / "street-2.map") > 0);
}

TEST_CASE("A read-only file is not replaced", "[faults]") {
  const TemporaryFolder folder;
  prepare(folder);
  fs::permissions(folder / "street.map", fs::perms::owner_read);
  const auto result = call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / "out2",
                            "--save-map", folder / "street.map", "--overwrite"});
  check_one_line_failure(result, "street.map: is read-only; name another file");
  CHECK_FALSE(fs::exists(folder / "out2"));
}

TEST_CASE("A map can be saved into the folder of the results, which is not there yet", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  CHECK(call({"run", "--quiet", "--dataset", "in", "--output", "out", "--save-map", "out/street.map"}, [&] {
          if (chdir(folder.path().c_str()) != 0) _exit(97);
        }).status == 0);
  CHECK(fs::exists(folder / "out/street.map"));
}

TEST_CASE("Links and devices named as output are written through", "[faults]") {
  const TemporaryFolder folder;
  prepare(folder);
  write_text(folder / "file.json", "");
  fs::create_symlink(folder / "file.json", folder / "link.json");
  const auto evaluate = [&](const std::string& json) {
    return call({"evaluate", "--groundtruth", folder / "in/poses.txt", "--estimate",
                 folder / "out/trajectory_kitti.txt", "--json", json});
  };
  CHECK(evaluate(folder / "link.json").status == 0);
  CHECK(fs::is_symlink(folder / "link.json"));
  CHECK_THAT(read_text(folder / "file.json"), Catch::Contains("frames_matched"));
  CHECK(evaluate("/dev/null").status == 0);
  CHECK(fs::is_character_file("/dev/null"));
  const auto printed = evaluate("/dev/stdout");
  CHECK(printed.status == 0);
  CHECK_THAT(printed.out, Catch::Contains("\"frames_matched\""));
  CHECK(fs::is_symlink("/dev/stdout"));
  check_one_line_failure(evaluate("/dev/full"), "/dev/full: cannot be written (No space left on device)");
}

TEST_CASE("Standard streams that are closed, full or unread do not end a run with a signal", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  const auto point_at_full = [](int descriptor) { dup2(open("/dev/full", O_WRONLY), descriptor); };
  const auto break_pipe = [](int descriptor) {
    int ends[2];
    if (pipe(ends) != 0) _exit(97);
    dup2(ends[1], descriptor);
    close(ends[0]);
    close(ends[1]);
  };
  int number = 0;
  const std::vector<std::function<void(int)>> damages = {[](int descriptor) { close(descriptor); },
                                                         point_at_full, break_pipe};
  for (const auto& damage : damages) {
    const std::string out = folder / fmt::format("out{}", number++);
    const std::vector<std::string> run = {"run", "--dataset", folder / "in", "--output", out, "--overwrite"};
    CHECK(call(run, [&] { damage(STDERR_FILENO); }).status == 0);
    CHECK(call({"run"}, [&] { damage(STDERR_FILENO); }).status == 2);
    CHECK(call({"info", "--dataset", "nowhere"}, [&] { damage(STDERR_FILENO); }).status == 1);
    check_one_line_failure(call(run, [&] { damage(STDOUT_FILENO); }), "standard output cannot be written");
    check_one_line_failure(call({"--help"}, [&] { damage(STDOUT_FILENO); }),
                           "standard output cannot be written");
    CHECK(split_lines(read_text(out + "/trajectory_kitti.txt")).size() == 4);
    CHECK(call(run, [&] {
            for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) damage(descriptor);
          }).status == 1);
    CHECK(split_lines(read_text(out + "/trajectory_kitti.txt")).size() == 4);  // and not a message
  }
}

TEST_CASE("Failures of the system are described in words for the user", "[faults]") {
  using stereo_slam::text_of;
  CHECK_THAT(text_of(std::bad_alloc()), Catch::StartsWith("there is not enough memory"));
  CHECK_THAT(text_of(cv::Exception(cv::Error::StsNoMem, "alloc", "f", "g", 1)),
             Catch::StartsWith("there is not enough memory"));
  CHECK_THAT(text_of(std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again))),
             Catch::StartsWith("no thread can be started"));
  CHECK(text_of(fs::filesystem_error("status", "a/b", std::make_error_code(std::errc::permission_denied))) ==
        "a/b: cannot be read (Permission denied); check the path and its permissions");
  CHECK(text_of(std::runtime_error("a.txt: is empty")) == "a.txt: is empty");
}

TEST_CASE("A message is one line of bounded length", "[faults]") {
  using stereo_slam::as_message;
  CHECK(as_message("two\nlines\x1B[31m") == "two?lines?[31m");
  const auto cut = as_message("begin" + std::string(5'000'000, 'x') + "end");
  CHECK(cut.size() == stereo_slam::kLongestMessage);
  CHECK_THAT(cut, Catch::StartsWith("begin") && Catch::Contains(" ... ") && Catch::EndsWith("end"));

  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  const std::string path(5'000, 'p');
  const std::string line(60'000, 'x');
  write_text(folder / "in/calib.txt", "P0: " + line + "\n");
  write_text(folder / "in/times.txt", line + "\n");
  write_text(folder / "s.yaml", line + ": 1\n");
  const std::vector<std::vector<std::string>> commands = {
      {"info", "--dataset", path},
      {"info", "--dataset", folder / "in"},
      {"run", "--dataset", path, "--output", path},
      {"run", "--dataset", folder / "in", "--output", folder / "out", "--config", folder / "s.yaml"},
      {"evaluate", "--groundtruth", path, "--estimate", path}};
  for (const auto& arguments : commands) {
    const auto result = call(arguments);
    check_one_line_failure(result, "");
    CHECK(result.err.size() < 1'100);
    CHECK(result.out.size() < 5'000);
  }
  const auto usage = call({"info", "--dataset", "x", "--format", std::string(100'000, 'f')});
  CHECK(usage.status == 2);
  CHECK(usage.err.size() < 1'100);
}

TEST_CASE("What libraries print about a damaged image does not reach the user", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "in", 3);
  for (const auto* side : {"in/left", "in/right"}) {  // the formats whose data is not checked before decoding
    for (int i = 0; i < 3; ++i) {
      const auto png = folder / side / frame_name(i);
      cv::imwrite((folder / side / fmt::format("{}.jpg", i)).string(), cv::imread(png.string()));
      fs::remove(png);
    }
  }
  auto bytes = read_text(folder / "in/left/1.jpg");
  for (std::size_t i = bytes.size() / 2; i < bytes.size() / 2 + 40; ++i) bytes[i] = '\xFF';
  write_text(folder / "in/left/1.jpg", bytes);
  const auto result = call({"run", "--dataset", folder / "in", "--output", folder / "out", "--quiet"});
  CHECK(split_lines(result.err).size() <= 1);
}

TEST_CASE("Results are not written among the images of the recording", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  check_one_line_failure(
      call({"run", "--dataset", folder / "in", "--output", folder / "in/image_0/", "--overwrite"}),
      "has the images of the recording; choose another folder for --output");
  CHECK_FALSE(fs::exists(folder / "in/image_0/run.yaml"));
}

TEST_CASE("Debug images are not written among the images of the recording", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "out",
                               "--debug-images", folder / "in/image_1"}),
                         "has the images of the recording");
  CHECK_FALSE(fs::exists(folder / "in/image_1/debug_000000.png"));
  CHECK_FALSE(fs::exists(folder / "out"));
}

TEST_CASE("Debug images of an earlier run stay until a run has replaced them", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 6);
  const auto run = [&](const std::string& output) {
    return call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / output, "--debug-images",
                 folder / "images", "--overwrite", "--strict"});
  };
  REQUIRE(run("out").status == 0);
  const auto images = [&] {
    return std::count_if(fs::directory_iterator(folder / "images"), {},
                         [](const auto& entry) { return entry.is_regular_file(); });
  };
  CHECK(images() == 6);
  fs::create_directories(folder / "mine");
  write_text(folder / "mine/map.ply", "mine");
  check_one_line_failure(run("mine"), "no run wrote it");
  CHECK(images() == 6);
  fs::remove(folder / "in/image_0/000003.png");
  check_one_line_failure(run("out2"), "000003.png: missing");
  CHECK(images() == 6);
  CHECK(fs::exists(folder / "images/unfinished/debug_000002.png"));

  write_tiny_sequence(folder / "in", 6);
  fs::create_directories(folder / "linked");
  for (const auto* camera : {"image_0", "image_1"}) {
    for (const auto& image : fs::directory_iterator(folder / "in" / camera)) {
      const auto moved = folder / "linked" / (camera + image.path().filename().string());
      fs::rename(image.path(), moved);
      fs::create_symlink(moved, image.path());
    }
  }
  check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "out3",
                               "--debug-images", folder / "linked"}),
                         "has the images of the recording");
}

TEST_CASE("The JSON is written although run.yaml cannot be", "[faults]") {
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", 300);
  const Program program(folder.path(), {"run", "--dataset", folder / "in", "--output", folder / "out",
                                        "--json", folder / "run.json"});
  program.wait_for_output("frame 1/");
  fs::remove(folder / "out/run.yaml");
  fs::create_directories(folder / "out/run.yaml/in_the_way");
  const auto result = program.wait();
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::Contains("run.yaml: is a folder") &&
                             Catch::Contains("(the results are in " + (folder / "out").string()));
  CHECK(split_lines(read_text(folder / "out/trajectory_tum.txt")).size() == 300);
  CHECK_THAT(read_text(folder / "run.json"), Catch::Contains("\"state\": \"failed\""));
}

TEST_CASE("demo.sh does not remove a folder that it did not write", "[faults]") {
  const TemporaryFolder folder;
  fs::create_directories(folder / "demo/sequence_4_0.2");
  write_text(folder / "demo/sequence_4_0.2/mine.txt", "mine");
  const std::string command = fmt::format("FRAMES=4 SCALE=0.2 STEREO_SLAM={} {} {} >/dev/null 2>&1",
                                          STEREO_SLAM_PROGRAM, STEREO_SLAM_DEMO, (folder / "demo").string());
  CHECK(std::system(command.c_str()) != 0);
  CHECK(read_text(folder / "demo/sequence_4_0.2/mine.txt") == "mine");
  fs::remove_all(folder / "demo");
  CHECK(std::system(command.c_str()) == 0);
  fs::remove(folder / "demo/sequence_4_0.2/image_0/000002.png");
  CHECK(std::system(command.c_str()) == 0);
}

TEST_CASE("A recording whose name is not UTF-8 leaves a run.yaml that is", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "caf\xe9", 2);
  REQUIRE(call({"run", "--dataset", folder / "caf\xe9", "--output", folder / "out", "--quiet"}).status == 0);
  CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("/caf\xef\xbf\xbd\"\n"));
  CHECK(call({"compare", folder / "out", "--output", folder / "page.html"}).status == 0);
}
