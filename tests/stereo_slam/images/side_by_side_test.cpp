// SPDX-License-Identifier: MIT
// Both images in one: folders, videos and live cameras.
#include "stereo_slam/support/side_by_side.hpp"

#include <set>

#include "stereo_slam/dataset/own_camera.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/images/live_camera.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

const char* const kSideBySide = "layout: side-by-side\nsource: both\n";

/// Mean difference in grey levels.
double difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total());
}

void check_frames(const StereoSequence& sequence, const fs::path& original, double tolerance) {
  REQUIRE(sequence.frames.size() == 5);
  CHECK(sequence.camera.width_px == TinySequence::kWidth);
  for (const int i : {0, 3}) {
    const auto frame = load_frame(sequence, static_cast<std::size_t>(i));
    CHECK(difference(frame.left, cv::imread((original / "left" / frame_name(i)).string(), 0)) <= tolerance);
    CHECK(difference(frame.right, cv::imread((original / "right" / frame_name(i)).string(), 0)) <= tolerance);
  }
}

}  // namespace

TEST_CASE("Images side by side are split, in folders and videos", "[side-by-side]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "two", 5);
  write_side_by_side(folder / "two", folder / "both", 5);
  write_text(folder / "calibration.yaml", tiny_calibration(std::string("frame_rate_hz: 10\n") + kSideBySide));
  const auto images = open_sequence(folder.path(), "auto");
  CHECK(images.format == "folders");
  check_frames(images, folder / "two", 0.0);

  write_side_by_side_video(folder / "both", folder / "both.avi", 5);
  fs::rename(folder / "both", folder / "images");
  const auto video = open_sequence(folder.path(), "auto");
  CHECK(video.format == "video");
  CHECK(video.frames[3].stamp_ns == 300'000'000);
  check_frames(video, folder / "two", 3.0);

  // One source with a calibration of its own can only be side by side.
  write_text(folder / "rectified.yaml", tiny_calibration(""));
  check_frames(scan_sequence(folder / "both.avi", "auto", folder / "rectified.yaml").sequence, folder / "two",
               3.0);
}

TEST_CASE("Two videos and their calibration can be named", "[side-by-side]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 5, 5);
  const auto both = (folder / "left.avi").string() + "," + (folder / "right.avi").string();
  const auto scan = scan_sequence(both, "auto", folder / "calibration.yaml");
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.frames.size() == 5);
  CHECK_FALSE(scan.sequence.live);
}

TEST_CASE("A video without frames is refused by its name", "[side-by-side]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 3, 3);
  const fs::path left = folder / "left.avi", right = folder / "right.avi";
  const auto error = [&](const fs::path& source) {
    const auto scan = scan_sequence(source, "auto", folder / "calibration.yaml");
    REQUIRE(scan.problems.size() == 1);
    CHECK(is_error(scan.problems[0]));
    return scan.problems[0].text;
  };
  const std::string whole = read_text(right);
  remove_frames(right);
  CHECK_THAT(error({}), Catch::Contains("right.avi: is a video without frames"));
  CHECK_THAT(error(right), Catch::Contains("right.avi: is a video without frames"));
  remove_frames(left);
  CHECK_THAT(error({}), Catch::Contains("left.avi: is a video without frames"));
  CHECK_THAT(error(left.string() + "," + right.string()), Catch::Contains("left.avi: is a video without"));
  write_text(right, whole);
  CHECK_THAT(error({}), Catch::Contains("left.avi: is a video without frames"));
  write_text(folder / "calibration.yaml", tiny_calibration("layout: side-by-side\nsource: left.avi\n"));
  CHECK_THAT(error({}), Catch::Contains("left.avi: is a video without frames"));
}

TEST_CASE("What is not side by side is refused with what to change", "[side-by-side]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "two", 5);
  write_side_by_side(folder / "two", folder / "both", 5);
  const auto error = [&](const std::string& more) {
    write_text(folder / "calibration.yaml", tiny_calibration("frame_rate_hz: 10\n" + more));
    return message_of([&] { (void)open_sequence(folder.path(), "auto"); });
  };
  CHECK_THAT(error("layout: side-by-side\n"), Catch::Contains("belong together"));
  CHECK_THAT(error("source: both\n"), Catch::Contains("belong together"));
  CHECK_THAT(error("layout: above\n"), Catch::Contains("layout is above, but must be side-by-side"));
  CHECK_THAT(error(std::string(kSideBySide) + "left: {source: two}\n"),
             Catch::Contains("leave out `layout: side-by-side`"));
  CHECK_THAT(error("layout: side-by-side\nsource: nowhere\n"), Catch::Contains("nowhere: neither a folder"));
  cv::imwrite((folder / "both" / frame_name(2)).string(), cv::Mat(120, 641, CV_8UC1, cv::Scalar(7)));
  CHECK(error(kSideBySide).empty());
  CHECK_THAT(message_of([&] { (void)load_frame(open_sequence(folder.path(), "auto"), 2); }),
             Catch::Contains("000002.png: has 641 columns, which are not two images side by side"));
}

TEST_CASE("Devices, URLs and pipelines are live, files are not", "[camera]") {
  for (const char* live : {"/dev/video0", "rtsp://10.0.0.1/stereo", "v4l2src device=/dev/video0 ! appsink"})
    CHECK(is_live(live));
  for (const char* recorded : {"video.mp4", "/data/video0", "left", ""}) CHECK_FALSE(is_live(recorded));
  const TemporaryFolder folder;
  fs::create_directories(folder / "hall ! noon");
  CHECK_FALSE(is_live(folder / "hall ! noon"));
  CHECK(is_live(folder / "hall ! evening"));
}

TEST_CASE("A live camera has no end, and stamps of its own that increase", "[camera]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder / "two", 12);
  write_side_by_side(folder / "two", folder / "both", 12);
  write_side_by_side_video(folder / "both", folder / "both.avi", 12);
  write_text(folder / "calibration.yaml", tiny_calibration(""));
  const auto scan =
      scan_sequence("file://" + (folder / "both.avi").string(), "auto", folder / "calibration.yaml");
  CHECK(scan.problems.empty());
  const auto& sequence = scan.sequence;
  CHECK(sequence.live);
  CHECK(sequence.format == "camera");
  CHECK(sequence.frames.empty());
  CHECK(sequence.camera.width_px == TinySequence::kWidth);
  std::int64_t before_ns = 1'600'000'000'000'000'000;  // of the year 2020
  for (std::size_t i = 0; i < 11; ++i) {               // its size was taken from the first one
    const auto frame = load_frame(sequence, i);
    CHECK(frame.index == i);
    CHECK(frame.stamp_ns > before_ns);
    before_ns = frame.stamp_ns;
  }
  CHECK_THROWS_AS(load_frame(sequence, 11), EndOfRecording);
}

TEST_CASE("A camera that is not there, or has no calibration, is one line", "[camera]") {
  const TemporaryFolder folder;
  write_text(folder / "calibration.yaml", tiny_calibration(""));
  const auto error = [&](const fs::path& source, const fs::path& calibration) {
    const auto scan = scan_sequence(source, "auto", calibration);
    REQUIRE_FALSE(scan.problems.empty());
    return scan.problems[0].text;
  };
  CHECK_THAT(error("/dev/video97", {}),
             Catch::Contains("/dev/video97: ") && Catch::Contains("--calibration FILE"));
  CHECK_THAT(error("/dev/video97", folder / "calibration.yaml"),
             Catch::Contains("/dev/video97: cannot be opened"));
  CHECK_THAT(error("/dev/video97,/dev/video97", folder / "calibration.yaml"),
             Catch::Contains("source of both cameras"));
  CHECK_THAT(error("/dev/video97,b.avi", folder / "calibration.yaml"), Catch::Contains("b.avi: neither"));
  write_text(folder / "b.avi", "no video");
  CHECK_THAT(error("/dev/video97," + (folder / "b.avi").string(), folder / "calibration.yaml"),
             Catch::Contains("one source is a live camera and the other is not"));
}
