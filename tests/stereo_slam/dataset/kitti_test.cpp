// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/kitti.hpp"

#include <unistd.h>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// Writes a recording of three frames, breaks it, and returns what opening it says.
std::string kitti_error_after(const std::function<void(const fs::path&)>& breaking, int frames = 3) {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), frames);
  breaking(folder.path());
  auto message = message_of([&] { (void)open_sequence(folder.path(), "auto"); });
  CHECK(std::count(message.begin(), message.end(), '\n') == 0);
  return message;
}

/// As kitti_error_after, but what reading frame `index` says; opening must succeed.
std::string frame_error_after(const std::function<void(const fs::path&)>& breaking, std::size_t index) {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 3);
  breaking(folder.path());
  const auto sequence = open_sequence(folder.path(), "auto");
  return message_of([&] { (void)load_frame(sequence, index); });
}

auto with_file(const std::string& name, const std::string& text) {
  return [=](const fs::path& folder) { write_text(folder / name, text); };
}
auto without(const std::string& name) {
  return [=](const fs::path& folder) { fs::remove_all(folder / name); };
}

}  // namespace

TEST_CASE("A KITTI sequence is read with calibration, stamps, images and ground truth", "[kitti]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 3);
  const auto sequence = open_sequence(folder.path(), "kitti");
  CHECK(sequence.format == "kitti");
  CHECK(sequence.camera.fx == 200.0);
  CHECK(sequence.camera.cy == 60.0);
  CHECK(sequence.camera.baseline_m == Approx(TinySequence::kBaseline_m).epsilon(1e-15));
  CHECK(sequence.camera.width_px == TinySequence::kWidth);
  CHECK(sequence.camera.height_px == TinySequence::kHeight);
  REQUIRE(sequence.frames.size() == 3);
  CHECK(sequence.frames[2].stamp_ns == 200'000'000);
  REQUIRE(sequence.ground_truth.size() == 3);
  CHECK(sequence.ground_truth[2].translation().x() == 0.32);

  const auto frame = load_frame(sequence, 1);
  CHECK(frame.index == 1);
  CHECK(frame.stamp_ns == 100'000'000);
  CHECK(frame.left.type() == CV_8UC1);
  // The same wall, kDisparity_px further left in the right image.
  const cv::Rect shared(0, 0, TinySequence::kWidth - TinySequence::kDisparity_px, TinySequence::kHeight);
  CHECK(cv::norm(frame.left(shared + cv::Point(TinySequence::kDisparity_px, 0)), frame.right(shared),
                 cv::NORM_INF) == 0.0);
}

TEST_CASE("The colour pair alone is read with P2 and P3, and the poses are those of its left camera",
          "[kitti]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 3);
  fs::rename(folder / "image_0", folder / "image_2");
  fs::rename(folder / "image_1", folder / "image_3");
  write_text(folder / "calib.txt", read_text(folder / "calib.txt") +
                                       "P2: 200 0 160 12.03 0 200 60 0.26 0 0 1 0.001\n"
                                       "P3: 200 0 160 -67.97 0 200 60 0.4 0 0 1 0.001\n");
  const auto scan = scan_sequence(folder.path(), "auto");
  CHECK(scan.problems.empty());
  const auto& sequence = scan.sequence;
  CHECK(sequence.left_name == "image_2");
  CHECK(sequence.right_name == "image_3");
  CHECK(sequence.camera.baseline_m == Approx(0.4));
  CHECK(load_frame(sequence, 2).right.cols == TinySequence::kWidth);
  REQUIRE(sequence.ground_truth.size() == 3);
  // x_2 = x_0 + K^-1 (12.03, 0.26, 0.001) = x_0 + (0.05935, 0.001, 0.001).
  const Eigen::Vector3d expected(0.32 - 0.05935, -0.001, -0.001);
  CHECK((sequence.ground_truth[2].translation() - expected).norm() < 1e-12);
  // The grey pair is preferred where both are complete.
  fs::copy(folder / "image_2", folder / "image_0");
  CHECK(scan_sequence(folder.path(), "auto").sequence.left_name == "image_2");
  fs::copy(folder / "image_3", folder / "image_1");
  CHECK(scan_sequence(folder.path(), "auto").sequence.left_name == "image_0");
}

TEST_CASE("A folder of another recording with times.txt or calib.txt is no KITTI sequence", "[kitti]") {
  const TemporaryFolder folder;
  write_tiny_folders(folder.path(), 3);
  fs::remove(folder / "calibration.yaml");
  write_text(folder / "times.txt", "0\n0.1\n0.2\n");
  write_text(folder / "calib.txt", "");
  CHECK_FALSE(looks_like_kitti(folder.path()));
  CHECK_THAT(message_of([&] { (void)open_sequence(folder.path(), "auto"); }),
             !Catch::Contains("image_0") || Catch::Contains("not a recording of a known layout"));
}

TEST_CASE("Ground truth is optional; one that does not fit is left out with a warning", "[kitti]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 3);
  fs::remove(folder / "poses.txt");
  CHECK(open_sequence(folder.path(), "auto").ground_truth.empty());
  write_text(folder / "poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  const auto scan = scan_sequence(folder.path(), "auto");
  CHECK(scan.sequence.ground_truth.empty());
  REQUIRE(scan.problems.size() == 1);
  CHECK_FALSE(is_error(scan.problems[0]));
  CHECK_THAT(scan.problems[0].text, Catch::Contains("has 1 pose for 3 frames"));
}

TEST_CASE("Another folder is refused with the expected contents", "[kitti]") {
  const TemporaryFolder folder;
  const auto error = [&](const fs::path& path, const char* format) {
    return message_of([&] { (void)open_sequence(path, format); });
  };
  CHECK_THAT(error(folder / "none", "auto"), Catch::Contains("none: no such folder; check --dataset"));
  CHECK_THAT(error(folder.path(), "auto"),
             Catch::Contains("expected the KITTI layout (calib.txt, times.txt"));
  CHECK_THAT(error(folder / "none.mp4", "auto"), Catch::Contains("none.mp4: no such file or folder"));
  write_text(folder / "file", "");
  CHECK_THAT(error(folder / "file", "auto"), Catch::Contains("is not a folder"));
  CHECK_THAT(error(folder.path(), "euroc"), Catch::Contains("has no cam0 and cam1; expected mav0/cam0"));
  CHECK_THAT(error(folder.path(), "folders"), Catch::Contains("calibration.yaml: missing"));
  fs::create_directories(folder / "mav0/cam0");
  CHECK_THAT(error(folder.path(), "auto"), Catch::Contains("has no cam0 and cam1; expected mav0/cam0"));
}

TEST_CASE("A wrong calibration is refused", "[kitti]") {
  const std::string P0 = projection_line("P0", 0.0);
  CHECK_THAT(kitti_error_after(without("calib.txt")), Catch::Contains("calib.txt: missing"));
  CHECK_THAT(kitti_error_after(with_file("calib.txt", "")),
             Catch::Contains("calib.txt: has no line 'P0: ...'"));
  CHECK_THAT(kitti_error_after(with_file("calib.txt", P0)), Catch::Contains("has no line 'P1: ...'"));
  CHECK_THAT(kitti_error_after(with_file("calib.txt", P0 + "P1: 1 2 3\n")),
             Catch::Contains("calib.txt:2: P1: needs 12 numbers after it, a 3x4 matrix, and has 3"));
  CHECK_THAT(kitti_error_after(with_file("calib.txt", "P0: 200 0 160 x 0 200 60 0 0 0 1 0\n")),
             Catch::Contains("calib.txt:1: 'x' is not a number"));
  CHECK_THAT(kitti_error_after(with_file("calib.txt", P0 + projection_line("P1", 0.0))),
             Catch::Contains("P1 gives a baseline of zero"));
  CHECK_THAT(kitti_error_after(with_file("calib.txt", P0 + projection_line("P1", 80.0))),
             Catch::Contains("P1 gives a baseline of -0.4 m"));
  CHECK_THAT(kitti_error_after(with_file("calib.txt", P0 + "P1: 210 0 160 -80 0 200 60 0 0 0 1 0\n")),
             Catch::Contains("P0 and P1 have different intrinsics"));
  for (const auto* across :
       {"P1: 200 0 160 -80 0 200 60 -80 0 0 1 0\n", "P1: 200 0 160 -80 0 200 60 0 0 0 1 0.1\n"})
    CHECK_THAT(kitti_error_after(with_file("calib.txt", P0 + across)),
               Catch::Contains("calib.txt: P1 has the fourth column (-80, "));
  CHECK(kitti_error_after(with_file("calib.txt", P0 + "P1: 200 0 160 -80 0 200 60 0.5 0 0 1 -0.003\n"))
            .empty());
  CHECK_THAT(kitti_error_after(with_file(
                 "calib.txt", "P0: 0 0 160 0 0 200 60 0 0 0 1 0\nP1: 0 0 160 -80 0 200 60 0 0 0 1 0\n")),
             Catch::Contains("P0 has focal lengths 0 and 200"));
  CHECK_THAT(kitti_error_after(with_file(
                 "calib.txt", "P0: 200 9 160 0 0 200 60 0 0 0 1 0\nP1: 200 9 160 -80 0 200 60 0 0 0 1 0\n")),
             Catch::Contains("P0 is not [fx 0 cx tx;"));
  CHECK_THAT(kitti_error_after(with_file(
                 "calib.txt", "P0: 200 0 900 0 0 200 60 0 0 0 1 0\nP1: 200 0 900 -80 0 200 60 0 0 0 1 0\n")),
             Catch::Contains("the principal point (900, 60) lies outside the 320x120 images"));
}

TEST_CASE("Wrong times are refused", "[kitti]") {
  CHECK_THAT(kitti_error_after(without("times.txt")), Catch::Contains("times.txt: missing"));
  CHECK_THAT(kitti_error_after(with_file("times.txt", "0\nabc\n2\n")),
             Catch::Contains("times.txt:2: 'abc' is not one time in seconds"));
  CHECK_THAT(kitti_error_after(with_file("times.txt", "0\n1 2\n3\n")),
             Catch::Contains("times.txt:2: '1 2' is not one time"));
  CHECK_THAT(kitti_error_after(with_file("times.txt", "0\n2\n1\n")),
             Catch::Contains("times.txt:3: 1 is not later than"));
  CHECK_THAT(kitti_error_after(with_file("times.txt", "0\n0\n1\n")),
             Catch::Contains("times.txt:2: 0 is not later than"));
  CHECK_THAT(kitti_error_after(with_file("times.txt", "0\nnan\n1\n")),
             Catch::Contains("times.txt:2: 'nan' is not one time"));
  CHECK_THAT(kitti_error_after(with_file("times.txt", "0.00\n0.10\n0.2")),
             Catch::Contains("times.txt:3: the last line has no line end and fewer digits"));
  CHECK(kitti_error_after(with_file("times.txt", "0.00\n0.10\n0.20")).empty());
  CHECK_THAT(kitti_error_after(with_file("times.txt", "0\n1\n")),
             Catch::Contains("has 2 times for 3 images (the last is 000002.png)"));
  CHECK_THAT(kitti_error_after(with_file("times.txt", "")), Catch::Contains("has 0 times for 3 images"));
}

TEST_CASE("Byte order marks in a KITTI sequence are skipped", "[kitti]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 3);
  for (const auto* name : {"calib.txt", "times.txt", "poses.txt"})
    write_text(folder / name, "\xEF\xBB\xBF" + read_text(folder / name));
  const auto scan = scan_sequence(folder.path(), "auto");
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.ground_truth.size() == 3);
}

TEST_CASE("Links in a circle are one line of the program", "[kitti]") {
  for (const auto* name : {"calib.txt", "times.txt", "image_0", "image_1", "image_0/000000.png"}) {
    CAPTURE(name);
    CHECK_THAT(kitti_error_after([&](const fs::path& folder) {
                 fs::remove_all(folder / name);
                 fs::create_symlink(folder / name, folder / name);
               }),
               Catch::Contains(std::string(name) + ": cannot be read (Too many levels of symbolic links)"));
  }
}

TEST_CASE("Folders that must not be read are one line of the program", "[kitti]") {
  if (geteuid() == 0) {
    WARN("skipped: the superuser may read every folder");
    return;
  }
  for (const auto* name : {"image_0", "image_1"}) {
    const TemporaryFolder folder;
    write_tiny_sequence(folder.path(), 3);
    fs::permissions(folder / name, fs::perms::none);
    const auto message = message_of([&] { (void)open_sequence(folder.path(), "auto"); });
    fs::permissions(folder / name, fs::perms::owner_all);
    CHECK_THAT(message, Catch::Contains(std::string(name) + ": cannot be read (Permission denied)"));
  }
}

TEST_CASE("A recording that must not be read is named by its folder", "[kitti]") {
  if (geteuid() == 0) {
    WARN("skipped: the superuser may read every folder");
    return;
  }
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  fs::permissions(folder / "in", fs::perms::none);
  const auto message = message_of([&] { (void)open_sequence(folder / "in", "auto"); });
  fs::permissions(folder / "in", fs::perms::owner_all);
  CHECK_THAT(message, Catch::Contains("/in: cannot be read (Permission denied)"));
}

TEST_CASE("Missing image folders, foreign names and too few frames are refused", "[kitti]") {
  CHECK_THAT(kitti_error_after(without("image_0")), Catch::Contains("image_0: no such folder"));
  CHECK_THAT(kitti_error_after(without("image_1")), Catch::Contains("image_1: no such folder"));
  CHECK_THAT(kitti_error_after([](const fs::path& folder) {
               fs::remove_all(folder / "image_0");
               fs::create_directory(folder / "image_0");
             }),
             Catch::Contains("image_0: is empty"));
  CHECK_THAT(
      kitti_error_after([](const fs::path& folder) { fs::rename(folder / "image_0", folder / "image_2"); }),
      Catch::Contains("image_2 and image_3 are the colour cameras"));
  CHECK_THAT(kitti_error_after([](const fs::path& folder) {
               fs::remove_all(folder / "image_0");
               fs::create_directory(folder / "image_0");
               write_text(folder / "image_0/left1.jpg", "");
             }),
             Catch::Contains("contains no 000000.png but files such as left1.jpg"));
  for (const auto* stamp : {"1403636579763555584.png", "18446744073709551615.png", "000099999.png"}) {
    CHECK_THAT(kitti_error_after([&](const fs::path& folder) {
                 fs::remove_all(folder / "image_0");
                 fs::create_directory(folder / "image_0");
                 write_text(folder / "image_0" / stamp, "");
               }),
               Catch::Contains("contains no 000000.png but files such as " + std::string(stamp)));
  }
  CHECK_THAT(kitti_error_after([](const fs::path& folder) { write_text(folder / "image_1/900000.png", ""); }),
             Catch::Contains("one is called 900000.png; they must be numbered from 000000.png without gaps"));
  CHECK_THAT(kitti_error_after([](const fs::path&) {}, 1), Catch::Contains("contains a single frame"));
}

TEST_CASE("A damaged first image is found on opening", "[kitti]") {
  CHECK_THAT(
      kitti_error_after([](const fs::path& folder) { truncate_file(folder / "image_0/000000.png", 0.5); }),
      Catch::Contains("image_0/000000.png: the PNG is truncated"));
  CHECK_THAT(kitti_error_after(without("image_0/000000.png")),
             Catch::Contains("image_0/000000.png: missing"));
}

TEST_CASE("A damaged later frame is found when it is read; the frames before it are not affected",
          "[kitti]") {
  const auto right = "image_1/000001.png";
  CHECK_THAT(frame_error_after(without(right), 1), Catch::Contains("image_1/000001.png: missing"));
  CHECK(frame_error_after(without(right), 0).empty());
  CHECK_THAT(frame_error_after([&](const fs::path& f) { truncate_file(f / right, 0.7); }, 1),
             Catch::Contains("truncated"));
  CHECK_THAT(
      frame_error_after([&](const fs::path& f) { cv::imwrite((f / right).string(), tiny_texture(300)); }, 1),
      Catch::Contains("000001.png: is 300x120 pixels where the sequence has 320x120"));
  CHECK_THAT(frame_error_after([&](const fs::path& f) { write_text(f / right, "no image"); }, 1),
             Catch::Contains("not a PNG"));
}

TEST_CASE("The real KITTI excerpts open", "[kitti][data]") {
  const auto data = data_folder();
  if (!data) return;
  const auto sequence = open_sequence(*data / "kitti/00_0000-0200", "auto");
  CHECK(sequence.frames.size() == 201);
  CHECK(sequence.ground_truth.size() == 201);
  CHECK(sequence.camera.width_px == 1241);
  CHECK(sequence.camera.baseline_m == Approx(386.1448 / 718.856).epsilon(1e-12));
  CHECK(load_frame(sequence, 200).stamp_ns == sequence.frames[200].stamp_ns);
}

TEST_CASE("Times in another unit than seconds are recognised by their steps or their size, and named",
          "[kitti]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 6);
  const auto scan_with = [&](const std::function<std::string(int)>& time) {
    std::string text;
    for (int i = 0; i < 6; ++i) text += time(i) + "\n";
    write_text(folder / "times.txt", text);
    return scan_sequence(folder.path(), "auto");
  };
  const std::vector<std::pair<std::string, std::function<std::string(int)>>> files = {
      {"milliseconds", [](int i) { return fmt::format("{}", 5000 + 100 * i); }},
      {"milliseconds", [](int i) { return fmt::format("{:.3f}", 100.0 * i); }},
      {"microseconds", [](int i) { return fmt::format("{}", 100'000 * i); }},
      {"nanoseconds",
       [](int i) { return fmt::format("{}", std::int64_t{1403636579763555584} + 100'000'000 * i); }},
      {"milliseconds", [](int i) { return fmt::format("{}", std::int64_t{1626962384000} + 100 * i); }}};
  for (const auto& [unit, time] : files) {
    CAPTURE(unit, time(1));
    const SequenceScan scan = scan_with(time);
    REQUIRE(scan.problems.size() == 1);
    CHECK_FALSE(is_error(scan.problems[0]));
    CHECK_THAT(scan.problems[0].text, Catch::Contains("times.txt: its times are taken as " + unit));
    CHECK(scan.sequence.frames[5].stamp_ns - scan.sequence.frames[0].stamp_ns == 500'000'000);
  }
  CHECK(scan_with([](int i) { return fmt::format("{}", i); }).problems.empty());
  CHECK(scan_with([](int i) { return fmt::format("{:.1f}", 4.0 * i); }).problems.empty());
}
