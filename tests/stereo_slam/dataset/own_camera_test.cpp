// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/own_camera.hpp"

#include "stereo_slam/images/video.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "stereo_slam/support/tiny_video.hpp"
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
  CHECK_THAT(raw("1, 0.1]", "1, 1e300]"),
             Catch::Contains("calibration.yaml:11: T_body_left has a translation of 1e+300 m; give it in"));
  CHECK_THAT(raw("radtan", "brown"), Catch::Contains("calibration.yaml:4: distortion_model is brown"));
  CHECK_THAT(raw("resolution: [320, 120]", "resolution: [640, 120]"), Catch::Contains("640x120"));
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

TEST_CASE("Two videos are a recording, readable in any order", "[video]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 6, 6);
  const auto scan = scan_sequence(folder.path(), "auto");
  CHECK(scan.problems.empty());
  const auto& sequence = scan.sequence;
  CHECK(sequence.format == "video");
  REQUIRE(sequence.frames.size() == 6);
  CHECK(sequence.frames[5].stamp_ns == 500'000'000);  // the rate is in the file
  for (const std::size_t i : {3U, 5U, 0U, 4U}) {
    const auto original =
        cv::imread((folder / "images_left" / frame_name(static_cast<int>(i))).string(), cv::IMREAD_GRAYSCALE);
    CHECK(cv::norm(load_frame(sequence, i).left, original, cv::NORM_L1) /
              static_cast<double>(original.total()) <
          3.0);
  }
}

TEST_CASE("Of two videos of different lengths the shorter one counts, with a warning", "[video]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 6, 4);
  const auto scan = scan_sequence(folder.path(), "video");
  CHECK(scan.sequence.frames.size() == 4);
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text,
             Catch::Contains("left.avi: has 6 frames and") && Catch::Contains("has 4"));
}

TEST_CASE("A video that cannot be opened is refused", "[video]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 3, 3);
  const auto error = [&] { return message_of([&] { (void)open_sequence(folder.path(), "auto"); }); };
  write_text(folder / "right.avi", "this is no video");
  CHECK_THAT(error(), Catch::Contains("right.avi: cannot be opened as a video"));
  write_text(folder / "right.avi", "");
  CHECK_THAT(error(), Catch::Contains("right.avi: "));
  fs::remove(folder / "right.avi");
  CHECK_THAT(error(), Catch::Contains("right: neither a folder of images nor a video"));
}

TEST_CASE("A number of frames that a video has no room for is not believed", "[video]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 8, 8);
  for (const auto* name : {"left.avi", "right.avi"}) promise_frames(folder / name, 9'999'999);
  CHECK(open_sequence(folder.path(), "auto").frames.size() == 8);
}

TEST_CASE("A video that ends before its header says has no more frames", "[video]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 12, 12);
  CHECK_THROWS_AS(load_frame(open_with_false_header(folder.path(), 14), 12), EndOfRecording);
}

TEST_CASE("A video that ends slightly early is reported with both numbers, one that does not is not",
          "[video]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 12, 12);
  VideoPair whole(folder / "left.avi", folder / "right.avi");
  CHECK(whole.read(11));
  CHECK(whole.warning().empty());
  CHECK_FALSE(whole.read(12));
  CHECK(whole.warning().empty());
  promise_frames(folder / "right.avi", 15);
  promise_frames(folder / "left.avi", 15);
  VideoPair cut(folder / "left.avi", folder / "right.avi");
  REQUIRE(cut.frames() == 15);
  CHECK_FALSE(cut.read(12));
  CHECK_THAT(cut.warning(),
             Catch::EndsWith("left.avi: the video ends after 12 frames, its header promises 15; "
                             "check that it was copied as a whole"));
}

TEST_CASE("A video that lacks a frame of the other camera, or repeats one, is reported", "[video]") {
  const auto read_all = [](const fs::path& folder) {
    VideoPair pair(folder / "left.avi", folder / "right.avi");
    for (std::size_t i = 0; i < 9; ++i) (void)pair.read(i);
    return pair.warning();
  };
  const TemporaryFolder folder;
  write_tiny_video(folder / "whole", 10, 10);
  for (const char* name : {"left.avi", "right.avi"}) {
    write_tiny_video(folder / name, 10, 10);
    CHECK(read_all(folder / name).empty());
    empty_frame(folder / name / name, 4);
    CHECK_THAT(read_all(folder / name),
               Catch::Contains(std::string(name) + ": lacks a frame before frame 4"));
    VideoPair whole(folder / "whole/left.avi", folder / "whole/right.avi");
    VideoPair pair(folder / name / "left.avi", folder / name / "right.avi");
    const bool left_lacks = std::string(name) == "left.avi";
    for (int reading = 0; reading < 2; ++reading) {
      for (std::size_t i = 0; i < 9; ++i) {
        CAPTURE(name, reading, i);
        const auto read = pair.read(i);
        REQUIRE(read);
        if (reading == 0 && i == 4) continue;  // the pair that shows it
        const auto expected = whole.read(i < 4 ? i : i + 1);
        REQUIRE(expected);
        CHECK(cv::norm(read->left, expected->left, cv::NORM_INF) == 0.0);
        CHECK(cv::norm(read->right, expected->right, cv::NORM_INF) == 0.0);
      }
    }
    CHECK_THAT(pair.warning(), Catch::Contains(left_lacks ? "left.avi: lacks" : "right.avi: lacks"));
  }
  write_tiny_video(folder / "both", 10, 10);
  write_video_with_repetition(folder / "both/images_right", folder / "both/right.avi", 10, 5);
  CHECK_THAT(read_all(folder / "both"),
             Catch::Contains("right.avi: frame 5 shows the frame before it again"));
}

TEST_CASE("Two videos are in step unless the difference of their stamps changes for good", "[video]") {
  StampComparison jitter;
  for (std::size_t i = 0; i < 1000; ++i) {
    const double drift_ms = 0.1 * static_cast<double>(i);
    CHECK(jitter.in_step(i, drift_ms + (i % 7 == 3 ? 100.0 : 0.0), 75.0));
  }
  for (const double jump_ms : {-100.0, 100.0}) {
    StampComparison jump;
    CHECK(jump.in_step(0, 0.0, 75.0));
    CHECK(jump.in_step(1, 0.0, 75.0));
    CHECK(jump.in_step(2, jump_ms, 75.0));
    CHECK_FALSE(jump.in_step(3, jump_ms, 75.0));
    CHECK(jump.in_step(0, 0.0, 75.0));  // read again
    CHECK(jump.in_step(1, 0.0, 75.0));
  }
}

TEST_CASE("A video that ends long before its header says is refused", "[video]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 12, 12);
  truncate_file(folder / "right.avi", 0.4);
  const auto message = message_of([&] {
    const auto cut = open_sequence(folder.path(), "auto");
    for (std::size_t i = 0; i < 12; ++i) (void)load_frame(cut, i);
  });
  CHECK_THAT(message, Catch::Contains("right.avi") || Catch::Contains("video ends at frame"));
}
