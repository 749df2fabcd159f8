// SPDX-License-Identifier: MIT
// Folders as rosbag2 writes them.
#include <fmt/ranges.h>

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/support/bags.hpp"
#include "stereo_slam/support/db3_writer.hpp"
#include "stereo_slam/support/mcap_writer.hpp"
#include "stereo_slam/support/recorded_drive.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

[[nodiscard]] std::string metadata_of(const std::vector<std::string>& files,
                                      const std::string& compression = "", const std::string& mode = "") {
  return fmt::format(
      "rosbag2_bagfile_information:\n  version: 8\n  storage_identifier: mcap\n  duration:\n    nanoseconds: "
      "1\n"
      "  relative_file_paths: [{}]\n  compression_format: \"{}\"\n  compression_mode: \"{}\"\n  "
      "topics_with_message_count: []\n",
      fmt::join(files, ", "), compression, mode);
}

/// Writes the parts a_0.mcap, of frames 0 to 2, and b_1.mcap, of frames 3 and 4, `gap` frames later.
void write_parts(const fs::path& folder, int gap = 0) {
  write_text(folder / "a_0.mcap", mcap_of(drive_messages({.first = 0, .frames = 3})).bytes);
  write_text(folder / "b_1.mcap", mcap_of(drive_messages({.first = 3 + gap, .frames = 2})).bytes);
}

[[nodiscard]] std::size_t frames_of(const fs::path& recording) {
  REQUIRE(is_bag_recording(recording));
  const auto scan = scan_bag(recording, {});
  for (const auto& problem : scan.problems) FAIL(problem.text);
  for (std::size_t i = 0; i < scan.sequence.frames.size(); ++i) {
    const auto frame = load_frame(scan.sequence, i);
    if (i > 0) CHECK(frame.stamp_ns > scan.sequence.frames[i - 1].stamp_ns);
  }
  return scan.sequence.frames.size();
}

}  // namespace

TEST_CASE("The files that metadata.yaml names are one recording, also after a pause", "[bags]") {
  constexpr int kPause = 200;  // 20 s
  const TemporaryFolder folder;
  write_parts(folder.path(), kPause);
  CHECK_THAT(error_of(folder.path()), Catch::Contains("so they are no parts of one recording"));
  write_text(folder / "metadata.yaml", metadata_of({"a_0.mcap", "b_1.mcap"}));
  CHECK(frames_of(folder.path()) == 5);
  CHECK(list_topics(folder.path()).size() == 5);
  CHECK(list_topics(folder.path())[2].messages == 5);
}

TEST_CASE("Bags in a folder without metadata are one recording if their times follow each other", "[bags]") {
  const TemporaryFolder folder;
  write_parts(folder.path());
  CHECK(frames_of(folder.path()) == 5);
  fs::remove(folder / "b_1.mcap");
  write_db3(folder / "b_1.db3", drive_messages({.first = 3, .frames = 2}));
  CHECK(frames_of(folder.path()) == 5);
  write_text(folder / "metadata.yaml", "");  // its recording was not ended
  CHECK(frames_of(folder.path()) == 5);
  write_text(folder / "c_2.mcap", mcap_of({}).bytes);  // a part without messages
  CHECK(frames_of(folder.path()) == 5);
}

TEST_CASE("What of a folder is not read is said", "[bags]") {
  const TemporaryFolder folder;
  write_parts(folder.path());
  const auto warning_with = [&](std::size_t frames) {
    const auto scan = scan_bag(folder.path(), {});
    CHECK(scan.sequence.frames.size() == frames);
    REQUIRE(scan.problems.size() == 1);
    CHECK_FALSE(is_error(scan.problems[0]));
    return scan.problems[0].text;
  };
  write_text(folder / "metadata.yaml", metadata_of({"a_0.mcap"}));  // the last part was never named
  CHECK_THAT(warning_with(3), Catch::Contains("b_1.mcap: is not in metadata.yaml, so it is not read"));
  write_text(folder / "metadata.yaml", metadata_of({"a_0.mcap", "b_1.mcap"}));
  write_text(folder / "b_1.mcap", "");
  CHECK_THAT(warning_with(3), Catch::Contains("b_1.mcap: is empty; the other parts are read"));
  fs::remove(folder / "metadata.yaml");
  write_parts(folder.path(), 6);  // frames 3 to 8 were in a part that is missing
  CHECK_THAT(warning_with(5),
             Catch::Contains("b_1.mcap: begins 0.67 s after the end of a_0.mcap; is a part missing?"));
}

TEST_CASE("Packed files and packed messages are found by the metadata of their folder", "[bags]") {
  const TemporaryFolder folder;
  const auto messages = drive_messages();
  write_db3(folder / "a_0.db3", messages, true);
  write_text(folder / "metadata.yaml", metadata_of({"a_0.db3"}, "zstd", "MESSAGE"));
  CHECK(frames_of(folder.path()) == 5);
  fs::remove(folder / "a_0.db3");
  write_text(folder / "a_0.mcap.zstd", zstd_of(mcap_of(messages).bytes));
  for (const auto* name : {"a_0.mcap.zstd", "a_0.mcap", "drive/a_0.mcap.zstd"}) {
    write_text(folder / "metadata.yaml", metadata_of({name}, "zstd", "FILE"));
    CHECK(frames_of(folder.path()) == 5);
  }
}

TEST_CASE("Folders of rosbag2 that cannot be used are refused in one line", "[bags]") {
  const TemporaryFolder folder;
  const auto error_with = [&](const std::string& metadata) {
    write_text(folder / "metadata.yaml", metadata);
    REQUIRE(is_bag_recording(folder.path()));
    return error_of(folder.path());
  };
  CHECK_THAT(error_with(metadata_of({"drive_0.mcap"})),
             Catch::Contains("metadata.yaml: names drive_0.mcap, which is not there"));
  CHECK_THAT(error_with(metadata_of({})), Catch::Contains("names no file"));
  const std::string longest(300, 'a');  // names may have 255 bytes
  CHECK_THAT(error_with(metadata_of({longest})), Catch::Contains(longest + ", which is not there"));
  CHECK_THAT(error_of(folder / (longest + ".mcap")), Catch::Contains("no such file"));
  CHECK_THAT(error_with("rosbag2_bagfile_information: 3\n"), Catch::Contains("metadata.yaml:1:"));
  CHECK_THAT(error_with("rosbag2_bagfile_information: {version: 8}\n"),
             Catch::Contains("has no relative_file_paths"));
  CHECK_THAT(error_with("rosbag2_bagfile_information: {relative_file_paths: [[a]]}\n"),
             Catch::Contains("must be a list of files"));
  CHECK_THAT(error_with("rosbag2_bagfile_information: {relative_file_paths: {a: b}}\n"),
             Catch::Contains("must be a list of files"));
  CHECK_THAT(error_with(metadata_of({"a"}, "brotli", "FILE")), Catch::Contains("is compressed by 'brotli'"));
}
