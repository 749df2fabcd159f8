// SPDX-License-Identifier: MIT
#include <algorithm>
#include <fstream>
#include <map>
#include <random>

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/support/bags.hpp"
#include "stereo_slam/support/mcap_writer.hpp"
#include "stereo_slam/support/recorded_drive.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// The number of frames of which both images are complete before a cut.
[[nodiscard]] std::size_t whole_frames(const std::vector<TestMessage>& messages, const McapBytes& file,
                                       std::size_t cut) {
  std::map<std::int64_t, int> images;  // by time
  for (std::size_t i = 0; i < messages.size(); ++i) {
    if (file.message_ends[i] <= cut && messages[i].type == "sensor_msgs/msg/Image")
      ++images[messages[i].record_ns];
  }
  return static_cast<std::size_t>(
      std::ranges::count_if(images, [](const auto& entry) { return entry.second == 2; }));
}

[[nodiscard]] std::size_t warnings_of_cuts(const SequenceScan& scan) {
  return static_cast<std::size_t>(std::ranges::count_if(scan.problems, [](const Problem& problem) {
    return !is_error(problem) && problem.text.find("the file is not whole") != std::string::npos;
  }));
}

[[nodiscard]] std::string replaced(std::string text, std::size_t at, const std::string& by) {
  return text.replace(at, by.size(), by);
}

}  // namespace

TEST_CASE("An MCAP file that was cut off gives every frame before the cut, and one warning", "[bags][mcap]") {
  const TemporaryFolder folder;
  const auto messages = drive_messages({.frames = 4});
  std::mt19937 random(59);
  for (const McapLayout& layout :
       {McapLayout{}, McapLayout{.has_chunks = false}, McapLayout{.compression = "lz4"},
        McapLayout{.compression = "zstd", .has_index = false}, McapLayout{.chunk_bytes = 1'000'000}}) {
    const McapBytes file = mcap_of(messages, layout);
    for (int i = 0; i < 40; ++i) {  // 200 cuts in all
      const std::size_t cut = random() % file.bytes.size();
      CAPTURE(layout.compression, layout.has_chunks, cut, file.bytes.size());
      write_text(folder / "cut.mcap", file.bytes.substr(0, cut));
      const auto scan = scan_bag(folder / "cut.mcap", {});
      const std::size_t expected = whole_frames(messages, file, cut);
      if (expected < 2 && std::ranges::any_of(scan.problems, is_error))
        continue;  // too short, as a whole or now
      REQUIRE(std::ranges::none_of(scan.problems, is_error));
      if (layout.compression.empty()) CHECK(scan.sequence.frames.size() == expected);
      CHECK(scan.sequence.frames.size() >= expected);
      const bool lacks_records = cut + 100 < file.bytes.size();  // else only the footer may be missing
      CHECK(warnings_of_cuts(scan) <= 1);
      if (lacks_records && expected < 4) CHECK(warnings_of_cuts(scan) == 1);
      for (std::size_t k = 0; k < scan.sequence.frames.size(); ++k)
        CHECK_NOTHROW(load_frame(scan.sequence, k));
    }
  }
}

TEST_CASE("A damaged chunk costs its own frames: with an index when they are loaded, else at once",
          "[bags][mcap]") {
  const TemporaryFolder folder;
  const auto messages = drive_messages();
  for (const bool has_index : {true, false}) {
    CAPTURE(has_index);
    auto file = mcap_of(messages, {.compression = "lz4", .has_index = has_index, .chunk_bytes = 70'000});
    file.bytes[file.message_ends[9] - 20'000] ^= 0x40;  // in the last image of frame 1
    write_text(folder / "damaged.mcap", file.bytes);
    const auto scan = scan_bag(folder / "damaged.mcap", {});
    REQUIRE(std::ranges::none_of(scan.problems, is_error));
    if (has_index) {
      CHECK(scan.problems.empty());
      REQUIRE(scan.sequence.frames.size() == 5);
      std::size_t damaged = 0;
      for (std::size_t i = 0; i < 5; ++i) {
        const std::string fault = message_of([&] { (void)load_frame(scan.sequence, i); });
        if (!fault.empty()) CHECK_THAT(fault, Catch::Contains("the chunk at byte"));
        damaged += fault.empty() ? 0 : 1;
      }
      CHECK(damaged == 1);
    } else {
      REQUIRE_FALSE(scan.problems.empty());
      CHECK(std::ranges::any_of(scan.problems, [](const auto& problem) {
        return problem.text.find("the chunk at byte") != std::string::npos;
      }));
      CHECK(scan.sequence.frames.size() == 4);
    }
  }
}

TEST_CASE("A record that is too short for its fields does not cost those around it", "[bags][mcap]") {
  const TemporaryFolder folder;
  auto file = mcap_of(drive_messages(), {.has_chunks = false, .has_index = false});
  for (const char op : {'\x03', '\x04', '\x05', '\x06'})
    file.bytes.insert(file.message_ends[7], McapWriter::record(op, "short"));
  write_text(folder / "bag.mcap", file.bytes);
  const auto scan = scan_bag(folder / "bag.mcap", {});
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text, Catch::Contains("4 chunks or records cannot be read, the first because"));
  CHECK_FALSE(is_error(scan.problems[0]));
  CHECK(scan.sequence.frames.size() == 5);
}

TEST_CASE("Lengths in an MCAP file that cannot be are refused, or end what is read", "[bags][mcap]") {
  const TemporaryFolder folder;
  const auto messages = drive_messages({.frames = 2});
  const std::string huge(8, '\xff');
  for (const bool has_index : {true, false}) {
    const auto file = mcap_of(messages, {.compression = "zstd", .has_index = has_index});
    const std::size_t end = file.bytes.size();
    // The first chunk comes after the magic and the header: kind, length, two times, size, checksum.
    const std::size_t chunk = 8 + 9 + 17;
    REQUIRE(file.bytes[chunk] == '\x06');
    for (const std::size_t at :
         {chunk + 1, chunk + 25, chunk + 37, chunk + 41, end - 28, end - 20, end - 36}) {
      CAPTURE(has_index, at);
      write_text(folder / "huge.mcap", replaced(file.bytes, at, huge.substr(0, at == chunk + 37 ? 4 : 8)));
      const auto scan = scan_bag(folder / "huge.mcap", {});
      for (const auto& problem : scan.problems) CHECK(problem.text.size() < 1000);
    }
    write_text(folder / "large.mcap",
               replaced(file.bytes, chunk + 25, McapWriter::number(std::uint64_t{1} << 40)));
    CHECK_THAT(error_of(folder / "large.mcap"),
               Catch::Contains("more than 1 GB") || Catch::Contains("has no images"));
  }
}

TEST_CASE("Places beyond 4 GB are found, with and without an index", "[bags][mcap]") {
  constexpr std::uint64_t kBeyond_bytes = (std::uint64_t{1} << 32) + 12'345;
  const TemporaryFolder folder;
  for (const bool has_index : {true, false}) {
    CAPTURE(has_index);
    const auto file = mcap_of(drive_messages(),
                              {.compression = "lz4", .has_index = has_index, .hole_bytes = kBeyond_bytes});
    std::ofstream stream(folder / "large.mcap", std::ios::binary);
    stream << file.bytes.substr(0, file.hole_at);
    stream.seekp(static_cast<std::streamoff>(kBeyond_bytes), std::ios::cur);  // takes no room on the disk
    stream << file.bytes.substr(file.hole_at);
    stream.close();
    const auto scan = scan_bag(folder / "large.mcap", {});
    for (const auto& problem : scan.problems) FAIL(problem.text);
    REQUIRE(scan.sequence.frames.size() == 5);
    CHECK_NOTHROW(load_frame(scan.sequence, 4));
  }
}

TEST_CASE("Any byte of an MCAP file may be wrong", "[bags][mcap]") {
  const TemporaryFolder folder;
  const auto messages = drive_messages({.frames = 2});
  std::mt19937 random(7);
  for (const char* compression : {"", "lz4", "zstd"}) {
    const auto file = mcap_of(messages, {.compression = compression, .chunk_bytes = 1'000'000});
    for (int i = 0; i < 100; ++i) {
      // Mostly in the records around the data of images.
      const std::size_t at = i % 2 == 0 ? random() % 1200 : file.bytes.size() - 1 - random() % 1200;
      CAPTURE(compression, at);
      write_text(folder / "changed.mcap",
                 replaced(file.bytes, at, std::string(1, static_cast<char>(random()))));
      const auto scan = scan_bag(folder / "changed.mcap", {});  // must not end the program
      for (const auto& problem : scan.problems) CHECK(problem.text.size() < 1000);
      for (std::size_t k = 0; k < scan.sequence.frames.size(); ++k)
        (void)load_partial_frame(scan.sequence, k);
    }
  }
}

TEST_CASE("MCAP files that cannot be used are refused in one line", "[bags][mcap]") {
  const TemporaryFolder folder;
  const auto error_with = [&](const std::string& bytes) {
    write_text(folder / "bag.mcap", bytes);
    return error_of(folder / "bag.mcap");
  };
  CHECK_THAT(error_with(""), Catch::Contains("is empty"));
  CHECK_THAT(error_with("no bag at all, but longer"), Catch::Contains("is no MCAP file"));
  CHECK_THAT(error_with(mcap_of({}).bytes), Catch::Contains("contains no messages"));
  const auto messages = drive_messages({.frames = 2});
  CHECK_THAT(error_with(mcap_of(messages, {.encoding = "protobuf"}).bytes),
             Catch::Contains("is serialised as 'protobuf', which is not read"));
  CHECK_THAT(error_with(mcap_of(messages, {.compression = "brotli"}).bytes),
             Catch::Contains("is compressed by 'brotli', which is not read"));
  CHECK_THAT(error_with(mcap_of(messages, {.wrong_checksum = 1}).bytes), Catch::Contains("another checksum"));
  std::vector<TestMessage> one_camera, no_camera;
  for (const auto& message : messages) {
    if (message.topic.find("right") == std::string::npos) one_camera.push_back(message);
    if (message.topic.find("image") == std::string::npos) no_camera.push_back(message);
  }
  CHECK_THAT(error_with(mcap_of(one_camera).bytes), Catch::Contains("--left-topic /stereo/left/image_rect"));
  CHECK_THAT(error_with(mcap_of(no_camera).bytes),
             Catch::Contains("has no images") && Catch::Contains("/note"));
  write_text(folder / "bag.mcap", mcap_of(messages).bytes);
  CHECK_THAT(error_of(folder / "bag.mcap", {.left_topic = "/a", .right_topic = "/b", .calibration = {}}),
             Catch::Contains("'/a' is no topic of images; there are /stereo/left/image_rect, /stereo/right"));
}
