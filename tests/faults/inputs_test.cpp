// SPDX-License-Identifier: MIT
// Files that are not what they should be: each ends with one line, soon, and without much memory.
#include <opencv2/imgcodecs.hpp>

#include "stereo_slam/support/program.hpp"

using namespace stereo_slam::test;

TEST_CASE("YAML that refers to itself, is nested deep, twice there or huge is refused", "[faults]") {
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += '[';
  std::string laughs = "a: &a [1, 1]\n";
  for (char c = 'b'; c < 'z'; ++c)
    laughs += fmt::format("{0}: &{0} [*{1}, *{1}, *{1}, *{1}]\n", c, static_cast<char>(c - 1));
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"intrinsics: &a [*a, 1]\n", "refers to another part"},
      {laughs, "refers to another part"},
      {"a: " + deep, ""},
      {"seed: 1\n---\nseed: 2\n", "holds several documents"},
      {"seed: 1\nseed: 2\n", "seed is given twice"},
      {std::string(2 << 20, '#'), "is larger than 1048576 bytes"},
      {"seed: \"abc\nother: 1\n", "yaml:1: a quote is opened and not closed"},
      {"seed: 'abc\n", "yaml:1: a quote is opened and not closed"},
      {"seed: [1, 2\n", "opened with [ and not closed"},
      {"seed: {a: 1\n", "opened with { and not closed"},
      {"seed: 1\n\tother: 2\n", "begins with a tab"},
      {"odometry:\n\tmax_points: 5\n", ":2: not valid YAML: the line begins with a tab"},
  };
  for (const auto& [text, part] : cases) {
    const TemporaryFolder folder;
    write_tiny_sequence(folder / "in", 3);
    write_text(folder / "s.yaml", text);
    check_bounded_failure(
        {"run", "--dataset", folder / "in", "--output", folder / "out", "--config", folder / "s.yaml"}, part);
    write_tiny_euroc(folder / "euroc", 3);
    write_text(folder / "euroc/mav0/cam1/sensor.yaml", text);
    check_bounded_failure({"info", "--dataset", folder / "euroc"}, part);
    write_tiny_folders(folder / "own", 3);
    write_text(folder / "own/calibration.yaml", text);
    check_bounded_failure({"info", "--dataset", folder / "own"}, part);
  }
}

TEST_CASE("Text without line ends, and files without end, are refused", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  const std::string poses = folder / "in/poses.txt";
  write_text(folder / "long.txt", std::string(1 << 20, '7'));
  check_bounded_failure({"evaluate", "--groundtruth", folder / "long.txt", "--estimate", poses},
                        "long.txt:1: the line has 1048576 bytes");
  std::string lines;
  for (int i = 0; i < 20'000'000; ++i) lines += "a\n";
  write_text(folder / "lines.txt", lines);
  check_bounded_failure({"evaluate", "--groundtruth", folder / "lines.txt", "--estimate", poses},
                        "lines.txt: has more than 1000000 lines");
  write_text(folder / "sparse.txt", "");
  fs::resize_file(folder / "sparse.txt", std::uintmax_t{1} << 40);
  check_bounded_failure({"evaluate", "--groundtruth", folder / "sparse.txt", "--estimate", poses},
                        "is larger than 268435456 bytes");
  fs::resize_file(folder / "in/image_0/000001.png", std::uintmax_t{1} << 40);
  check_bounded_failure({"info", "--dataset", folder / "in"}, "is larger than");
}

TEST_CASE("Images and resolutions that do not fit into memory are refused by their headers", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "own", 3);
  const auto with_image = [&](const std::string& name, const std::string& bytes) {
    for (const auto* side : {"own/left", "own/right"}) {
      fs::remove_all(folder / side);
      fs::create_directories(folder / side);
      for (const auto* frame : {"0", "1"}) write_text(folder / side / (frame + name), bytes);
    }
    check_bounded_failure({"info", "--dataset", folder / "own"}, "images may have up to 134217728 pixels");
  };
  with_image(".pgm", "P5 60000 60000 255\nabc");
  with_image(".bmp", std::string("BM") + std::string(12, '\0') +
                         std::string("\x28\0\0\0\0\0\1\0\0\0\1\0", 12) + std::string(100, '\0'));
  with_image(".jpg", std::string("\xFF\xD8\xFF\xC0\0\x0B\x08\xFF\xFF\xFF\xFF\1\1\x11\0\xFF\xD9", 17));
  with_image(".tif", std::string("II*\0\x08\0\0\0\2\0", 10) +
                         std::string("\0\1\4\0\1\0\0\0\0\0\1\0\1\1\4\0\1\0\0\0\0\0\1\0\0\0\0\0", 28));
  write_tiny_euroc(folder / "euroc", 3);
  for (const auto* camera : {"cam0", "cam1"})
    replace_in(fs::path(folder / "euroc/mav0") / camera / "sensor.yaml", "[320, 120]", "[20000, 20000]");
  check_bounded_failure({"info", "--dataset", folder / "euroc"}, "resolution is 20000 x 20000");
}

TEST_CASE("Raw images that a run has no memory for are refused with the scale that fits", "[faults]") {
  if (kReservesAddresses) return;  // the sanitizer sets no limit that the program could see
  constexpr int kSide_px = 6000;
  const TemporaryFolder folder;
  for (const auto* side : {"left", "right"}) {
    fs::create_directories(folder / "in" / side);
    for (const auto* name : {"0.png", "1.png"})
      cv::imwrite((folder / "in" / side / name).string(),
                  cv::Mat(kSide_px, kSide_px, CV_8UC1, cv::Scalar(9)));
  }
  const std::string lens =
      "  resolution: [6000, 6000]\n  intrinsics: [6000, 6000, 3000, 3000]\n  distortion_model: radtan\n"
      "  distortion_coefficients: [-0.1, 0, 0, 0]\n";
  write_text(folder / "in/calibration.yaml",
             "left:\n" + lens + "right:\n" + lens +
                 "T_right_left: [1, 0, 0, -0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nframe_rate_hz: 10\n");
  check_bounded_failure({"run", "--dataset", folder / "in", "--output", folder / "out"}, "by --scale 0.8");
  const auto info = call({"info", "--dataset", folder / "in"}, bound_time_and_memory);
  CHECK_THAT(info.out, Catch::Contains("by --scale 0.8") && Catch::Contains("not usable"));
  const auto scaled = call({"info", "--dataset", folder / "in", "--scale", "0.1"}, bound_time_and_memory);
  CHECK_THAT(scaled.out, Catch::Contains("600 x 600 px, scaled from 6000 x 6000"));
}

TEST_CASE("Loops are scored in seconds for a hundred thousand poses", "[faults]") {
  const TemporaryFolder folder;
  const auto line = [](double x, double y) { return fmt::format("1 0 0 {} 0 1 0 0 0 0 1 {}\n", x, y); };
  std::string standing;
  std::string round;
  for (int i = 0; i < 100'000; ++i) {
    standing += line(0.01 * (i % 2), 0.0);
    round += line(100.0 * std::sin(0.01 * i), 100.0 * std::cos(0.01 * i));
  }
  write_text(folder / "loops.csv", "frame,old_frame,inliers,chi2,verdict,old_map,tx,ty,tz,qx,qy,qz,qw\n");
  for (const auto& text : {standing, round}) {
    write_text(folder / "poses.txt", text);
    const auto result = call({"evaluate", "--groundtruth", folder / "poses.txt", "--estimate",
                              folder / "poses.txt", "--loops", folder / "loops.csv"},
                             bound_time_and_memory);
    CHECK(result.status == 0);
  }
}

TEST_CASE("Numbers and stamps are taken as written, or refused", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  const std::vector<std::vector<std::string>> wrong = {
      {"run", "--dataset", folder / "in", "--output", folder / "o", "--max-frames", "99999999999999999999"},
      {"run", "--dataset", folder / "in", "--output", folder / "o", "--max-frames", "0x10"},
      {"run", "--dataset", folder / "in", "--output", folder / "o", "--max-frames", "010"},
      {"run", "--dataset", folder / "in", "--output", folder / "o", "--threads", "4294967297"},
      {"run", "--dataset", folder / "in", "--output", ""},
      {"run", "--dataset", folder / "in", "--output", folder / "o", "--save-map", ""},
      {"simulate", "--output", folder / "s", "--seed", "-1"},
      {"simulate", "--output", folder / "s", "--frames", "1e3"},
      {"simulate", "--output", folder / "s", "--fps", "0x10"},
      {"simulate", "--output", ""}};
  for (const auto& arguments : wrong) {
    CAPTURE(arguments);
    const auto result = call(arguments);
    CHECK(result.status == 2);
    CHECK(split_lines(result.err).size() == 1);
  }
  for (const auto* times : {"0\n1\n1e300\n", "0\n1\n9e9\n", "-9e9\n0\n1\n"}) {
    write_text(folder / "in/times.txt", times);
    check_bounded_failure({"info", "--dataset", folder / "in"}, "is not one time in seconds");
  }
  write_tiny_euroc(folder / "euroc", 3);
  replace_in(folder / "euroc/mav0/cam0/data.csv", tiny_stamp(2) + ",", "9223372036854775807,");
  check_bounded_failure({"info", "--dataset", folder / "euroc"}, "is not a stamp in nanoseconds");
  write_tiny_folders(folder / "own", 3);
  write_text(folder / "own/calibration.yaml", tiny_calibration("frame_rate_hz: 1e-300\n"));
  check_bounded_failure({"info", "--dataset", folder / "own"}, "frame_rate_hz is 1e-300");
  write_text(folder / "own/calibration.yaml", tiny_calibration());
  cv::imwrite((folder / "own/left/000001.jpg").string(), tiny_texture(320));
  check_bounded_failure({"info", "--dataset", folder / "own"}, "one image of a name must remain");
}

TEST_CASE("Contradictions and cut files are named", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 5);
  const std::string calib = read_text(folder / "in/calib.txt");
  write_text(folder / "in/calib.txt", calib + projection_line("P0", 0.0));
  check_bounded_failure({"info", "--dataset", folder / "in"}, "calib.txt:3: P0: is given twice");
  for (const auto& [fourth, baseline] : {std::pair{-22000.0, "110 m"}, std::pair{-0.4, "0.002 m"}}) {
    write_text(folder / "in/calib.txt", projection_line("P0", 0.0) + projection_line("P1", fourth));
    const auto info = call({"info", "--dataset", folder / "in"});
    CHECK_THAT(info.out,
               Catch::Contains(fmt::format("a baseline of {}; lengths must be in metres", baseline)));
  }
  write_text(folder / "in/calib.txt", calib);

  const std::string poses = read_text(folder / "in/poses.txt");
  write_text(folder / "cut.txt", poses.substr(0, poses.size() - 3));
  check_bounded_failure(
      {"evaluate", "--groundtruth", folder / "in/poses.txt", "--estimate", folder / "cut.txt"},
      "cut.txt:5: the last line has no line end");
  write_text(folder / "short.txt", poses.substr(0, poses.find('\n', 2 * poses.find('\n') + 5) + 1) + poses);
  const auto result =
      call({"evaluate", "--groundtruth", folder / "in/poses.txt", "--estimate", folder / "short.txt"});
  CHECK(result.status == 0);
  CHECK_THAT(result.err,
             Catch::Contains("warning: 5 ground-truth and") && Catch::Contains("paired from the first"));
}

TEST_CASE("Files that do not fit together are all named, with their sizes", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 5);
  CHECK(call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / "out"}).status == 0);
  const std::string truth = folder / "in/poses.txt", estimate = folder / "out/trajectory_kitti.txt";
  const auto evaluate = [&](const std::string& a, const std::string& b, const std::string& option = "",
                            const std::string& file = "") {
    std::vector<std::string> arguments = {"evaluate", "--groundtruth", a, "--estimate", b};
    if (!option.empty()) arguments.insert(arguments.end(), {option, file});
    return call(arguments, bound_time_and_memory);
  };
  check_one_line_failure(
      evaluate(truth, folder / "out/trajectory_tum.txt"),
      fmt::format("{} (5 poses) and {} (5 poses): ", truth, (folder / "out/trajectory_tum.txt").string()));
  const std::string rows = read_text(folder / "out/covariances.csv");
  write_text(folder / "cut.csv", rows.substr(0, rows.find('\n', rows.find('\n') + 1) + 1));
  check_one_line_failure(
      evaluate(truth, estimate, "--covariances", folder / "cut.csv"),
      fmt::format("{} (1 row) and {} (5 poses): ", (folder / "cut.csv").string(), estimate));
  write_text(folder / "loops.csv",
             read_text(folder / "out/loops.csv") + "99,3,20,1.0,accepted,run,0,0,0,0,0,0,1\n");
  check_one_line_failure(
      evaluate(truth, estimate, "--loops", folder / "loops.csv"),
      fmt::format("{} (1 loop) and {} (5 poses): ", (folder / "loops.csv").string(), estimate));
  fs::copy_file(folder / "cut.csv", folder / "out/covariances.csv", fs::copy_options::overwrite_existing);
  check_bounded_failure({"compare", folder / "out", "--output", folder / "c.html"},
                        "covariances.csv: has 1 row for 5 poses in trajectory_tum.txt");
}

TEST_CASE("Covariances of another run with as many frames are refused by their stamps", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 5);
  const auto run = [&](const std::string& times, const char* output) {
    write_text(folder / "in/times.txt", times);
    CHECK(call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / output}).status == 0);
  };
  run("1403715273.262142976\n1403715273.4\n1403715273.5\n1403715273.6\n1403715273.7\n", "out");
  CHECK(call({"run", "--quiet", "--preset", "odometry", "--dataset", folder / "in", "--output",
              folder / "truth"})
            .status == 0);
  run("1403715273.262142976\n1403715273.4\n1403715273.5\n1403715273.61\n1403715273.71\n", "other");
  const auto evaluate = [&](const char* estimate, const std::string& covariances) {
    return call({"evaluate", "--groundtruth", folder / "truth" / estimate, "--estimate",
                 folder / "out" / estimate, "--covariances", covariances});
  };
  const std::string own = folder / "out/covariances.csv", other = folder / "other/covariances.csv";
  CHECK(evaluate("trajectory_tum.txt", own).status == 0);
  CHECK(evaluate("trajectory_kitti.txt", own).status == 0);
  CHECK(evaluate("trajectory_kitti.txt", other).status == 0);  // without stamps, only the rows are counted
  const auto refused = evaluate("trajectory_tum.txt", other);
  check_one_line_failure(refused, fmt::format("{} (5 rows) and {} (5 poses): the stamp of frame 3 is", other,
                                              (folder / "out/trajectory_tum.txt").string()));
  CHECK_THAT(refused.err, Catch::Contains("1403715273.610000000") && Catch::Contains("of different runs"));

  const std::vector<std::string> compare = {"compare", folder / "out", "--output", folder / "c.html"};
  CHECK(call(compare).status == 0);
  write_text(folder / "later.txt", "9 0 0 0 0 0 0 1\n10 1 0 0 0 0 0 1\n11 2 0 0 0 0 0 1\n");
  const auto unmatched =
      call({"compare", folder / "out", "--output", folder / "c.html", "--groundtruth", folder / "later.txt"});
  CHECK(unmatched.status == 0);
  CHECK_THAT(unmatched.err, Catch::Contains("the page has no errors of this run: only 0 of 5"));
  fs::copy_file(other, own, fs::copy_options::overwrite_existing);
  check_bounded_failure(compare, "covariances.csv: the stamp of row 4 is '1403715273.610000000', and");
}

TEST_CASE("compare refuses a run.yaml that is not of a run, or was cut off", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  CHECK(call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / "out"}).status == 0);
  const auto compare_with = [&](const std::string& text, const char* part) {
    write_text(folder / "out/run.yaml", text);
    check_bounded_failure({"compare", folder / "out", "--output", folder / "c.html"}, part);
  };
  for (const auto* text :
       {"", "a: 1\n", "- 1\n", "version: 1\nsettings: {seed: 1}\n", "version: 1\nstate: x\n"})
    compare_with(text, "run.yaml: is not of a run");
  fs::remove_all(folder / "out");
  CHECK(call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / "out"}).status == 0);
  const std::string whole = read_text(folder / "out/run.yaml");
  compare_with(whole.substr(0, whole.find("\nsettings:") + 1), "run.yaml: is not of a run");
  compare_with(whole.substr(0, whole.find('\n', whole.size() / 2) - 1), "run.yaml:");  // inside a line
}

TEST_CASE("A run at the pace of the stamps does not wait for years", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  write_text(folder / "in/times.txt", "0\n0.1\n3e8\n");
  check_bounded_failure({"run", "--dataset", folder / "in", "--output", folder / "out", "--realtime"},
                        "frame 2 is 3e+08 s later than the frame before it");
}

TEST_CASE("A URL that is silent is given up within seconds", "[faults]") {
  const TemporaryFolder folder;
  write_text(folder / "c.yaml", tiny_calibration(""));
  check_bounded_failure({"info", "--dataset", "udp://127.0.0.1:9999", "--calibration", folder / "c.yaml"},
                        "cannot be opened");
}

TEST_CASE("Pixels that are far from square are named", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "own", 3);
  auto text = tiny_calibration();
  const auto at = text.find("fy: ");
  REQUIRE(at != std::string::npos);
  write_text(folder / "own/calibration.yaml", text.insert(at + 4, "1"));
  CHECK_THAT(call({"info", "--dataset", folder / "own"}).out,
             Catch::Contains("pixels are nearly square, so one of the two is wrong"));
}

TEST_CASE("Swapped cameras and right images of another frame are named", "[faults]") {
  const TemporaryFolder folder;
  CHECK(call({"simulate", "--quiet", "--output", folder / "kitti", "--frames", "6", "--scale", "0.35"})
            .status == 0);
  for (int i = 5; i > 0; --i)
    fs::copy_file(folder / "kitti/image_1" / frame_name(i - 1), folder / "kitti/image_1" / frame_name(i),
                  fs::copy_options::overwrite_existing);
  CHECK_THAT(call({"info", "--dataset", folder / "kitti"}).out, Catch::Contains("image_1 look 1 frame late"));
  const auto run =
      call({"run", "--dataset", folder / "kitti", "--output", folder / "out", "--max-frames", "2"});
  CHECK_THAT(run.err, Catch::Contains("image_1 look 1 frame late"));

  CHECK(call({"simulate", "--quiet", "--output", folder / "euroc", "--frames", "3", "--scale", "0.4",
              "--format", "euroc"})
            .status == 0);
  fs::rename(folder / "euroc/mav0/cam0/data", folder / "x");
  fs::rename(folder / "euroc/mav0/cam1/data", folder / "euroc/mav0/cam0/data");
  fs::rename(folder / "x", folder / "euroc/mav0/cam1/data");
  check_one_line_failure(call({"run", "--dataset", folder / "euroc", "--output", folder / "out2"}),
                         "cam0 and cam1 look swapped");
}

TEST_CASE("A run that could track nothing says so and fails; its results are there", "[faults]") {
  const TemporaryFolder folder;
  constexpr int kFrames = 5;
  for (const int grey : {0, 128, 255}) {
    CAPTURE(grey);
    fs::remove_all(folder / "in");
    write_tiny_sequence(folder / "in", kFrames);
    const cv::Mat image(TinySequence::kHeight, TinySequence::kWidth, CV_8UC1, cv::Scalar(grey));
    for (int i = 0; i < kFrames; ++i) {
      for (const auto* camera : {"image_0", "image_1"}) {
        cv::imwrite((folder / "in" / camera / frame_name(i)).string(), image);
      }
    }
    fs::remove_all(folder / "out");
    const auto run = call({"run", "--dataset", folder / "in", "--output", folder / "out", "--quiet", "--json",
                           folder / "run.json"});
    CHECK(run.status == 1);
    CHECK_THAT(run.err, Catch::Contains("tracked 0 of 5 frames") &&
                            Catch::Contains("(the results are in " + (folder.path() / "out)").string()));
    CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == kFrames);
    CHECK_THAT(read_text(folder / "out/run.yaml"),
               Catch::Contains("state: failed\nerror: \"tracked 0 of 5 frames: hardly"));
    CHECK_THAT(read_text(folder / "run.json"), Catch::Contains("\"state\": \"failed\"") &&
                                                   Catch::Contains("\"error\": \"tracked 0 of 5 frames"));
  }
}
