// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/mcap_writer.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// A file of two topics with chunks of three messages, and where each chunk with its indexes ends.
struct WrittenFile {
  std::string bytes;
  std::vector<std::size_t> chunk_ends;
};

[[nodiscard]] Bytes payload(int number) { return Bytes(static_cast<std::size_t>(10 + number), 0x5A); }

[[nodiscard]] WrittenFile written(int messages, bool ended) {
  WrittenFile file;
  McapWriter writer([&](std::string_view bytes) { file.bytes += bytes; }, "tests 1");
  const auto a = writer.add_topic({"/a", "test_msgs/msg/A", "int32 x\n"});
  const auto b = writer.add_topic({"/b", "test_msgs/msg/B", "int32 y\n", "- history: 1\n"});
  for (int i = 0; i < messages; ++i) {
    writer.add(i % 2 == 0 ? a : b, 1'000 + i, payload(i));
    if (i % 3 != 2) continue;
    writer.end_chunk();
    file.chunk_ends.push_back(file.bytes.size());
  }
  if (ended) writer.end();
  return file;
}

/// The lengths of the messages of a topic, as our reader finds them.
[[nodiscard]] std::vector<std::size_t> lengths_in(MessageFile& file, const std::string& topic) {
  auto places = file.places(topic);
  std::ranges::sort(places, {}, &MessagePlace::record_ns);
  std::vector<std::size_t> lengths;
  lengths.reserve(places.size());
  for (const auto& place : places) lengths.push_back(file.read(place).size());
  return lengths;
}

}  // namespace

TEST_CASE("What was written is read, by the index and without it", "[ros2][mcap]") {
  const TemporaryFolder folder;
  for (const bool ended : {true, false}) {
    CAPTURE(ended);
    write_text(folder / "file.mcap", written(6, ended).bytes);
    const auto file = open_mcap_file(folder / "file.mcap");
    CHECK(lengths_in(*file, "/a") == std::vector<std::size_t>{10, 12, 14});
    CHECK(lengths_in(*file, "/b") == std::vector<std::size_t>{11, 13, 15});
    const auto topics = file->topics();
    REQUIRE(topics.size() == 2);
    CHECK(topics[0].type == "test_msgs/msg/A");
    CHECK(topics[1].messages == 3);
    REQUIRE(file->times());
    CHECK(file->times()->first_ns == 1'000);
    CHECK(file->times()->last_ns == 1'005);
    CHECK(file->warning().empty() == ended);
  }
}

TEST_CASE("A file that was cut at any byte has the messages of all complete chunks", "[ros2][mcap]") {
  const TemporaryFolder folder;
  const auto whole = written(9, true);
  for (std::size_t cut = whole.chunk_ends.front(); cut < whole.bytes.size(); cut += 7) {
    CAPTURE(cut);
    write_text(folder / "cut.mcap", whole.bytes.substr(0, cut));
    const auto complete = static_cast<std::size_t>(
        std::ranges::count_if(whole.chunk_ends, [&](std::size_t end) { return end <= cut; }));
    const auto file = open_mcap_file(folder / "cut.mcap");
    const auto found = lengths_in(*file, "/a").size() + lengths_in(*file, "/b").size();
    CHECK(found >= 3 * complete);
    CHECK(found <= 9);
  }
}

TEST_CASE("A file without messages is whole", "[ros2][mcap]") {
  const TemporaryFolder folder;
  write_text(folder / "empty.mcap", written(0, true).bytes);
  const auto file = open_mcap_file(folder / "empty.mcap");
  CHECK_FALSE(file->times());
  CHECK(file->warning().empty());
}

TEST_CASE("The program that wrote a file is told by its beginning", "[ros2][mcap]") {
  const std::string bytes = written(3, true).bytes;
  CHECK(McapWriter::is_of(bytes, "tests "));
  CHECK_FALSE(McapWriter::is_of(bytes, "others "));
  for (std::size_t length = 0; length < 30; ++length)
    CHECK_FALSE(McapWriter::is_of(bytes.substr(0, length), "tests "));
  CHECK_FALSE(McapWriter::is_of("P5 1 1 255\n", "tests "));
}

TEST_CASE("What the file cannot take is passed on", "[ros2][mcap]") {
  std::size_t room_bytes = 100;
  McapWriter writer(
      [&](std::string_view bytes) {
        if (bytes.size() > room_bytes) throw std::runtime_error("the disk is full");
        room_bytes -= bytes.size();
      },
      "tests 1");
  const auto channel = writer.add_topic({"/a", "test_msgs/msg/A", "int32 x\n"});
  writer.add(channel, 0, payload(0));
  CHECK_THROWS_WITH(writer.end_chunk(), "the disk is full");
}
