// SPDX-License-Identifier: MIT
// One drive in every kind of bag is one drive.
#include <algorithm>
#include <functional>
#include <random>

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/dataset/euroc.hpp"
#include "stereo_slam/dataset/kitti.hpp"
#include "stereo_slam/support/bags.hpp"
#include "stereo_slam/support/db3_writer.hpp"
#include "stereo_slam/support/mcap_writer.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// Checks that two recordings have the same bits: images, camera, and times from their beginnings.
void check_same(const StereoSequence& sequence, const StereoSequence& expected) {
  const auto& [a, b] = std::pair(sequence.camera, expected.camera);
  CHECK(a.fx == b.fx);
  CHECK(a.fy == b.fy);
  CHECK(a.cx == b.cx);
  CHECK(a.cy == b.cy);
  CHECK(a.baseline_m == b.baseline_m);
  CHECK(a.width_px == b.width_px);
  CHECK(a.height_px == b.height_px);
  REQUIRE(sequence.frames.size() == expected.frames.size());
  const auto from_begin_ns = [](const StereoSequence& of, std::size_t i) {
    return of.frames[i].stamp_ns - of.frames[0].stamp_ns;
  };
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    CHECK(from_begin_ns(sequence, i) == from_begin_ns(expected, i));
    const auto frame = load_frame(sequence, i);
    const auto other = load_frame(expected, i);
    CHECK(cv::norm(frame.left, other.left, cv::NORM_INF) == 0.0);
    CHECK(cv::norm(frame.right, other.right, cv::NORM_INF) == 0.0);
  }
}

/// Writes the drive in every format of ROS 2, and calls `check` with each bag.
void for_each_bag(const RecordedDrive& drive, const std::function<void(const fs::path&)>& check) {
  const TemporaryFolder folder;
  const auto messages = drive_messages(drive);
  std::vector<McapLayout> layouts;
  for (const auto* compression : {"", "lz4", "zstd"}) {
    for (const bool has_index : {true, false})
      layouts.push_back({.compression = compression, .has_index = has_index});
  }
  layouts.push_back({.has_chunks = false, .has_index = false});
  for (const auto& layout : layouts) {
    CAPTURE(layout.compression, layout.has_index, layout.has_chunks);
    write_text(folder / "drive.mcap", mcap_of(messages, layout).bytes);
    check(folder / "drive.mcap");
  }
  write_text(folder / "drive.mcap.zstd", zstd_of(mcap_of(messages).bytes));
  check(folder / "drive.mcap.zstd");
  write_db3(folder / "drive.db3", messages);
  check(folder / "drive.db3");
  write_text(folder / "drive.db3.zstd", zstd_of(read_text(folder / "drive.db3")));
  check(folder / "drive.db3.zstd");
  write_db3(folder / "messages.db3", messages, true);
  check(folder / "messages.db3");
}

[[nodiscard]] StereoSequence whole_sequence(const fs::path& bag) {
  const auto scan = scan_bag(bag, {});
  for (const auto& problem : scan.problems) FAIL(problem.text);
  return scan.sequence;
}

}  // namespace

TEST_CASE("Rectified images in every kind of bag are those of the same drive as KITTI", "[bags]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), kFrames);
  const auto kitti = scan_kitti(folder.path()).sequence;
  for (const bool big_endian : {false, true}) {
    for_each_bag({.frames = kFrames, .big_endian = big_endian},
                 [&](const fs::path& bag) { check_same(whole_sequence(bag), kitti); });
  }
}

TEST_CASE("Raw images in every kind of bag are those of the same drive as EuRoC, and in a bag of ROS 1",
          "[bags]") {
  const TemporaryFolder folder;
  write_tiny_euroc(folder.path(), kFrames);
  const auto euroc = scan_euroc(folder.path()).sequence;
  REQUIRE(euroc.rectifier);
  for_each_bag({.frames = kFrames, .image = "image_raw"},
               [&](const fs::path& bag) { check_same(whole_sequence(bag), euroc); });
  const auto ros1 = bags();
  if (ros1) check_same(whole_sequence(*ros1 / "stereo.bag"), euroc);
}

TEST_CASE("Rectified images in a bag of ROS 1 are those of the same drive as KITTI", "[bags]") {
  const auto ros1 = bags();
  if (!ros1) return;
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), kFrames);
  check_same(whole_sequence(*ros1 / "rgb.bag"), scan_kitti(folder.path()).sequence);
}

TEST_CASE("The beginnings of messages are those of the messages, in any order", "[bags]") {
  std::mt19937 random(5);
  for_each_bag({.frames = kFrames}, [&](const fs::path& bag) {
    CAPTURE(bag.string());
    const auto file = open_message_file(bag);
    std::vector<MessagePlace> places;
    for (const auto& topic : file->topics()) {
      const auto more = file->places(topic.name);
      places.insert(places.end(), more.begin(), more.end());
    }
    std::ranges::shuffle(places, random);
    const auto beginnings = file->read_beginnings(places);
    REQUIRE(beginnings.size() == places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto message = file->read(places[i]);
      const auto& [bytes, count, fault] = beginnings[i];
      CHECK(fault.empty());
      REQUIRE(count == std::min(message.size(), kStampedBytes));
      CHECK(std::equal(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count), message.begin()));
    }
  });
}
