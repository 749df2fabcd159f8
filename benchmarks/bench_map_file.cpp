// SPDX-License-Identifier: MIT
// A map of 1000 keyframes with 500 points each, to a file and back; the same bytes without meaning beside it.
#include <filesystem>
#include <string>

#include "stereo_slam/results/map_file.hpp"
#include "stereo_slam/support/random_map.hpp"
#include "support/catch.hpp"
#include "support/files.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("Map file, 1000 keyframes x 500 points", "[benchmark][map_file]") {
  const antipode::test::TemporaryFolder folder;
  const SavedMap map = test::map_of(1000, 500);
  save_map(folder / "map", map);
  const std::string bytes = antipode::test::read_text(folder / "map");

  BENCHMARK("save_map") { save_map(folder / "saved", map); };
  BENCHMARK("baseline: plain write") {
    std::ofstream(folder / "written", std::ios::binary).write(bytes.data(), std::ssize(bytes));
  };
  BENCHMARK("load_map") { return load_map(folder / "map").keyframes.size(); };
  BENCHMARK("baseline: plain read") {
    std::string read(bytes.size(), '\0');
    std::ifstream(folder / "map", std::ios::binary).read(read.data(), std::ssize(read));
    return read.back();
  };
}

}  // namespace
}  // namespace stereo_slam
