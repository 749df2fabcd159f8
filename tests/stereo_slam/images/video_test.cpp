// SPDX-License-Identifier: MIT
#include "stereo_slam/images/video.hpp"

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/support.hpp"
#include "stereo_slam/support/tiny_video.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

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
               Catch::Contains(std::string(name) + ": lacks 1 frame before frame 4"));
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
