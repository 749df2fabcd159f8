// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_recording.hpp"

#include <cstdlib>
#include <sys/wait.h>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr int kFrames = 5;
constexpr std::int64_t kFirst_ns = 1'500'000'000'000'000'000;

/// The bags of write_bags.py; nothing, and a warning, where bags cannot be written or read.
std::optional<fs::path> bags() {
  static const TemporaryFolder folder;
  static const int status = [&] {
    write_tiny_folders(folder.path(), kFrames);
    fs::remove(folder / "calibration.yaml");
    for (const auto* side : {"left", "right"}) {
      for (int i = 0; i < kFrames; ++i) {
        const fs::path png = folder / side / frame_name(i);
        cv::imwrite(fs::path(png).replace_extension(".pgm").string(),
                    cv::imread(png.string(), cv::IMREAD_GRAYSCALE));
      }
    }
    const int result =
        std::system(fmt::format("/usr/bin/python3 {} {}", BAG_WRITER, folder.path().string()).c_str());
    return WIFEXITED(result) ? WEXITSTATUS(result) : 1;
  }();
  constexpr int kSkipped = 77;
  if (status == kSkipped || !BAGS_ARE_READ) {
    WARN("skipped: python3-rosbag, python3-sensor-msgs or librosbag-storage-dev is not installed");
    return std::nullopt;
  }
  REQUIRE(status == 0);
  return folder.path();
}

cv::Mat original(const fs::path& folder, const char* side, int frame) {
  return cv::imread((folder / side / frame_name(frame)).string(), cv::IMREAD_GRAYSCALE);
}

void check_images(const SequenceScan& scan, const fs::path& folder) {
  for (const auto& problem : scan.problems) FAIL(problem.text);
  const auto& sequence = scan.sequence;
  CHECK(sequence.format == "bag");
  CHECK(sequence.camera.baseline_m == Approx(0.4));
  REQUIRE(sequence.frames.size() == kFrames);
  for (const int i : {3, 0, 4}) {
    const auto frame = load_frame(sequence, static_cast<std::size_t>(i));
    CHECK(frame.stamp_ns == kFirst_ns + 100'000'000LL * i);
    CHECK(cv::norm(frame.left, original(folder, "left", i), cv::NORM_INF) <= 1.0);
    CHECK(cv::norm(frame.right, original(folder, "right", i), cv::NORM_INF) <= 1.0);
  }
}

std::string error_of(const fs::path& file, const BagOptions& options = {}) {
  const auto scan = scan_bag(file, options);
  REQUIRE_FALSE(scan.problems.empty());
  CHECK(is_error(scan.problems.front()));
  CHECK_THAT(scan.problems.front().text, Catch::StartsWith(file.string()));
  return scan.problems.front().text;
}

}  // namespace

TEST_CASE("A bag with camera_info is a recording, whatever its compression and encoding", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const char* name : {"stereo.bag", "compressed.bag", "lz4.bag", "rgb.bag", "8uc3.bag"}) {
    CAPTURE(name);
    check_images(scan_bag(*folder / name, {}), *folder);
  }
  CHECK(scan_bag(*folder / "stereo.bag", {}).sequence.rectifier);
  CHECK_FALSE(scan_bag(*folder / "rgb.bag", {}).sequence.rectifier);  // its topics are image_rect
  CHECK(scan_bag(*folder / "direct.bag", {}).sequence.rectifier);
}

TEST_CASE("Images of 12 bits in mono16 or a PNG of 16 bits keep their contrast, with a warning", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const char* name : {"dark.bag", "dark_png.bag"}) {
    CAPTURE(name);
    SequenceScan scan = scan_bag(*folder / name, {});
    REQUIRE(scan.problems.size() == 1);
    CHECK_THAT(scan.problems[0].text, Catch::Contains("no value is above 4095"));
    scan.problems.clear();
    check_images(scan, *folder);
  }
}

TEST_CASE("EuRoC's topics are recognised, other ones named; the calibration is a file", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  CHECK_THAT(error_of(*folder / "euroc.bag"),
             Catch::Contains("has no /cam0/camera_info; name the calibration"));
  const TemporaryFolder elsewhere;
  const fs::path calibration = elsewhere / "rectified.yaml";
  write_text(calibration, tiny_calibration());
  check_images(
      scan_bag(*folder / "euroc.bag", {.left_topic = "", .right_topic = "", .calibration = calibration}),
      *folder);
  fs::copy_file(*folder / "euroc.bag", elsewhere / "euroc.bag");
  write_text(elsewhere / "calibration.yaml", tiny_calibration());
  check_images(scan_bag(elsewhere / "euroc.bag", {}), *folder);  // beside the bag

  CHECK_THAT(
      error_of(*folder / "odd.bag"),
      Catch::Contains(
          "no pairs of image topics; name them: --left-topic, --right-topic; there are /back, /front"));
  check_images(scan_bag(*folder / "odd.bag",
                        {.left_topic = "/front", .right_topic = "/back", .calibration = calibration}),
               *folder);
}

TEST_CASE("The topics of a bag are listed", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  const auto topics = list_topics(*folder / "stereo.bag");
  REQUIRE(topics.size() == 5);
  CHECK(topics[0].name == "/note");
  CHECK(topics[2].name == "/stereo/left/image_raw");
  CHECK(topics[2].type == "sensor_msgs/Image");
  CHECK(topics[2].messages == kFrames);
}

TEST_CASE(
    "Images without a partner, or with the stamp of the image before, are left out of a bag, with a warning",
    "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  struct Bag {
    const char* name;
    const char* count;
    const char* reason;
  };
  for (const auto& [name, count, reason] :
       {Bag{"gap.bag", "1 of 5 images of", "no partner within 50 ms"},
        Bag{"repeated.bag", "1 of the images of", "the stamp of the image before"},
        Bag{"outlier.bag", "1 of 5 images of", "the first is image 2 with 410065408.0"}}) {
    CAPTURE(name);
    const auto scan = scan_bag(*folder / name, {});
    REQUIRE_FALSE(scan.problems.empty());
    for (const auto& problem : scan.problems) {
      CHECK_FALSE(is_error(problem));
      CHECK_THAT(problem.text, Catch::Contains(count) && Catch::Contains(reason));
    }
    REQUIRE(scan.sequence.frames.size() == kFrames - 1);
    // The images before and after what is left out, image 2.
    for (const auto& [frame, image] : {std::pair{std::size_t{1}, 1}, {std::size_t{2}, 3}}) {
      const auto pair = load_frame(scan.sequence, frame);
      CHECK(pair.stamp_ns == kFirst_ns + 100'000'000LL * image);
      CHECK(cv::norm(pair.left, original(*folder, "left", image), cv::NORM_INF) <= 1.0);
      CHECK(cv::norm(pair.right, original(*folder, "right", image), cv::NORM_INF) <= 1.0);
    }
  }
}

TEST_CASE("The first or the last image of a bag may have a stamp far from its time", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const auto& [name, first] : {std::pair{"first_zero.bag", 1}, {"last_late.bag", 0}}) {
    CAPTURE(name);
    const auto scan = scan_bag(*folder / name, {});
    CHECK(scan.problems.size() == 2);  // of each topic
    REQUIRE(scan.sequence.frames.size() == kFrames - 1);
    CHECK(scan.sequence.frames[0].stamp_ns == kFirst_ns + 100'000'000LL * first);
  }
}

TEST_CASE("A bag without stamps in its headers is refused, and read by the times of recording", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  CHECK_THAT(
      error_of(*folder / "zero.bag"),
      Catch::Contains("5 of its 5 images have the stamp zero in their headers; the option --record-times"));
  const auto scan =
      scan_bag(*folder / "zero.bag",
               {.left_topic = "", .right_topic = "", .calibration = {}, .pairing = {}, .record_times = true});
  CHECK(scan.problems.empty());
  REQUIRE(scan.sequence.frames.size() == kFrames);
  CHECK(scan.sequence.frames[4].stamp_ns == kFirst_ns + 430'000'000);
}

TEST_CASE("A topic named for both cameras shows them side by side", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  CHECK_THAT(error_of(*folder / "both.bag"),
             Catch::Contains("--left-topic /zed/image --right-topic /zed/image"));
  const TemporaryFolder elsewhere;
  write_text(elsewhere / "rectified.yaml", tiny_calibration());
  BagOptions options{.left_topic = "/zed/image", .right_topic = "/zed/image", .calibration = {}};
  CHECK_THAT(error_of(*folder / "both.bag", options),
             Catch::Contains("shows both cameras, and a camera_info describes"));
  options.calibration = elsewhere / "rectified.yaml";
  check_images(scan_bag(*folder / "both.bag", options), *folder);
  options.pairing.right_half_first = true;
  const auto frame = load_frame(scan_bag(*folder / "both.bag", options).sequence, 2);
  CHECK(cv::norm(frame.left, original(*folder, "right", 2), cv::NORM_INF) == 0.0);
}

TEST_CASE("Parts of a bag are one recording, in the order of their times", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  const std::string parts = (*folder / "part_1.bag").string() + "," + (*folder / "part_0.bag").string();
  CHECK(is_bag_recording(parts));
  check_images(scan_bag(parts, {}), *folder);
  CHECK(list_topics(parts).size() == 5);
  const TemporaryFolder alone;
  for (const auto* part : {"part_0.bag", "part_1.bag"}) fs::copy_file(*folder / part, alone / part);
  write_text(alone / "._part_1.bag", "of macOS");
  CHECK(is_bag_recording(alone.path()));
  check_images(scan_bag(alone.path(), {}), *folder);
  fs::copy_file(*folder / "stereo.bag", alone / "stereo.bag");
  CHECK_THAT(error_of(alone.path()),
             Catch::Contains("before the end of") && Catch::Contains("no parts of one recording"));
}

TEST_CASE("Bags are recognised by their names", "[bags]") {
  for (const auto* name : {"a.bag", "a/b.BAG", "a.Bag", "2021-07-22.bag.active", "a.bag,b.bag"})
    CHECK(has_bag_name(name));
  for (const auto* name : {"a.bagx", "bag", "a.bag.gz", "a.active", ""}) CHECK_FALSE(has_bag_name(name));
  const TemporaryFolder folder;
  CHECK_FALSE(is_bag_recording(folder.path()));
  write_text(folder / "a.bag", "");
  CHECK(is_bag_recording(folder.path()));
  fs::create_directories(folder / "mav0");
  CHECK_FALSE(is_bag_recording(folder.path()));
}

TEST_CASE("Topics that count the cameras are a pair, with a warning", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  auto scan = scan_bag(*folder / "counted.bag", {});
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(
      scan.problems[0].text,
      Catch::Contains("/drive/Cam_2/image is taken as the left and /drive/Cam_3/image as the right camera"));
  scan.problems.clear();
  check_images(scan, *folder);
}

TEST_CASE("Topics whose names do not say which is left are ordered by their calibration", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const auto& [bag, left] :
       {std::pair("reversed.bag", "/cam_b/image"), {"unnamed.bag", "/other/image"}}) {
    CAPTURE(bag);
    auto scan = scan_bag(*folder / bag, {});
    CHECK(scan.sequence.left_name == left);
    REQUIRE(scan.problems.size() == 1);
    CHECK_THAT(scan.problems[0].text, Catch::Contains("by P[3] of their camera_info"));
    scan.problems.clear();
    check_images(scan, *folder);
  }
  CHECK_THAT(
      error_of(*folder / "unnamed_without.bag"),
      Catch::Contains("no pairs of image topics; name them") && Catch::Contains("/main/image, /other/image"));
}

TEST_CASE("A bag whose stamps go back is refused, and the image is named", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  CHECK_THAT(
      error_of(*folder / "back.bag"),
      Catch::Contains("/stereo/left/image_raw: 2 of its 5 images are out of order: the stamp of image 3") &&
          Catch::Contains("is earlier than") && Catch::Contains("1500000000.1") &&
          !Catch::Contains("reindex"));
}

TEST_CASE("Lengths in a bag that cannot be are refused before memory is allocated for them", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  // The data of a chunk, and what lz4 says it unpacks to.
  for (const std::string_view name : {"stereo.bag", "lz4.bag"}) {
    const std::string whole = read_text(*folder / name);
    const std::size_t size = whole.find("size=");
    REQUIRE(size != std::string::npos);
    std::string changed = whole;
    changed.replace(size + 5, 4, "\xff\xff\xff\xff");
    write_text(*folder / "huge.bag", changed);
    CHECK_THAT(error_of(*folder / "huge.bag"), Catch::Contains("more than 1 GB"));
    // Every length in the last records, those of the index: as if the bag had another 2 GB.
    const std::size_t index = whole.rfind("op=\x06");
    REQUIRE(index != std::string::npos);
    for (std::size_t at = index; at + 4 < whole.size(); at += 1) {
      CAPTURE(name, at);
      changed = whole;
      changed[at + 3] = '\x7f';
      write_text(*folder / "huge.bag", changed);
      const auto scan = scan_bag(*folder / "huge.bag", {});  // must not end the program
      for (const auto& problem : scan.problems) CHECK(problem.text.size() < 1000);
    }
  }
}

TEST_CASE("Rectified images that the camera_info does not describe are refused", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  CHECK_THAT(
      error_of(*folder / "half.bag"),
      Catch::Contains("/a/left/camera_info says 320x120 pixels, but the images of /a/left/image_rect have "
                      "160x60; they may have been scaled"));
  CHECK_THAT(error_of(*folder / "rect_cx.bag"),
             Catch::Contains("cx = 160 in the left and 180 in the right camera: the cameras were calibrated "
                             "without zero disparity") &&
                 Catch::Contains("CALIB_ZERO_DISPARITY, or name the topics of the raw images"));
  check_images(scan_bag(*folder / "raw_cx.bag", {}), *folder);  // raw images are rectified here
}

TEST_CASE("Projection matrices in a bag that contradict each other are refused", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const std::string name : {"rect", "raw"}) {
    CAPTURE(name);
    const auto error = [&](const char* what) { return error_of(*folder / (name + what + ".bag")); };
    CHECK_THAT(error("_fx"), Catch::Contains("contradict each other: fx is 210 in that of the left camera"));
    CHECK_THAT(error("_cy"), Catch::Contains("contradict each other: cy is 60 in that of the left camera"));
    CHECK_THAT(error("_Ty"), Catch::Contains("camera_info: the projection matrix of the right camera has") &&
                                 Catch::Contains("rectified cameras lie side by side"));
    CHECK_THAT(error("_both"), Catch::Contains("of both cameras have a baseline"));
  }
}

TEST_CASE("The first calibrated camera_info counts, and needs no more than the images need", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const char* name : {"uncalibrated_first.bag", "bare_rectified.bag", "bare_raw.bag"}) {
    CAPTURE(name);
    const auto scan = scan_bag(*folder / name, {});
    CHECK(scan.problems.empty());
    CHECK(scan.sequence.camera.baseline_m == Approx(0.4));
    check_images(scan, *folder);
  }
  CHECK_THAT(error_of(*folder / "uncalibrated.bag"),
             Catch::Contains("/stereo/left/camera_info: the camera matrix K is zero in all messages") &&
                 Catch::Contains("--calibration FILE"));
}

TEST_CASE("A positive baseline in a camera_info is read, with a warning that names the topic", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const char* name : {"rect_positive.bag", "raw_positive.bag"}) {
    CAPTURE(name);
    const auto scan = scan_bag(*folder / name, {});
    REQUIRE(scan.problems.size() == 1);
    CHECK_FALSE(is_error(scan.problems[0]));
    CHECK_THAT(scan.problems[0].text,
               Catch::Contains("right/camera_info: P[3] of the right camera is 80, but must be negative"));
    CHECK(scan.sequence.camera.baseline_m == Approx(0.4));
  }
}

TEST_CASE("Errors of the library that reads bags are in plain words", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  const std::string whole = read_text(*folder / "stereo.bag");
  const auto error_with = [&](const std::string& bytes) {
    write_text(*folder / "changed.bag", bytes);
    return error_of(*folder / "changed.bag");
  };
  CHECK_THAT(error_with("#ROSBAG V9.3\n" + whole.substr(13)),
             Catch::Contains("is a bag of version 9.3, which is not read") && !Catch::Contains("reindex"));
  CHECK_THAT(error_with(""),
             Catch::Contains("the first line, '#ROSBAG V2.0', is not there") && Catch::Contains("reindex"));
  // The name of the distortion model, in the first camera_info, is longer than its message.
  const std::size_t model = whole.find(std::string("\x09\0\0\0plumb_bob", 13));
  REQUIRE(model != std::string::npos);
  std::string longer = whole;
  longer[model + 2] = '\x7f';
  CHECK_THAT(error_with(longer), Catch::Contains("a message ends within its fields"));
}

TEST_CASE("An image of another size in a bag is named", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  const auto scan = scan_bag(*folder / "wider.bag", {});
  REQUIRE(scan.problems.empty());
  CHECK(load_frame(scan.sequence, 2).right.cols == 320);
  CHECK_THAT(message_of([&] { (void)load_frame(scan.sequence, 3); }),
             Catch::Contains("wider.bag: frame 3 of /stereo/right/image_raw: is 321x120 pixels"));
}

TEST_CASE("Bags that cannot be used are refused in one line", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  CHECK_THAT(error_of(*folder / "nowhere.bag"), Catch::Contains("no such file"));
  CHECK_THAT(error_of("/dev/null"), Catch::Contains("not an ordinary file"));
  write_text(*folder / "text.bag", "no bag");
  CHECK_THAT(error_of(*folder / "text.bag"), Catch::Contains("is no bag of ROS 1"));
  write_text(*folder / "empty.bag", "");
  CHECK_THAT(error_of(*folder / "empty.bag"), Catch::Contains("the bag is cut off or damaged"));
  fs::create_directory(*folder / "folder.bag");
  CHECK_THAT(error_of(*folder / "folder.bag"), Catch::Contains("is a folder"));
  fs::remove(*folder / "folder.bag");
  CHECK_THAT(error_of(*folder / "strange.bag"),
             Catch::Contains("image 0 of /stereo/left/image_raw: the encoding 32FC1") &&
                 !Catch::Contains("reindex"));
  CHECK_THAT(error_of(*folder / "swapped.bag"), Catch::Contains("the two are swapped"));
  CHECK_THAT(error_of(*folder / "fisheye.bag"), Catch::Contains(": /stereo/right/camera_info: "));
  const std::string whole = read_text(*folder / "stereo.bag");
  for (const double share : {0.01, 0.3, 0.6, 0.99}) {
    CAPTURE(share);
    write_text(*folder / "cut.bag",
               whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
    CHECK_THAT(error_of(*folder / "cut.bag"), Catch::Contains("`rosbag reindex`"));
  }
}
