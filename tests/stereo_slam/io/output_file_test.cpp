// SPDX-License-Identifier: MIT
#include "stereo_slam/io/output_file.hpp"

#include <cstdlib>
#include <fcntl.h>
#include <stdexcept>
#include <sys/stat.h>
#include <unistd.h>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

void write_new(const fs::path& file) {
  write_file(file, [](std::ostream& out) { out << "new"; });
}

[[nodiscard]] std::ptrdiff_t entries(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), {});
}

}  // namespace

TEST_CASE("A file is written whole or not at all, and beside nothing else", "[output_file]") {
  const TemporaryFolder folder;
  write_text(folder / "a", "old");
  write_text(folder / "a.partial", "mine");
  CHECK_THROWS_AS(write_file(folder / "a",
                             [](std::ostream& out) {
                               out << "half";
                               throw std::runtime_error("broken");
                             }),
                  std::runtime_error);
  CHECK(read_text(folder / "a") == "old");
  CHECK(entries(folder.path()) == 2);
  CHECK_THAT(message_of([&] {
               write_file(folder / "a", [](std::ostream& out) { out.setstate(std::ios::badbit); });
             }),
             Catch::Contains("a: cannot be written"));
  CHECK_THAT(message_of([&] { write_new(folder / "no/such/out.txt"); }),
             Catch::Contains("cannot be written"));
  CHECK(read_text(folder / "a") == "old");
  write_new(folder / "a");
  CHECK(read_text(folder / "a") == "new");
  CHECK(read_text(folder / "a.partial") == "mine");
  CHECK(entries(folder.path()) == 2);
}

TEST_CASE("Symbolic links and devices stay what they are", "[output_file]") {
  const TemporaryFolder folder;
  write_text(folder / "file", "old");
  fs::create_symlink(folder / "file", folder / "link");
  write_new(folder / "link");
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(read_text(folder / "file") == "new");

  write_new("/dev/null");
  CHECK(fs::is_character_file("/dev/null"));
  CHECK_THAT(message_of([] { write_new("/dev/full"); }),
             Catch::Contains("/dev/full: cannot be written (No space"));

  fs::create_symlink(folder / "nowhere", folder / "dangling");
  for (const auto& [name, part] : {std::pair{"dangling", "leads nowhere"}, std::pair{"", "is a folder"}}) {
    const auto path = folder / name;
    CHECK_THAT(message_of([&] { write_new(path); }), Catch::Contains(part));
    CHECK_THAT(message_of([&] { require_writable(path); }), Catch::Contains(part));
  }
  CHECK_THAT(message_of([] { write_new(""); }), Catch::Contains("is empty"));
  require_writable(folder / "another");
  CHECK_FALSE(fs::exists(folder / "another"));
}

TEST_CASE("A file in a folder of /dev is a file", "[output_file]") {
  std::string name = "/dev/shm/stereo_slam_test_XXXXXX";
  if (mkdtemp(name.data()) == nullptr) return;  // this system has no such folder
  const fs::path folder = name;
  write_new(folder / "a");
  write_new(folder / "a");
  CHECK(read_text(folder / "a") == "new");
  CHECK(entries(folder) == 1);
  fs::remove_all(folder);
}

TEST_CASE("A pipe gets the text; one that nobody reads is an error, not a wait", "[output_file]") {
  const TemporaryFolder folder;
  const std::string pipe = folder / "pipe";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  CHECK_THAT(message_of([&] { write_new(pipe); }), Catch::Contains("pipe: cannot be written"));
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  write_new(pipe);
  char text[4] = {};
  CHECK(read(reader, text, 3) == 3);
  CHECK(std::string(text) == "new");
  close(reader);
}

TEST_CASE("What was appended is in the file at once; a file that cannot grow keeps whole pieces",
          "[output_file]") {
  const TemporaryFolder folder;
  AppendFile file(folder / "f");
  file.replace("a\n");
  file.append("b\n");
  CHECK(read_text(folder / "f") == "a\nb\n");
  file.sync();
  file.replace("c\n");
  file.append("d\n");
  CHECK(read_text(folder / "f") == "c\nd\n");
  CHECK(entries(folder.path()) == 1);
}

TEST_CASE("Inputs and the files of others are not replaced", "[output_file]") {
  const TemporaryFolder folder;
  const auto is_ours = [](std::string_view beginning) { return beginning.starts_with("ours"); };
  const auto refusal = [&](const fs::path& file) {
    return message_of([&] { require_replaceable(file, std::vector<fs::path>{folder / "input"}, is_ours); });
  };
  write_text(folder / "input", "ours");
  write_text(folder / "ours", "ours");
  write_text(folder / "empty", "");
  write_text(folder / "mine", "mine");
  fs::create_symlink(folder / "input", folder / "link");
  CHECK_THAT(refusal(folder / "link"), Catch::Contains("link: is to be read, too"));
  CHECK_THAT(refusal(folder / "mine"), Catch::Contains("mine: exists, and is not a file of this kind"));
  for (const auto* name : {"ours", "empty", "none"}) CHECK(refusal(folder / name).empty());
  CHECK(refusal("/dev/null").empty());
}
