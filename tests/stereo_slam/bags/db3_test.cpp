// SPDX-License-Identifier: MIT
#include <algorithm>
#include <random>

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/support/bags.hpp"
#include "stereo_slam/support/db3_writer.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("A damaged database gives one error, or a warning and the frames that can be read", "[bags][db3]") {
  const TemporaryFolder folder;
  write_db3(folder / "whole.db3", drive_messages());
  const std::string whole = read_text(folder / "whole.db3");
  for (const double share : {0.001, 0.01, 0.3, 0.6, 0.9, 0.99}) {
    CAPTURE(share);
    write_text(folder / "cut.db3",
               whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
    const auto scan = scan_bag(folder / "cut.db3", {});
    constexpr double kWithoutIndex = 0.95;  // the last pages are those of the index, which is not used
    REQUIRE((share > kWithoutIndex || !scan.problems.empty()));
    if (!scan.problems.empty() && is_error(scan.problems.front()))
      CHECK_THAT(scan.problems.front().text, Catch::Contains("copy or download the bag again"));
    for (std::size_t i = 0; i < scan.sequence.frames.size(); ++i) (void)load_partial_frame(scan.sequence, i);
  }
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    std::string changed = whole;
    for (int k = 0; k < 1 + i % 20; ++k)
      changed[random() % (i % 2 == 0 ? 4096 : whole.size())] ^= static_cast<char>(1 + random() % 255);
    write_text(folder / "changed.db3", changed);
    const auto scan = scan_bag(folder / "changed.db3", {});  // must not end the program
    for (const auto& problem : scan.problems) CHECK(problem.text.size() < 1000);
    for (std::size_t k = 0; k < scan.sequence.frames.size(); ++k) (void)load_partial_frame(scan.sequence, k);
  }
}

TEST_CASE("A database that was cut off gives every frame before the cut, and one warning", "[bags][db3]") {
  const TemporaryFolder folder;
  auto messages = drive_messages({.frames = 8});
  std::vector<std::string> marks;  // at the ends of left images, which are the last of their frames
  for (auto& message : messages) {
    if (message.topic != "/stereo/left/image_rect") continue;
    marks.push_back(fmt::format("the end of {}", marks.size()));
    std::ranges::copy(marks.back(), message.bytes.end() - static_cast<std::ptrdiff_t>(marks.back().size()));
  }
  write_db3(folder / "whole.db3", messages);
  const std::string whole = read_text(folder / "whole.db3");
  std::mt19937 random(59);
  for (int i = 0; i < 200; ++i) {
    const std::size_t cut = random() % whole.size();
    CAPTURE(cut, whole.size());
    write_text(folder / "cut.db3", whole.substr(0, cut));
    const auto scan = scan_bag(folder / "cut.db3", {});
    const auto expected = static_cast<std::size_t>(std::ranges::count_if(
        marks, [&](const std::string& mark) { return whole.find(mark) + mark.size() <= cut; }));
    if (expected < 2) continue;  // too short a recording
    CHECK(std::ranges::none_of(scan.problems, is_error));
    CHECK(std::ranges::count_if(scan.problems, [](const Problem& problem) {
            return problem.text.find("the database is damaged (it was cut off)") != std::string::npos;
          }) == 1);
    std::size_t loaded = 0;
    for (std::size_t k = 0; k < scan.sequence.frames.size(); ++k) {
      const auto frame = load_partial_frame(scan.sequence, k);
      loaded += frame.has_left() && frame.has_right() ? 1 : 0;
    }
    CHECK(loaded >= expected);  // the last mark may be cut, and nothing else
    CHECK(loaded <= expected + 1);
  }
}

TEST_CASE("Databases that cannot be used are refused in one line", "[bags][db3]") {
  const TemporaryFolder folder;
  write_text(folder / "text.db3", "no database, though it is long enough to be asked");
  CHECK_THAT(error_of(folder / "text.db3"), Catch::Contains("file is not a database"));
  write_text(folder / "empty.db3", "");
  CHECK_THAT(error_of(folder / "empty.db3"), Catch::Contains("no such table: topics"));
  write_db3(folder / "without.db3", {});
  CHECK_THAT(error_of(folder / "without.db3"), Catch::Contains("contains no messages"));
  write_db3(folder / "other.db3", drive_messages({.frames = 2}), false, "flatbuffer");
  CHECK_THAT(error_of(folder / "other.db3"), Catch::Contains("is serialised as 'flatbuffer'"));
  write_text(folder / "damaged.db3.zstd", "\x28\xb5\x2f\xfd and no more of zstd");
  CHECK_THAT(error_of(folder / "damaged.db3.zstd"), Catch::Contains("zstd is damaged"));
  write_text(folder / "short.db3.zstd", zstd_of(read_text(folder / "other.db3")).substr(0, 5000));
  CHECK_THAT(error_of(folder / "short.db3.zstd"), Catch::Contains("copy or download the bag again"));
}

TEST_CASE("A recording whose last messages are still in the log of its database is whole", "[bags][db3]") {
  const TemporaryFolder folder;
  const auto messages = drive_messages();
  write_db3(folder / "name with % ? #.db3", messages);
  const auto scan = scan_bag(folder / "name with % ? #.db3", {});
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.frames.size() == 5);
  // SQLite moves a log to the database when the last connection is closed, so that the files are copied
  // before.
  fs::create_directories(folder / "killed");
  sqlite3* writer = nullptr;
  REQUIRE(sqlite3_open((folder / "name with % ? #.db3").c_str(), &writer) == SQLITE_OK);
  sqlite3_exec(writer, "PRAGMA journal_mode=WAL; DELETE FROM messages WHERE id > 20", nullptr, nullptr,
               nullptr);
  for (const auto* end : {"", "-wal"})
    fs::copy_file(folder / (std::string("name with % ? #.db3") + end),
                  folder / "killed" / (std::string("drive.db3") + end));
  sqlite3_close(writer);
  CHECK(scan_bag(folder / "killed/drive.db3", {}).sequence.frames.size() == 4);
}

TEST_CASE("A topic whose row a damaged database has twice has its messages once", "[bags][db3]") {
  const TemporaryFolder folder;
  write_db3(folder / "drive.db3", drive_messages());
  sqlite3* writer = nullptr;
  REQUIRE(sqlite3_open((folder / "drive.db3").c_str(), &writer) == SQLITE_OK);
  CHECK(sqlite3_exec(writer,
                     "CREATE TABLE twice AS SELECT * FROM topics UNION ALL SELECT * FROM topics; "
                     "DROP TABLE topics; ALTER TABLE twice RENAME TO topics",
                     nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(writer);
  const auto scan = scan_bag(folder / "drive.db3", {});
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.frames.size() == 5);
}
