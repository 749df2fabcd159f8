// SPDX-License-Identifier: MIT
// The program as scripts see it: exit status, standard output, standard error, files.
#include <csignal>
#include <sys/wait.h>
#include <unistd.h>

#include "stereo_slam/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam::test;

namespace {

struct Result {
  int status = -1;
  std::string out;
  std::string err;
};

/// A running stereo_slam with its output in files.
class Program {
 public:
  Program(const fs::path& folder, std::vector<std::string> arguments)
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

Result call(std::vector<std::string> arguments) {
  const TemporaryFolder folder;
  return Program(folder.path(), std::move(arguments)).wait();
}

/// A failure is one line on standard error that begins with the program's name.
void check_one_line_failure(const Result& result, const std::string& part) {
  CAPTURE(result.out, result.err);
  CHECK(result.status == 1);
  CHECK(split_lines(result.err).size() == 1);
  CHECK_THAT(result.err, Catch::StartsWith("stereo_slam: ") && Catch::Contains(part));
}

}  // namespace

TEST_CASE("Help and version are no failures", "[cli]") {
  CHECK_THAT(call({"--help"}).out, Catch::Contains("simulate"));
  CHECK(call({"run", "--help"}).status == 0);
  CHECK(call({"--version"}).status == 0);
}

TEST_CASE("Wrong usage has status 2", "[cli]") {
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"fly"},
      {"run"},
      {"run", "--dataset", "x"},
      {"run", "--dataset", "x", "--output", "y", "--preset", "none"},
      {"run", "--dataset", "x", "--output", "y", "--threads", "0"},
      {"run", "--dataset", "x", "--output", "y", "--max-frames", "-3"},
      {"info"},
      {"info", "--dataset", "x", "--format", "rosbag"},
      {"evaluate", "--groundtruth", "x"},
      {"evaluate", "--groundtruth", "x", "--estimate", "y", "--format", "csv"},
      {"simulate"},
      {"simulate", "--output", "x", "--frames", "many"},
      {"simulate", "--output", "x", "--distortion", "radtan"},
      {"run", "--dataset", "x", "--output", "y", "--pose-frame", "world"},
      {"info", "--dataset", "x", "--bogus"}};
  for (const auto& arguments : wrong) {
    CAPTURE(arguments);
    const auto result = call(arguments);
    CHECK(result.status == 2);
    CHECK_FALSE(result.err.empty());
  }
}

TEST_CASE("run, evaluate and info work together from the command line", "[cli]") {
  const TemporaryFolder folder;
  const std::string in = folder / "in";
  const std::string out = folder / "out";
  write_tiny_sequence(in, 6);
  const auto info = call({"info", "--dataset", in});
  CHECK(info.status == 0);
  CHECK(info.err.empty());

  const auto run = call({"run", "--dataset", in, "--format", "kitti", "--preset", "default", "--output", out,
                         "--threads", "2", "--no-loop-closure"});
  CHECK(run.status == 0);
  CHECK(run.err.empty());
  CHECK_THAT(run.out, Catch::Contains("frame 6/6") && Catch::Contains("6 frames in"));

  for (const auto* estimate : {"/trajectory_kitti.txt", "/trajectory_tum.txt"}) {
    const bool stamped = std::string(estimate).find("tum") != std::string::npos;
    const auto truth = stamped ? out + "/trajectory_online.txt" : in + "/poses.txt";
    const auto evaluate =
        call({"evaluate", "--groundtruth", truth, "--estimate", out + estimate, "--json", folder / "e.json"});
    CAPTURE(evaluate.err);
    CHECK(evaluate.status == 0);
    CHECK_THAT(evaluate.out, Catch::Contains("frames matched                  6"));
    CHECK_THAT(read_text(folder / "e.json"), Catch::Contains("\"frames_matched\": 6"));
  }
}

TEST_CASE("A quiet run prints nothing", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  const auto run = call({"run", "--dataset", folder / "in", "--output", folder / "out", "--quiet"});
  CHECK(run.status == 0);
  CHECK(run.out.empty());
  CHECK(run.err.empty());
}

TEST_CASE("Loops are closed as the settings say, unless the command line says otherwise", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  write_text(folder / "off.yaml", "loop_closure: {enabled: false}\n");
  const auto enabled = [&](std::vector<std::string> options) {
    std::vector<std::string> arguments = {"run", "--dataset", folder / "in", "--output", folder / "out"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    CHECK(call(arguments).status == 0);
    const auto yaml = read_text(folder / "out/run.yaml");
    return yaml.find("enabled: true", yaml.find("loop_closure:")) ==
           yaml.find("enabled: ", yaml.find("loop_closure:"));
  };
  CHECK(enabled({}));
  CHECK_FALSE(enabled({"--no-loop-closure"}));
  CHECK_FALSE(enabled({"--config", folder / "off.yaml"}));
  CHECK(enabled({"--config", folder / "off.yaml", "--loop-closure"}));
  CHECK(read_text(folder / "out/loops.csv") == "frame,old_frame,inliers,chi2,verdict\n");
}

TEST_CASE("Printed settings are a settings file", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  const auto printed = call({"--print-settings", "paper"});
  CHECK(printed.status == 0);
  write_text(folder / "s.yaml", printed.out);
  const auto run =
      call({"run", "--dataset", folder / "in", "--output", folder / "out", "--config", folder / "s.yaml"});
  CHECK(run.err.empty());
  CHECK(run.status == 0);
  CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("preset: paper"));
}

TEST_CASE("Broken input gives one line and status 1, from run and from info", "[cli]") {
  struct Case {
    const char* part;
    std::function<void(const fs::path&)> breaking;
  };
  const auto rename_images = [](const fs::path& f) {
    fs::rename(f / "image_0", f / "x");
    fs::rename(f / "image_1", f / "image_0");
    fs::rename(f / "x", f / "image_1");
  };
  const std::vector<Case> cases = {
      {"no such folder", [](const fs::path& f) { fs::remove_all(f); }},
      {"calib.txt: missing", [](const fs::path& f) { fs::remove(f / "calib.txt"); }},
      {"baseline of zero",
       [](const fs::path& f) {
         write_text(f / "calib.txt", projection_line("P0", 0) + projection_line("P1", 0));
       }},
      {"look swapped", rename_images},
      {"image_1/000002.png: missing", [](const fs::path& f) { fs::remove(f / "image_1/000002.png"); }},
      {"image_0/000002.png: the PNG is truncated",
       [](const fs::path& f) { truncate_file(f / "image_0/000002.png", 0.6); }},
      {"000003.png: is 200x120",
       [](const fs::path& f) { cv::imwrite((f / "image_0/000003.png").string(), tiny_texture(200)); }},
      {"times.txt:3: 'noon' is not",
       [](const fs::path& f) { write_text(f / "times.txt", "0\n1\nnoon\n3\n4\n"); }},
      {"has 3 times for 5 images", [](const fs::path& f) { write_text(f / "times.txt", "0\n1\n2\n"); }},
      {"is empty",
       [](const fs::path& f) { fs::remove_all(f / "image_0"), fs::create_directory(f / "image_0"); }},
      {"single frame", [](const fs::path& f) { fs::remove_all(f), write_tiny_sequence(f, 1); }},
  };
  for (const auto& [part, breaking] : cases) {
    CAPTURE(part);
    const TemporaryFolder folder;
    write_tiny_sequence(folder / "in", 5);
    breaking(folder / "in");
    check_one_line_failure(call({"info", "--dataset", folder / "in"}), part);
    check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "out"}), part);
  }
}

TEST_CASE("Broken EuRoC recordings and own cameras give one line and status 1, from run and from info",
          "[cli]") {
  struct Case {
    const char* part;
    std::function<void(const fs::path&)> breaking;
  };
  const auto sensor = [](const char* what, const char* by) {
    return [=](const fs::path& f) { replace_in(f / "mav0/cam1/sensor.yaml", what, by); };
  };
  const auto image = [](const fs::path& f, int i) { return f / "mav0/cam1/data" / (tiny_stamp(i) + ".png"); };
  const auto own = [](const std::string& left) {
    return [=](const fs::path& f) {
      fs::remove_all(f / "mav0");
      write_tiny_folders(f, 3);
      write_text(f / "calibration.yaml",
                 tiny_calibration("frame_rate_hz: 10\nleft: {source: " + left + "}\n"));
      write_text(f / "noise.mp4", "no video");
    };
  };
  const std::vector<Case> cases = {
      {"cam1/data.csv:4: ", [&](const fs::path& f) { fs::remove(image(f, 2)); }},
      {"the PNG is truncated", [&](const fs::path& f) { truncate_file(image(f, 3), 0.5); }},
      {"is 200x120 pixels", [&](const fs::path& f) { cv::imwrite(image(f, 3).string(), tiny_texture(200)); }},
      {"cam1/data.csv:5: ", [](const fs::path& f) { truncate_file(f / "mav0/cam1/data.csv", 0.8); }},
      {"cam0/data.csv: lists no images", [](const fs::path& f) { write_text(f / "mav0/cam0/data.csv", ""); }},
      {"intrinsics holds 'nan'", sensor("[200, 200,", "[nan, 200,")},
      {"distortion_model is cubic", sensor("radial-tangential", "cubic")},
      {"T_BS has 12 numbers", sensor("0, 0, 1, 0, 0, 0, 0, 1]", "0, 0, 1, 0]")},
      {"resolution is 300x100", sensor("[320, 120]", "[300, 100]")},
      {"noise.mp4: cannot be opened as a video", own("noise.mp4")},
      {"nowhere: neither a folder", own("nowhere")},
      {"left/1.pgm: the image cannot be decoded",
       [&](const fs::path& f) {
         own("left")(f);
         for (const auto* side : {"left", "right"}) {
           for (int i = 0; i < 3; ++i) {
             const auto png = f / side / frame_name(i);
             cv::imwrite((f / side / fmt::format("{}.pgm", i)).string(),
                         cv::imread(png.string(), cv::IMREAD_GRAYSCALE));
             fs::remove(png);
           }
         }
         truncate_file(f / "left/1.pgm", 0.5);
       }},
  };
  for (const auto& [part, breaking] : cases) {
    CAPTURE(part);
    const TemporaryFolder folder;
    write_tiny_euroc(folder / "in", 5);
    breaking(folder / "in");
    check_one_line_failure(call({"info", "--dataset", folder / "in"}), part);
    check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "out"}), part);
  }
}

TEST_CASE("Rows without a partner are a warning of run and info", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder / "in", 5);
  replace_in(folder / "in/mav0/cam1/data.csv", tiny_stamp(1) + ",", "1000000000150000000,");
  const auto info = call({"info", "--dataset", folder / "in"});
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains("frames        4") && Catch::Contains("data.csv:3: 1 of 5 rows"));
  const auto run = call({"run", "--dataset", folder / "in", "--output", folder / "out"});
  CHECK(run.status == 0);
  CHECK(split_lines(run.err).size() == 2);
  CHECK_THAT(run.err,
             Catch::Contains("cam0/data.csv:3: 1 of 5 rows") && Catch::Contains("cam1/data.csv:3: 1 of 5"));
}

TEST_CASE("A calibration that does not rectify the images is a warning of run and info", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder / "in", 3);
  replace_in(folder / "in/mav0/cam1/sensor.yaml", "0, 1, 0, 0,\n    0, 0, 1, 0",
             "0, 0.99985, -0.01745, 0,\n    0, 0.01745, 0.99985, 0");  // a degree about x
  const auto info = call({"info", "--dataset", folder / "in"});
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains("warning") && Catch::Contains("px apart in row"));
  const auto run = call({"run", "--dataset", folder / "in", "--output", folder / "out"});
  CHECK(run.status == 0);
  const auto warnings = split_lines(run.err);
  REQUIRE(warnings.size() == 2);
  CHECK_THAT(warnings[0],
             Catch::Contains("px apart in row") && Catch::Contains("the calibration is of another camera"));
  CHECK_THAT(warnings[1], Catch::Contains("2 of 3 frames could not be tracked"));
}

TEST_CASE("simulate, info, run and evaluate work together on an EuRoC recording", "[cli]") {
  const TemporaryFolder folder;
  const auto simulated = call({"simulate", "--output", folder / "s", "--format", "euroc", "--distortion",
                               "equidistant", "--frames", "4", "--scale", "0.4", "--quiet"});
  CHECK(simulated.err.empty());
  CHECK(simulated.status == 0);
  const auto info = call({"info", "--dataset", folder / "s", "--write-groundtruth", folder / "truth.txt"});
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains("format        euroc") && Catch::Contains("from equidistant lenses") &&
                           Catch::Contains("row offset 0.") && Catch::Contains("verdict       usable"));
  for (const auto* frame : {"camera", "body"}) {
    const auto run = call({"run", "--dataset", folder / "s/mav0", "--output", folder / "o", "--quiet",
                           "--clahe", "--pose-frame", frame});
    CHECK(run.err.empty());
    CHECK(run.status == 0);
    CHECK_THAT(read_text(folder / "o/run.yaml"),
               Catch::Contains(fmt::format("pose_frame: {}", frame)) && Catch::Contains("clahe: true"));
    const auto truth = std::string(frame) == "camera"
                           ? folder / "truth.txt"
                           : folder / "s/mav0/state_groundtruth_estimate0/data.csv";
    const auto evaluate =
        call({"evaluate", "--groundtruth", truth, "--estimate", folder / "o/trajectory_tum.txt"});
    CHECK(evaluate.status == 0);
    CHECK_THAT(evaluate.out, Catch::Contains("frames matched                  4"));
  }
}

TEST_CASE("A run that fails at a frame saves those before it", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 5);
  truncate_file(folder / "in/image_1/000003.png", 0.5);
  check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "out"}),
                         "(the 3 frames before it are saved)");
  CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == 3);
}

TEST_CASE("Other failures are one line and status 1, too", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  write_text(folder / "bad.yaml", "features: {count: 1}\n");
  write_text(folder / "file", "");
  const std::string in = folder / "in";
  check_one_line_failure(
      call({"run", "--dataset", in, "--output", folder / "o", "--config", folder / "bad.yaml"}),
      "features.count");
  check_one_line_failure(
      call({"run", "--dataset", in, "--output", folder / "o", "--config", folder / "no.yaml"}), "no.yaml");
  check_one_line_failure(call({"run", "--dataset", in, "--output", folder / "file"}), "--output");
  check_one_line_failure(call({"run", "--dataset", in, "--output", folder / "o", "--format", "euroc"}),
                         "has no cam0 and cam1");
  check_one_line_failure(call({"run", "--dataset", in, "--output", folder / "o", "--pose-frame", "body"}),
                         "leave out --pose-frame body");
  check_one_line_failure(call({"info", "--dataset", in, "--write-groundtruth", folder / "no/such/place.txt"}),
                         "place.txt");
  check_one_line_failure(
      call({"evaluate", "--groundtruth", in + "/poses.txt", "--estimate", in + "/none.txt"}), "none.txt");
  check_one_line_failure(call({"simulate", "--output", folder / "s", "--trajectory", in + "/none.txt"}),
                         "none.txt");
}

TEST_CASE("--view without a display says so", "[cli]") {
  if (std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr) return;
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "o", "--view"}),
                         "--view");
}

TEST_CASE("SIGINT and SIGTERM end a run with status 130 and all finished frames saved", "[cli]") {
  constexpr int kFrames = 4000;
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  fs::remove(folder / "in/poses.txt");  // of two frames
  std::string times;
  for (int i = 0; i < kFrames; ++i) {  // the same two images over and over
    for (const auto* camera : {"in/image_0", "in/image_1"}) {
      if (i > 1) fs::create_hard_link(folder / camera / frame_name(i % 2), folder / camera / frame_name(i));
    }
    times += std::to_string(i) + "\n";
  }
  write_text(folder / "in/times.txt", times);
  for (const int number : {SIGINT, SIGTERM}) {
    const Program program(folder.path(), {"run", "--dataset", folder / "in", "--output", folder / "out"});
    program.wait_for_output("frame 1/");
    program.signal(number);
    const auto result = program.wait();
    CAPTURE(result.out, result.err);
    CHECK(result.status == 130);
    CHECK(result.err.empty());
    const auto poses = split_lines(read_text(folder / "out/trajectory_kitti.txt")).size();
    CHECK(poses >= 1);
    CHECK(poses < kFrames);
    CHECK(split_lines(read_text(folder / "out/timing.csv")).size() == poses + 1);
    CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("state: interrupted"));
  }
}

TEST_CASE("SIGINT ends a rendering with status 130 and a shorter recording", "[cli]") {
  const TemporaryFolder folder;
  const Program program(folder.path(),
                        {"simulate", "--output", folder / "s", "--frames", "2000", "--scale", "0.2"});
  program.wait_for_output("frame 50/");
  program.signal(SIGINT);
  CHECK(program.wait().status == 130);
  const auto info = call({"info", "--dataset", folder / "s"});
  CAPTURE(info.err);
  CHECK(info.status == 0);
}

TEST_CASE("simulate writes a recording that run and info accept", "[cli]") {
  const TemporaryFolder folder;
  const auto simulated =
      call({"simulate", "--output", folder / "s", "--frames", "3", "--scale", "0.25", "--quiet"});
  CHECK(simulated.err.empty());
  CHECK(simulated.status == 0);
  const auto info = call({"info", "--dataset", folder / "s"});
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains("310 x 94 px") && Catch::Contains("ground truth  3 poses"));
  CHECK(call({"run", "--dataset", folder / "s", "--output", folder / "o", "--quiet"}).status == 0);
}
