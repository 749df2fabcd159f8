// SPDX-License-Identifier: MIT
#include "stereo_slam/io/folder_names.hpp"

#include <string>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("The names in a folder are folders first, without hidden ones, and at most six", "[io]") {
  const TemporaryFolder folder;
  CHECK(names_in(folder.path()).empty());
  CHECK(names_in(folder / "missing").empty());
  write_text(folder / "b.avi", "");
  write_text(folder / ".hidden", "");
  CHECK(names_in(folder.path()) == "b.avi");
  CHECK(names_in(folder / "b.avi").empty());  // it is no folder
  fs::create_directory(folder / "Right");
  fs::create_directory(folder / "Left");
  CHECK(names_in(folder.path()) == "Left/, Right/, b.avi");
  fs::create_directory(folder / ".git");
  CHECK(folders_in(folder.path()) == std::vector<fs::path>{folder / "Left", folder / "Right"});
  CHECK(folders_in(folder / "missing").empty());
  for (int i = 0; i < 9; ++i) write_text(folder / ("left_" + std::to_string(i) + ".png"), "");
  CHECK(names_in(folder.path()) == "Left/, Right/, b.avi, left_0.png, left_1.png, left_2.png and 6 more");
}
