// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_recording.hpp"

#include "stereo_slam/support/bags.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("A bag with camera_info is a recording, whatever its compression and encoding", "[bags]") {
  const auto folder = bags();
  if (!folder) return;
  for (const char* name : {"stereo.bag", "compressed.bag", "lz4.bag", "rgb.bag", "8uc3.bag", "rgb16.bag"}) {
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
  for (const auto* name : {"a.bag", "a/b.BAG", "a.Bag", "2021-07-22.bag.active", "a.bag,b.bag", "a.mcap",
                           "a_0.db3", "a_0.db3.zstd"})
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
