// SPDX-License-Identifier: MIT
// Bags as other tools and drivers leave them.
#include <algorithm>
#include <functional>

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/support/bags.hpp"
#include "stereo_slam/support/mcap_writer.hpp"
#include "stereo_slam/support/recorded_drive.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

using Messages = std::vector<TestMessage>;

constexpr const char* kCompressed = "sensor_msgs/msg/CompressedImage";

/// The scan of a bag with these messages; the images of its frames can be read.
[[nodiscard]] SequenceScan scan_of(const Messages& messages, const McapLayout& layout = {}) {
  const TemporaryFolder folder;
  write_text(folder / "bag.mcap", mcap_of(messages, layout).bytes);
  auto scan = scan_bag(folder / "bag.mcap", {});
  if (std::ranges::any_of(scan.problems, is_error)) return scan;
  for (std::size_t i = 0; i < scan.sequence.frames.size(); ++i) CHECK_NOTHROW(load_frame(scan.sequence, i));
  return scan;
}

/// The only problem of such a bag.
[[nodiscard]] std::string problem_of(const Messages& messages, const McapLayout& layout = {}) {
  const auto scan = scan_of(messages, layout);
  REQUIRE(scan.problems.size() == 1);
  return scan.problems[0].text;
}

/// The drive with every message changed, or left out if `change` returns false.
[[nodiscard]] Messages changed(const std::function<bool(TestMessage&)>& change, int frames = 5) {
  Messages messages;
  for (auto& message : drive_messages({.frames = frames})) {
    if (change(message)) messages.push_back(message);
  }
  return messages;
}

[[nodiscard]] bool is_image(const TestMessage& message) { return message.type == "sensor_msgs/msg/Image"; }

[[nodiscard]] bool is_info(const TestMessage& message) { return message.topic.ends_with("camera_info"); }

/// A sensor_msgs/msg/CompressedImage.
[[nodiscard]] std::vector<std::uint8_t> compressed(std::int64_t stamp_ns, const std::string& format,
                                                   const std::vector<std::uint8_t>& data) {
  CdrWriter writer(false);
  writer.put_header(stamp_ns, "cam").put_text(format);
  return writer.put(static_cast<std::uint32_t>(data.size())).put_bytes(data).take();
}

}  // namespace

TEST_CASE("Of raw images and their compressed copies in one bag, the raw ones are read", "[bags]") {
  auto messages = drive_messages();
  for (const auto& message : drive_messages()) {
    if (!is_image(message)) continue;
    for (const auto* transport : {"/compressed", "/compressedDepth"})
      messages.push_back({message.topic + transport, kCompressed, message.record_ns,
                          compressed(message.record_ns, "mono8; jpeg compressed mono8", {1, 2, 3})});
  }
  const auto scan = scan_of(messages);
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.left_name == "/stereo/left/image_rect");
  CHECK(scan.sequence.frames.size() == 5);
}

TEST_CASE("One camera_info beside both topics of images describes neither pair nor camera", "[bags]") {
  const auto messages = changed([](TestMessage& message) {
    const bool is_left = message.topic.find("left") != std::string::npos;
    message.topic = is_info(message) ? "/oak/camera_info" : is_left ? "/oak/left" : "/oak/right";
    return true;
  });
  CHECK_THAT(
      problem_of(messages),
      Catch::Contains("/oak/camera_info is the only camera_info beside /oak/left and /oak/right, but each "
                      "has its own calibration; name that of both: --calibration FILE"));
}

TEST_CASE("A camera_info may come once, at any time", "[bags]") {
  for (const int of_frame : {0, 3}) {
    const auto scan = scan_of(changed([&](const TestMessage& message) {
      return !is_info(message) || message.record_ns == kDriveStart_ns + of_frame * kDriveStep_ns + 30'000'000;
    }));
    CHECK(scan.problems.empty());
    CHECK(scan.sequence.camera.fx == 200.0);
  }
}

TEST_CASE("A camera_info that changes during the recording is a warning; a damaged one is none", "[bags]") {
  const auto problem = problem_of(changed([](TestMessage& message) {
    if (message.topic == "/stereo/left/camera_info" && message.record_ns > kDriveStart_ns + 4 * kDriveStep_ns)
      message.bytes = cdr_camera_info({.coefficients = 0, .f = 210.0, .Tx = 0.0}, false);
    return true;
  }));
  CHECK_THAT(problem, Catch::Contains("/stereo/left/camera_info changes during the recording; its first"));
  const auto damaged = scan_of(changed([](TestMessage& message) {
    if (is_info(message) && message.record_ns > kDriveStart_ns + 4 * kDriveStep_ns) message.bytes.resize(20);
    return true;
  }));
  CHECK(damaged.problems.empty());
  CHECK(damaged.sequence.frames.size() == 5);
}

TEST_CASE("Names of topics may begin without a slash", "[bags]") {
  const auto scan = scan_of(changed([](TestMessage& message) {
    message.topic.erase(0, 1);
    return true;
  }));
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.left_name == "stereo/left/image_rect");
}

TEST_CASE("Rows of an image may have bytes behind their pixels, and not fewer bytes than pixels", "[bags]") {
  const auto with_step = [](std::uint32_t step) {
    return changed([&](TestMessage& message) {
      if (!is_image(message)) return true;
      constexpr auto kWidth = static_cast<std::uint32_t>(TinySequence::kWidth);
      std::vector<std::uint8_t> rows;
      const std::size_t pixels = message.bytes.size() - std::size_t{kWidth} * TinySequence::kHeight;
      for (int y = 0; y < TinySequence::kHeight; ++y) {
        const auto row =
            message.bytes.begin() +
            static_cast<std::ptrdiff_t>(pixels + std::size_t{kWidth} * static_cast<std::size_t>(y));
        rows.insert(rows.end(), row, row + std::min(step, kWidth));
        rows.resize(rows.size() + (step > kWidth ? step - kWidth : 0), 255);
      }
      message.bytes = cdr_image({.stamp_ns = message.record_ns - 30'000'000,
                                 .width = kWidth,
                                 .height = static_cast<std::uint32_t>(TinySequence::kHeight),
                                 .step = step,
                                 .data = rows},
                                false);
      return true;
    });
  };
  CHECK(scan_of(with_step(384)).problems.empty());
  CHECK_THAT(problem_of(with_step(300)),
             Catch::Contains("a row (step) has 300 bytes, but its 320 pixels of mono8 take 320"));
}

TEST_CASE("Messages that are no images of ROS are refused by their types and encodings", "[bags]") {
  const auto foxglove = changed([](TestMessage& message) {
    if (is_image(message)) message.type = "foxglove.RawImage";
    return true;
  });
  for (const char* encoding : {"protobuf", "json"}) {
    CHECK_THAT(
        problem_of(foxglove, {.encoding = encoding}),
        Catch::Contains("has no images that are read (sensor_msgs Image or CompressedImage, cdr or ros1)") &&
            Catch::Contains(std::string("/stereo/left/image_rect (foxglove.RawImage, ") + encoding));
  }
  const auto without_schema = changed([](TestMessage& message) {
    message.type.clear();
    return true;
  });
  CHECK_THAT(problem_of(without_schema), Catch::Contains("/stereo/left/image_rect (of unknown type, cdr)"));
}

TEST_CASE("Frames of a video in compressed images are refused by their format", "[bags]") {
  const auto video = changed([](TestMessage& message) {
    if (!is_image(message)) return true;
    message.type = kCompressed;
    message.bytes = compressed(message.record_ns - 30'000'000, "h264", {0, 0, 0, 1, 0x67, 0x42});
    return true;
  });
  CHECK_THAT(problem_of(video),
             Catch::Contains("the compressed image of format 'h264' is damaged, or is none "
                             "that is decoded; record JPEG or PNG"));
}

TEST_CASE("Topics without messages are no pair of cameras, and are named if they should be", "[bags]") {
  const std::vector<BagTopic> topics = {{"/rear/left", "sensor_msgs/Image", 0},
                                        {"/rear/right", "sensor_msgs/Image", 0},
                                        {"/stereo/left", "sensor_msgs/Image", 3},
                                        {"/stereo/right", "sensor_msgs/Image", 3}};
  CHECK(choose_topics(topics).left == "/stereo/left");
  const std::vector<BagTopic> half = {{"/stereo/left", "sensor_msgs/Image", 3},
                                      {"/stereo/right", "sensor_msgs/Image", 0}};
  CHECK(choose_topics(half).right == "/stereo/right");  // which the recording then says to be empty
}

TEST_CASE("A bag with one pair of images is no recording", "[bags]") {
  const auto messages = changed([](const TestMessage&) { return true; }, 1);
  CHECK_THAT(problem_of(messages), Catch::Contains("has 1 image of /stereo/left/image_rect and 1 image of "
                                                   "/stereo/right/image_rect; a recording has two pairs"));
}

TEST_CASE("Attachments, metadata and unknown records in an MCAP file are passed over", "[bags][mcap]") {
  auto file = mcap_of(drive_messages(), {.has_chunks = false, .has_index = false});
  for (const char op : {'\x09', '\x0c', '\x55', '\x80'})
    file.bytes.insert(file.message_ends[7], McapWriter::record(op, "anything"));
  const TemporaryFolder folder;
  write_text(folder / "bag.mcap", file.bytes);
  const auto scan = scan_bag(folder / "bag.mcap", {});
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.frames.size() == 5);
}
