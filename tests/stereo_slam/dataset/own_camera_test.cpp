// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/own_camera.hpp"

#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// Writes a recording of four frames, breaks it, and returns what opening it says.
std::string folder_error_after(const std::function<void(const fs::path&)>& breaking) {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 4);
  breaking(folder.path());
  auto message = message_of([&] { (void)open_sequence(folder.path(), "auto"); });
  CHECK(std::count(message.begin(), message.end(), '\n') == 0);
  return message;
}

std::string error_with(const std::string& calibration) {
  return folder_error_after(
      [&](const fs::path& folder) { write_text(folder / "calibration.yaml", calibration); });
}

/// The two cameras of the tiny recording with everything there is to say about them.
const std::string kRawCalibration =
    "left:\n"
    "  resolution: [320, 120]\n"
    "  intrinsics: [200, 200, 160, 60]\n"
    "  distortion_model: radtan\n"
    "  distortion_coefficients: [0, 0, 0, 0, 0]\n"
    "right:\n"
    "  resolution: [320, 120]\n"
    "  intrinsics: [200, 200, 160, 60]\n"
    "  distortion_model: none\n"
    "T_right_left: [1, 0, 0, -0.4, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
    "T_body_left: [[0, 0, 1, 0.1], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]]\n"
    "frame_rate_hz: 10\n";

}  // namespace

TEST_CASE("Two folders and a calibration are a recording", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 4);
  for (const auto& path : {folder.path(), folder / "calibration.yaml"}) {
    const auto sequence = open_sequence(path, "auto");
    CHECK(sequence.format == "folders");
    CHECK(sequence.frames.size() == 4);
    CHECK(sequence.frames[3].stamp_ns == 300'000'000);
    CHECK(sequence.camera.width_px == TinySequence::kWidth);
    CHECK(sequence.camera.baseline_m == 0.4);
    CHECK_FALSE(sequence.rectifier);
    CHECK(cv::norm(load_frame(sequence, 1).left,
                   cv::imread((folder / "left" / frame_name(1)).string(), cv::IMREAD_GRAYSCALE),
                   cv::NORM_INF) == 0.0);
  }
}

TEST_CASE("Raw images of an own camera are rectified, and its body is known", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 2);
  write_text(folder / "calibration.yaml", kRawCalibration);
  const auto sequence = open_sequence(folder.path(), "folders");
  REQUIRE(sequence.rectifier);
  CHECK(sequence.camera.baseline_m == Approx(0.4));
  REQUIRE(sequence.T_body_camera);
  CHECK((*sequence.T_body_camera * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(1.1, 0, 0), 1e-9));
}

TEST_CASE("Stamps come from a file, from the names or from the rate", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  write_text(folder / "calibration.yaml", tiny_calibration("times: times.txt\n"));
  write_text(folder / "times.txt", "5.5\n6\n8.25\n");
  CHECK(open_sequence(folder.path(), "auto").frames[2].stamp_ns == 8'250'000'000);
  write_text(folder / "calibration.yaml", tiny_calibration(""));
  for (const auto* side : {"left", "right"}) {
    for (int i = 0; i < 3; ++i)
      fs::rename(folder / side / frame_name(i), folder / side / (tiny_stamp(i) + ".png"));
  }
  CHECK(open_sequence(folder.path(), "auto").frames[2].stamp_ns == 1'000'000'000'200'000'000);
}

TEST_CASE("A file of times with two columns, or cut off, is refused", "[folders]") {
  const auto error_of_times = [](const std::string& times) {
    return folder_error_after([&](const fs::path& folder) {
      write_text(folder / "t.txt", times);
      write_text(folder / "calibration.yaml", tiny_calibration("times: t.txt\n"));
    });
  };
  CHECK_THAT(error_of_times("0.0 5\n0.1 6\n0.2 7\n0.3 8\n"),
             Catch::Contains("t.txt:1: '0.0 5' is not one time in seconds"));
  CHECK_THAT(error_of_times("0.00\n0.10\n0.20\n0.3"),
             Catch::Contains("t.txt:4: the last line has no line end and fewer digits"));
  CHECK(error_of_times("0.0\n0.1\n0.2\n0.3").empty());
}

TEST_CASE("Images are paired by name, else by natural order", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 12);
  fs::remove(folder / "right" / frame_name(4));
  fs::remove(folder / "left" / frame_name(7));
  write_text(folder / "left/notes.txt", "no image");
  auto scan = scan_sequence(folder.path(), "auto");
  CHECK(scan.sequence.frames.size() == 10);
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text, Catch::Contains("2 images have no partner"));
  write_tiny_folders(folder / "b", 12);
  for (int i = 0; i < 12; ++i) {
    for (const auto* side : {"left", "right"})
      fs::rename(folder / "b" / side / frame_name(i), folder / "b" / side / fmt::format("{}{}.png", side, i));
  }
  scan = scan_sequence(folder / "b", "auto");
  CHECK(scan.problems.empty());
  REQUIRE(scan.sequence.frames.size() == 12);
  CHECK(scan.sequence.frames[9].left.filename() == "left9.png");
  CHECK(scan.sequence.frames[10].left.filename() == "left10.png");
  CHECK(scan.sequence.frames[10].right.filename() == "right10.png");
}

TEST_CASE("Stamps that come in bursts are named, and pauses and missing frames are not", "[folders]") {
  const TemporaryFolder folder;
  constexpr int kFrames = 24;
  write_tiny_folders(folder.path(), kFrames);
  write_text(folder / "calibration.yaml", tiny_calibration("times: times.txt\n"));
  const auto problems = [&](const auto& time_s) {
    std::string text;
    for (int i = 0; i < kFrames; ++i) text += fmt::format("{:.6f}\n", time_s(i));
    write_text(folder / "times.txt", text);
    std::string all;
    for (const auto& problem : scan_sequence(folder.path(), "auto").problems) all += problem.text;
    return all;
  };
  CHECK_THAT(problems([](int i) { return 0.4 * (i / 4) + 0.001 * (i % 4); }),
             Catch::Contains("come 0.001 s or less after the one before, and a fifth 0.397 s or more") &&
                 !Catch::Contains("check their unit"));
  CHECK_THAT(problems([](int i) { return 0.1 * i + 0.08 * (i % 2); }), Catch::Contains("stamped on arrival"));
  CHECK(problems([](int i) { return 0.1 * i + 0.05 * (i % 2); }).empty());
  CHECK(problems([](int i) { return 0.1 * i + (i > 9 ? 60.0 : 0.0); }).empty());
  CHECK(problems([](int i) { return 0.1 * i + 0.1 * (i / 2); }).empty());
}

TEST_CASE("The time between two frames in place of the frame rate is told", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  write_text(folder / "calibration.yaml", tiny_calibration("frame_rate_hz: 0.1\n"));
  const auto scan = scan_sequence(folder.path(), "auto");
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text, Catch::Contains("its stamps are 10 s apart, 0.1 frames per second"));
}

TEST_CASE("Stamps leave time for images that are missing", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 12);
  fs::remove(folder / "right" / frame_name(4));
  auto scan = scan_sequence(folder.path(), "auto");
  REQUIRE(scan.sequence.frames.size() == 11);
  CHECK(scan.sequence.frames[3].stamp_ns == 300'000'000);
  CHECK(scan.sequence.frames[4].stamp_ns == 500'000'000);
  fs::remove(folder / "left" / frame_name(4));
  fs::remove(folder / "left" / frame_name(9));
  fs::remove(folder / "right" / frame_name(9));
  scan = scan_sequence(folder.path(), "auto");
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text, Catch::Contains("left: 2 numbers are missing among the names"));
  CHECK(scan.sequence.frames.back().stamp_ns == 1'100'000'000);

  write_text(folder / "calibration.yaml", tiny_calibration("times: times.txt\n"));
  std::string times;
  for (int i = 0; i < 12; ++i) times += fmt::format("{}\n", 2 * i);
  write_text(folder / "times.txt", times);
  CHECK(open_sequence(folder.path(), "auto").frames[4].stamp_ns == 10'000'000'000);
}

TEST_CASE("Every second image of a recording has no gaps", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 4);
  for (const auto* side : {"left", "right"}) {
    for (int i = 3; i >= 0; --i)
      fs::rename(folder / side / frame_name(i), folder / side / fmt::format("frame_{}.png", 10 + 2 * i));
  }
  const auto scan = scan_sequence(folder.path(), "auto");
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.frames[3].stamp_ns == 300'000'000);
}

TEST_CASE("Stamps in another unit, and a calibration of another camera, give a warning", "[folders]") {
  const auto warning_with = [](const std::string& calibration) {
    const TemporaryFolder folder;
    write_tiny_folders(folder.path(), 3);
    write_text(folder / "calibration.yaml", calibration + "frame_rate_hz: 10\n");
    const auto scan = scan_sequence(folder.path(), "auto");
    REQUIRE(scan.problems.size() == 1);
    CHECK_FALSE(is_error(scan.problems[0]));
    return scan.problems[0].text;
  };
  CHECK_THAT(warning_with("rectified: {fx: 20000, fy: 20000, cx: 160, cy: 60, baseline_m: 0.4}\n"),
             Catch::Contains("a field of view of 0.917 degrees"));
  CHECK_THAT(warning_with("rectified: {fx: 20, fy: 20, cx: 160, cy: 60, baseline_m: 0.4}\n"),
             Catch::Contains("a field of view of 166 degrees"));
  CHECK_THAT(
      warning_with("rectified: {fx: 200, fy: 200, cx: 60, cy: 110, baseline_m: 0.4}\n"),
      Catch::Contains("the principal point (60, 110) for images of 320x120 px, far from their middle"));
  CHECK_THAT(
      warning_with("rectified: {fx: 400, fy: 400, cx: 310, cy: 118, baseline_m: 0.4}\n"),
      Catch::Contains("looks made for images of about 625x234 px; use images of that size, or multiply"));
  CHECK_THAT(warning_with("rectified: {fx: 100, fy: 100, cx: 80, cy: 30, baseline_m: 0.4}\n"),
             Catch::Contains("looks made for images of about 160x60 px") && Catch::Contains("about 2.00"));
  for (const auto* centre : {"cx: 107, cy: 40", "cx: 142, cy: 53.3", "cx: 240, cy: 90"}) {
    CHECK_THAT(warning_with(fmt::format("rectified: {{fx: 200, fy: 200, {}, baseline_m: 0.4}}\n", centre)),
               Catch::Contains("the calibration looks made for images of about"));
  }
  CHECK_THAT(warning_with("rectified: {fx: 200, fy: 200, cx: 160, cy: 80, baseline_m: 0.4}\n"),
             Catch::Contains("subtract from cy the rows that were cut off at the top"));
  CHECK_THAT(warning_with("rectified: {fx: 200, fy: 200, cx: 130, cy: 60, baseline_m: 0.4}\n"),
             Catch::Contains("subtract from cx the columns that were cut off at the left"));
  CHECK_THAT(warning_with("rectified: {fx: 200, fy: 200, cx: 62, cy: 119, baseline_m: 0.4}\n"),
             Catch::Contains("far from their middle; check that"));
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  write_text(folder / "calibration.yaml", tiny_calibration(""));
  write_text(folder / "calibration.yaml", tiny_calibration("times: t.txt\n"));
  write_text(folder / "t.txt", "0\n100\n200\n");  // in milliseconds
  const auto recognised = scan_sequence(folder.path(), "auto");
  REQUIRE(recognised.problems.size() == 1);
  CHECK_THAT(recognised.problems[0].text, Catch::Contains("t.txt: its times are taken as milliseconds"));
  write_text(folder / "calibration.yaml", tiny_calibration("frame_rate_hz: 0.05\n"));
  const auto slow = scan_sequence(folder.path(), "auto");
  REQUIRE(slow.problems.size() == 1);
  CHECK_THAT(slow.problems[0].text, Catch::Contains("0.05 frames per second") &&
                                        Catch::Contains("those in times.txt are in seconds"));
}

TEST_CASE("A wrong calibration of an own camera is refused with file and line", "[folders]") {
  const auto raw = [](const std::string& what, const std::string& by) {
    std::string text = kRawCalibration;
    return error_with(text.replace(text.find(what), what.size(), by));
  };
  CHECK_THAT(error_with(""), Catch::Contains("calibration.yaml:1: the file must contain `key: value` lines"));
  CHECK_THAT(error_with("frame_rate_hz: 10\n"), Catch::Contains("neither 'left' nor 'rectified'"));
  CHECK_THAT(error_with("a: [\n"), Catch::Contains("calibration.yaml:") && Catch::Contains("not valid YAML"));
  CHECK_THAT(error_with(tiny_calibration("fps: 10\n")),
             Catch::Contains("calibration.yaml:2: ") && Catch::Contains("unknown key fps"));
  for (const auto* rectified : {"{fx: 200,5, fy: 200,5, cx: 160, cy: 60, baseline_m: 0.4}",
                                "{fx: 200, fy: 200, cx: 160, cy: 60, baseline_m: 0,4}"})
    CHECK_THAT(
        error_with(fmt::format("rectified: {}\nframe_rate_hz: 10\n", rectified)),
        Catch::Contains("calibration.yaml:1: ") && Catch::Contains("decimals have a point: 0.5, not 0,5"));
  CHECK_THAT(error_with(tiny_calibration("")), Catch::Contains("has no times; add frame_rate_hz"));
  CHECK_THAT(error_with(tiny_calibration("frame_rate_hz: -1\n")),
             Catch::Contains("calibration.yaml:2: frame_rate_hz is -1, but must be from"));
  CHECK_THAT(error_with(tiny_calibration("times: t.txt\n")), Catch::Contains("t.txt: missing"));
  CHECK_THAT(
      error_with("rectified: {fx: nan, fy: 200, cx: 160, cy: 60, baseline_m: 0.4}\nframe_rate_hz: 10\n"),
      Catch::Contains("calibration.yaml:1: fx holds 'nan'"));
  CHECK_THAT(
      error_with("rectified: {fx: 200, fy: 200, cx: 160, cy: 60, baseline_m: -0.4}\nframe_rate_hz: 10\n"),
      Catch::Contains("baseline_m is -0.4, but must be positive"));
  CHECK_THAT(error_with("rectified: {fx: 200, fy: 200, cx: 160, cy: 60}\nframe_rate_hz: 10\n"),
             Catch::Contains("has no baseline_m"));
  CHECK_THAT(error_with("rectified: {fx: 200, fy: 200, cx: 960, cy: 60, baseline_m: 1}\nframe_rate_hz: 10\n"),
             Catch::Contains("the principal point (960, 60) lies outside the 320x120 images"));
  CHECK_THAT(error_with(tiny_calibration() + "T_right_left: [1]\n"),
             Catch::Contains("yaml:3: T_right_left is of raw"));
  CHECK_THAT(raw("-0.4", "0.4"), Catch::Contains("the transformation between the cameras looks inverted"));
  CHECK_THAT(raw("T_right_left", "T_left_right"), Catch::Contains("unknown key T_left_right"));
  CHECK_THAT(error_with("{\"batchName\": \"\", \"cameraData\": []}"),
             Catch::Contains("is no calibration of a program that is known (its first key is batchName)"));
  CHECK_THAT(raw("1, 0.1]", "1, 1e300]"),
             Catch::Contains("calibration.yaml:11: T_body_left has a translation of 1e+300 m; give it in"));
  CHECK_THAT(raw("radtan", "brown"), Catch::Contains("calibration.yaml:4: distortion_model is brown"));
  CHECK_THAT(raw("resolution: [320, 120]", "resolution: [640, 120]"), Catch::Contains("640x120"));
}

TEST_CASE("Where a source or a calibration is missing, what is there is named", "[folders]") {
  CHECK_THAT(
      folder_error_after([](const fs::path& folder) { fs::rename(folder / "left", folder / "Left"); }),
      Catch::Contains("left: neither a folder") && Catch::Contains(" has Left/, right/, calibration.yaml"));
  CHECK_THAT(folder_error_after([](const fs::path& folder) {
               fs::rename(folder / "left", folder / "data");
               fs::create_directory(folder / "left");
               fs::rename(folder / "data", folder / "left/data");
             }),
             Catch::Contains("left: contains no images (png, jpg, pgm, bmp, tif); it has data/"));
  CHECK_THAT(
      folder_error_after([](const fs::path& folder) {
        fs::rename(folder / "calibration.yaml", folder / "stereo_calib.yaml");
      }),
      Catch::Contains("no calibration under a name that is looked for, such as calibration.yaml; it has "
                      "left/, right/, stereo_calib.yaml; name the calibration: --calibration FILE"));
}

TEST_CASE("Folders under other names are proposed as sources if they tell their sides", "[folders]") {
  const auto proposed = [](const std::string& left, const std::string& right) {
    return folder_error_after([&](const fs::path& folder) {
      fs::create_directories((folder / left).parent_path());
      fs::rename(folder / "left", folder / left);
      fs::rename(folder / "right", folder / right);
    });
  };
  for (const auto& [left, right] : {std::pair("cam0", "cam1"),
                                    {"infra1", "infra2"},
                                    {"image_left", "image_right"},
                                    {"LEFT", "RIGHT"},
                                    {"l", "r"},
                                    {"img_l", "img_r"},
                                    {"stereo/left", "stereo/right"}}) {
    CAPTURE(left);
    CHECK_THAT(
        proposed(left, right),
        Catch::Contains(fmt::format("add 'left: {{source: {}}}' and 'right: {{source: {}}}'", left, right)));
  }
  CHECK_THAT(proposed("x", "y"), !Catch::Contains("add 'left:"));
}

TEST_CASE("A recording one or two levels above or below the folder is named", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "day/a", 3);
  const std::string recording = (folder / "day/a").string();
  const auto error_of = [](const fs::path& given) {
    return message_of([&] { (void)open_sequence(given, "auto"); });
  };
  for (const auto* given : {"day/a/left", "day/a/left/", "day", ""}) {
    CAPTURE(given);
    CHECK_THAT(error_of(folder / given), Catch::Contains("not a recording of a known layout") &&
                                             Catch::Contains("the recording may be " + recording));
  }
  write_tiny_folders(folder / "day/b", 3);
  CHECK_THAT(error_of(folder / "day"),
             Catch::Contains("the recording may be " + recording + " or 1 other folder"));
  write_text(folder / "a.zip", "PK");
  CHECK_THAT(error_of(folder / "a.zip"), Catch::Contains("unpack archives"));
}

TEST_CASE("A baseline that was multiplied by the focal length is suspected", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  write_text(folder / "calibration.yaml",
             "rectified: {fx: 200, fy: 200, cx: 160, cy: 60, baseline_m: 80}\nframe_rate_hz: 10\n");
  const auto scan = scan_sequence(folder.path(), "auto");
  REQUIRE(scan.problems.size() == 1);
  CHECK_FALSE(is_error(scan.problems[0]));
  CHECK_THAT(scan.problems[0].text, Catch::Contains("a baseline of 80 m") &&
                                        Catch::Contains("divide it by the focal length (to 0.4 m)"));
}

TEST_CASE("Missing image sources, and two of different kinds, are refused", "[folders]") {
  CHECK_THAT(
      folder_error_after([](const fs::path& folder) { fs::remove_all(folder / "right"); }),
      Catch::Contains("right: neither a folder of images nor a video; correct 'source' in calibration.yaml"));
  CHECK_THAT(folder_error_after([](const fs::path& folder) {
               fs::remove_all(folder / "right");
               fs::create_directory(folder / "right");
             }),
             Catch::Contains("right: contains no images"));
  CHECK_THAT(error_with(tiny_calibration("frame_rate_hz: 10\nright: {source: left}\n")),
             Catch::Contains("is the source of both cameras"));
  CHECK_THAT(folder_error_after([](const fs::path& folder) {
               for (int i = 0; i < 4; ++i)
                 fs::rename(folder / "left" / frame_name(i), folder / fmt::format("left/l{}.png", "abcd"[i]));
               fs::remove(folder / "left/lc.png");
             }),
             Catch::Contains("holds 3 images and") && Catch::Contains("without a name in common"));
  CHECK_THAT(folder_error_after([](const fs::path& folder) {
               for (int i = 1; i < 4; ++i) fs::remove(folder / "left" / frame_name(i));
             }),
             Catch::Contains("contains one frame; a sequence needs at least two frames"));
}

TEST_CASE("A truncated JPEG is refused", "[folders]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  for (const auto* side : {"left", "right"}) {
    for (int i = 0; i < 3; ++i) {
      const auto png = folder / side / frame_name(i);
      cv::imwrite((folder / side / fmt::format("{}.jpg", i)).string(),
                  cv::imread(png.string(), cv::IMREAD_GRAYSCALE));
      fs::remove(png);
    }
  }
  const auto sequence = open_sequence(folder.path(), "auto");
  CHECK(load_frame(sequence, 2).left.size() == cv::Size(TinySequence::kWidth, TinySequence::kHeight));
  truncate_file(folder / "right/2.jpg", 0.6);
  CHECK_THAT(message_of([&] { (void)load_frame(sequence, 2); }),
             Catch::Contains("right/2.jpg: the JPEG is truncated"));
}
