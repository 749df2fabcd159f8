// SPDX-License-Identifier: MIT
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <sys/wait.h>

#include "support/catch.hpp"
#include "support/files.hpp"

namespace {

using antipode::test::read_text;
using antipode::test::TemporaryFolder;
using antipode::test::write_text;

struct Called {
  int status;
  std::string text;
};

/// Runs the program; text has what it printed, errors included.
Called call(const std::string& arguments) {
  const TemporaryFolder folder;
  const auto file = folder / "text";
  const std::string command =
      std::string("'") + OBJECT_POSE_PROGRAM + "' " + arguments + " >'" + file.string() + "' 2>&1";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(file)};
}

std::string quoted(const std::filesystem::path& path) { return "'" + path.string() + "'"; }

/// The lines that begin with the number of a stage, without the columns that need the truth.
std::string faces_of(const std::string& table) {
  std::string faces;
  for (const auto& line : antipode::test::split_lines(table)) {
    if (line.size() > 12 && line[2] >= '0' && line[2] <= '9') faces += line.substr(4, 7);
  }
  return faces;
}

TEST_CASE("A written model and its images give the same result when read", "[object_pose][cli]") {
  const TemporaryFolder folder;
  const auto model = folder / "model", pictures = folder / "pictures";
  const auto rendered =
      call("--seed 11 --features 4 --write-model " + quoted(model) + " --output " + quoted(pictures));
  CAPTURE(rendered.text);
  REQUIRE(rendered.status == 0);
  CHECK(std::filesystem::is_regular_file(pictures / "stage_04.png"));
  const auto again = call("--features 4 --model " + quoted(model) + " --left " +
                          quoted(model / "left_image.png") + " --right " + quoted(model / "right_image.png"));
  CAPTURE(again.text);
  CHECK(again.status == 0);
  CHECK(!faces_of(again.text).empty());
  CHECK(faces_of(again.text) == faces_of(rendered.text));

  SECTION("and bad input is refused in a line") {
    const auto complaint = [&](const std::string& left) {
      const auto called = call("--model " + quoted(model) + " --left " + left + " --right " +
                               quoted(model / "right_image.png"));
      CHECK(called.status == 1);
      CHECK(antipode::test::split_lines(called.text).size() == 1);
      return called.text;
    };
    CHECK_THAT(complaint(quoted(model / "none.png")), Catch::Contains("object_pose: no image at"));
    CHECK_THAT(complaint(quoted(model / "front.png")), Catch::Contains("the left image has"));
    write_text(model / "model.yaml", "camera: 1");
    CHECK_THAT(complaint(quoted(model / "left_image.png")), Catch::Contains("no map 'camera'"));
  }
}

TEST_CASE("Wrong usage has status 2", "[object_pose][cli]") {
  CHECK(call("--left a.png").status == 2);
  CHECK(call("--features 0").status == 2);
  CHECK(call("--help").status == 0);
}

}  // namespace
