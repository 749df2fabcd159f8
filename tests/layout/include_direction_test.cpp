// SPDX-License-Identifier: MIT
// The folders of the library and of the SLAM depend on each other in one direction. This test reads the
// #include lines of the sources.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"

namespace {

namespace fs = std::filesystem;
using Graph = std::map<std::string, std::set<std::string>>;

/// The folders that each folder may include, besides itself. A new folder needs a line here.
const Graph kMayInclude = {
    // The library. "antipode" stands for the headers that are in no folder: Eigen types, weighted samples.
    {"antipode", {}},
    {"antipode/detail", {"antipode"}},
    {"antipode/geometry", {"antipode", "antipode/detail"}},
    {"antipode/cubature", {"antipode", "antipode/detail", "antipode/geometry"}},
    {"antipode/distributions", {"antipode", "antipode/detail", "antipode/geometry", "antipode/cubature"}},
    {"antipode/sampling",
     {"antipode", "antipode/detail", "antipode/geometry", "antipode/cubature", "antipode/distributions"}},
    {"antipode/filters",
     {"antipode", "antipode/detail", "antipode/geometry", "antipode/cubature", "antipode/distributions",
      "antipode/sampling"}},
    {"antipode/sensors", {"antipode", "antipode/detail", "antipode/geometry"}},
    {"antipode/ceres", {"antipode", "antipode/detail", "antipode/geometry"}},
    {"antipode/opencv", {"antipode", "antipode/detail", "antipode/geometry"}},
    {"antipode/testing", {"antipode", "antipode/detail", "antipode/geometry"}},

    // The SLAM and the simulator, which may use the library's public headers.
    {"stereo_slam/core", {}},
    {"stereo_slam/io", {"stereo_slam/core"}},
    {"stereo_slam/settings", {"stereo_slam/core", "stereo_slam/io"}},
    {"stereo_slam/codecs", {"stereo_slam/core", "stereo_slam/io"}},
    {"stereo_slam/images",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/codecs", "stereo_slam/settings"}},
    {"stereo_slam/calibration",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/images"}},
    {"stereo_slam/stamps", {"stereo_slam/core", "stereo_slam/io"}},
    {"stereo_slam/imu",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/calibration"}},
    {"stereo_slam/dataset",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/codecs", "stereo_slam/settings",
      "stereo_slam/images", "stereo_slam/calibration", "stereo_slam/stamps", "stereo_slam/imu"}},
    {"stereo_slam/bags",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/codecs", "stereo_slam/settings",
      "stereo_slam/images", "stereo_slam/calibration", "stereo_slam/dataset"}},
    {"stereo_slam/rig", {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings"}},
    {"stereo_slam/frontend",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/rig"}},
    {"stereo_slam/odometry",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/rig",
      "stereo_slam/frontend"}},
    {"stereo_slam/local_map",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/rig",
      "stereo_slam/frontend"}},
    {"stereo_slam/tracking",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/rig", "stereo_slam/frontend",
      "stereo_slam/odometry", "stereo_slam/local_map"}},
    {"stereo_slam/loop_closing",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/rig", "stereo_slam/frontend",
      "stereo_slam/odometry"}},
    {"stereo_slam/inertial", {"stereo_slam/core"}},
    {"stereo_slam/slam",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/rig", "stereo_slam/frontend",
      "stereo_slam/odometry", "stereo_slam/local_map", "stereo_slam/tracking", "stereo_slam/loop_closing",
      "stereo_slam/inertial"}},
    {"stereo_slam/evaluation", {"stereo_slam/core", "stereo_slam/io"}},
    {"stereo_slam/results",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/calibration",
      "stereo_slam/dataset", "stereo_slam/rig", "stereo_slam/loop_closing"}},
    {"stereo_slam/ros2_output",  // of bags the records of MCAP, of report small images
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/dataset", "stereo_slam/bags", "stereo_slam/slam",
      "stereo_slam/results", "stereo_slam/report"}},
    {"stereo_slam/report",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/evaluation",
      "stereo_slam/results"}},
    {"stereo_slam", {"stereo_slam/core", "stereo_slam/calibration"}},  // stereo_slam.hpp, for other programs
    {"stereo_slam/library",
     {"stereo_slam", "stereo_slam/settings", "stereo_slam/images", "stereo_slam/calibration",
      "stereo_slam/dataset", "stereo_slam/results", "stereo_slam/slam"}},
    {"stereo_slam/visualization",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/codecs", "stereo_slam/settings",
      "stereo_slam/tracking"}},
    {"simulator/textures", {}},
    {"simulator/rendering", {"stereo_slam/core", "stereo_slam/calibration", "simulator/textures"}},
    {"simulator/world", {"stereo_slam/core", "stereo_slam/io", "simulator/textures", "simulator/rendering"}},
    {"simulator/recording",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/codecs", "stereo_slam/calibration",
      "stereo_slam/dataset", "simulator/textures", "simulator/rendering", "simulator/world"}},
    {"stereo_slam/app",
     {"stereo_slam/core", "stereo_slam/io", "stereo_slam/settings", "stereo_slam/images",
      "stereo_slam/calibration", "stereo_slam/imu", "stereo_slam/dataset", "stereo_slam/bags",
      "stereo_slam/tracking", "stereo_slam/slam", "stereo_slam/evaluation", "stereo_slam/results",
      "stereo_slam/ros2_output", "stereo_slam/report", "stereo_slam/visualization", "simulator/rendering",
      "simulator/recording"}},
};

/// "antipode/filters/detail/progression.hpp" is in "antipode/filters".
[[nodiscard]] std::string folder_of(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  auto part = folder.begin();
  if (part == folder.end()) return "";
  fs::path result = *part++;
  if (part != folder.end()) result /= *part;
  return result.generic_string();
}

/// The folder that a header in .../detail/ belongs to; nothing for other headers.
[[nodiscard]] std::optional<std::string> owner_of_detail(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  if (folder.filename() != "detail") return std::nullopt;
  return folder.parent_path().generic_string();
}

/// The rule that is broken where `file` includes `included`; empty if none is. Both are paths as they are
/// written in #include lines.
[[nodiscard]] std::string broken_rule(const std::string& file, const std::string& included) {
  if (file == "antipode/antipode.hpp") return "";  // includes everything
  const std::string from = folder_of(file), to = folder_of(included);
  if (!kMayInclude.contains(from)) return "folder \"" + from + "\" is not in the table of this test";
  if (!kMayInclude.contains(to)) return "folder \"" + to + "\" is not in the table of this test";
  if (included == "antipode/antipode.hpp") return "include the headers that are needed, not the umbrella";
  const auto owner = owner_of_detail(included);
  if (owner && *owner != from && !(*owner == "antipode" && from.starts_with("antipode/"))) {
    return "the detail/ of another folder is private";
  }
  const bool library_from_example = to.starts_with("antipode") && !from.starts_with("antipode");
  if (from == to || library_from_example || kMayInclude.at(from).contains(to)) return "";
  return "\"" + from + "\" may not include \"" + to + "\"";
}

struct Include {
  std::string file;  ///< as it would be included: relative to include/ or examples/
  int line;
  std::string included;
};

/// The #include lines of a file that name the library, the SLAM or the simulator.
void read_includes(const fs::path& path, const std::string& file, std::vector<Include>& includes) {
  std::ifstream stream(path);
  std::string text;
  for (int line = 1; std::getline(stream, text); ++line) {
    if (!text.starts_with("#include ")) continue;
    const auto begin = text.find_first_of("<\"") + 1, end = text.find_first_of(">\"", begin);
    const std::string included = text.substr(begin, end - begin);
    for (const char* product : {"antipode/", "stereo_slam/", "simulator/"}) {
      if (included.starts_with(product)) includes.push_back({file, line, included});
    }
  }
}

[[nodiscard]] std::vector<std::pair<fs::path, std::string>> source_files() {
  const fs::path root = ANTIPODE_SOURCE_DIR;
  std::vector<std::pair<fs::path, std::string>> files;
  for (const char* folder : {"include/antipode", "examples/stereo_slam", "examples/simulator"}) {
    const fs::path base = (root / folder).parent_path();
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() != ".hpp" && entry.path().extension() != ".cpp") continue;
      files.emplace_back(entry.path(), fs::relative(entry.path(), base).generic_string());
    }
  }
  return files;
}

[[nodiscard]] std::vector<Include> all_includes() {
  std::vector<Include> includes;
  for (const auto& [path, file] : source_files()) read_includes(path, file, includes);
  return includes;
}

/// A way from `at` back to the first folder of `path`, which it extends; false if there is none.
[[nodiscard]] bool find_cycle(const Graph& graph, std::vector<std::string>& path,
                              std::set<std::string>& visited) {
  const auto edges = graph.find(path.back());
  if (edges == graph.end()) return false;
  for (const std::string& next : edges->second) {
    if (next == path.front()) return true;
    if (!visited.insert(next).second) continue;
    path.push_back(next);
    if (find_cycle(graph, path, visited)) return true;
    path.pop_back();
  }
  return false;
}

/// "a -> b -> a" for some cycle of the graph; empty if there is none.
[[nodiscard]] std::string cycle_in(const Graph& graph) {
  for (const auto& [folder, edges] : graph) {
    std::vector<std::string> path{folder};
    std::set<std::string> visited;
    if (!find_cycle(graph, path, visited)) continue;
    std::string text;
    for (const std::string& step : path) text += step + " -> ";
    return text + folder;
  }
  return "";
}

}  // namespace

TEST_CASE("Every include follows the table of folders", "[layout]") {
  const auto includes = all_includes();
  REQUIRE(includes.size() > 500);
  std::ostringstream violations;
  for (const auto& [file, line, included] : includes) {
    const std::string rule = broken_rule(file, included);
    if (!rule.empty()) violations << file << ':' << line << ": includes " << included << ": " << rule << '\n';
  }
  INFO(violations.str());
  CHECK(violations.str().empty());
}

TEST_CASE("No folders include each other in a circle", "[layout]") {
  CHECK(cycle_in(kMayInclude) == "");
  Graph graph;
  for (const auto& [file, line, included] : all_includes()) {
    if (file == "antipode/antipode.hpp" || folder_of(file) == folder_of(included)) continue;
    graph[folder_of(file)].insert(folder_of(included));
  }
  CHECK(cycle_in(graph) == "");
}

TEST_CASE("No folder of the SLAM has more than 20 source files", "[layout]") {
  constexpr int kMostSources = 20;
  std::map<std::string, int> sources;
  for (const auto& [path, file] : source_files()) {
    if (file.starts_with("stereo_slam/") && path.extension() == ".cpp") ++sources[folder_of(file)];
  }
  for (const auto& [folder, count] : sources) {
    CAPTURE(folder);
    CHECK(count <= kMostSources);
  }
}

TEST_CASE("The algorithm includes nothing of the program but settings and file access", "[layout]") {
  const std::set<std::string> algorithm = {
      "stereo_slam/core",         "stereo_slam/rig",       "stereo_slam/frontend",
      "stereo_slam/odometry",     "stereo_slam/local_map", "stereo_slam/tracking",
      "stereo_slam/loop_closing", "stereo_slam/inertial",  "stereo_slam/slam"};
  for (const auto& folder : algorithm) {
    for (const auto& included : kMayInclude.at(folder)) {
      CAPTURE(folder, included);
      const bool allowed = included == "stereo_slam/settings" || included == "stereo_slam/io";
      CHECK((allowed || algorithm.contains(included)));
    }
  }
}

/// Number of lines of a file of stereo_slam that match.
[[nodiscard]] int count_lines(const std::string& file, const std::string& pattern) {
  std::ifstream stream(fs::path(ANTIPODE_SOURCE_DIR) / "examples/stereo_slam" / file);
  REQUIRE(stream);
  const std::regex regex(pattern);
  int count = 0;
  for (std::string text; std::getline(stream, text);) count += std::regex_search(text, regex);
  return count;
}

TEST_CASE("The SLAM can be known: at most 25 settings, and ten members that hold its state", "[layout]") {
  const int settings = count_lines("settings/schema.cpp", R"(\.add\()");
  CHECK(settings >= 20);
  CHECK(settings <= 25);
  constexpr auto kMember = R"(^  [A-Z]\w+ \w+_;)";
  const int members = count_lines("slam/slam.hpp", kMember) + count_lines("slam/slam_system.hpp", kMember);
  CHECK(members >= 8);
  CHECK(members <= 10);
}

TEST_CASE("Upward includes, private headers and unknown folders are reported", "[layout]") {
  CHECK(broken_rule("antipode/filters/predict.hpp", "antipode/geometry/quaternion.hpp") == "");
  CHECK(broken_rule("antipode/geometry/quaternion.hpp", "antipode/filters/predict.hpp") ==
        R"("antipode/geometry" may not include "antipode/filters")");
  CHECK(broken_rule("antipode/filters/predict.hpp", "antipode/filters/detail/progression.hpp") == "");
  CHECK(broken_rule("antipode/filters/predict.hpp", "antipode/detail/check.hpp") == "");
  CHECK(broken_rule("antipode/filters/predict.hpp", "antipode/geometry/detail/series.hpp") ==
        "the detail/ of another folder is private");
  CHECK(broken_rule("stereo_slam/core/types.hpp", "antipode/detail/check.hpp") ==
        "the detail/ of another folder is private");
  CHECK(broken_rule("stereo_slam/slam/slam.cpp", "stereo_slam/tracking/update.hpp") == "");
  CHECK(broken_rule("stereo_slam/tracking/update.cpp", "stereo_slam/slam/slam.hpp") ==
        R"("stereo_slam/tracking" may not include "stereo_slam/slam")");
  CHECK(broken_rule("stereo_slam/attic/old.cpp", "stereo_slam/core/types.hpp") ==
        R"(folder "stereo_slam/attic" is not in the table of this test)");
  CHECK(cycle_in({{"a", {"b"}}, {"b", {"c"}}, {"c", {"b"}}}) == "b -> c -> b");
}
