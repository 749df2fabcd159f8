// SPDX-License-Identifier: MIT
// Settings at the ends of their ranges, limits of the process, and inputs that are accepted with a warning.
#include <random>
#include <sstream>
#include <sys/resource.h>

#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/settings/schema.hpp"
#include "stereo_slam/settings/settings_io.hpp"
#include "stereo_slam/support/program.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// The ends of a range "a number from 0 to 1", or nothing for names.
std::vector<std::string> ends_of(const SettingsField& field) {
  std::istringstream words(field.allowed);
  std::vector<std::string> ends;
  for (std::string word; words >> word;) {
    if (word == "from" || word == "to") words >> ends.emplace_back();
  }
  return ends;
}

/// A dozen settings, each at one of its ends.
Settings extreme_settings(const std::string& preset, std::mt19937& random) {
  constexpr int kChanged = 12;
  const auto& fields = settings_fields();
  Settings settings = preset_settings(preset);
  for (int i = 0; i < kChanged; ++i) {
    const auto& field = fields[std::uniform_int_distribution<std::size_t>(0, fields.size() - 1)(random)];
    const auto ends = ends_of(field);
    if (ends.size() == 2) REQUIRE(field.set(settings, ends[random() % 2]));
  }
  return settings;
}

}  // namespace

TEST_CASE("Settings at the ends of their ranges run", "[faults]") {
  const TemporaryFolder folder;
  CHECK(call({"simulate", "--quiet", "--output", folder / "in", "--frames", "6", "--scale", "0.25"}).status ==
        0);
  std::mt19937 random(7);
  for (int i = 0; i < 12; ++i) {
    const std::string preset = i % 2 == 0 ? "default" : "paper";
    std::ostringstream text;
    write_settings(text, extreme_settings(preset, random));
    write_text(folder / "s.yaml", text.str());
    CAPTURE(text.str());
    const auto run = call({"run", "--quiet", "--overwrite", "--dataset", folder / "in", "--output",
                           folder / "out", "--config", folder / "s.yaml"});
    // Some extremes let no point pass, or none after the first frame, and say so; no other error is allowed.
    const auto says = [&](const char* words) { return run.err.find(words) != std::string::npos; };
    if (says("tracked 0 of 6 frames") || says("tracked 1 of 6 frames")) {
      CHECK(run.status == 1);
    } else {
      CHECK(run.err == "");
      CHECK(run.status == 0);
    }
  }
}

TEST_CASE("Loops that the preset paper cannot have are named", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  write_text(folder / "s.yaml", "preset: paper\nloop_closure: {enabled: true}\n");
  const std::vector<std::string> run = {"run",          "--dataset",   folder / "in", "--output",
                                        folder / "out", "--overwrite", "--config",    folder / "s.yaml"};
  const auto result = call(run);
  CHECK(result.status == 0);
  CHECK(result.err == "stereo_slam: warning: no loop is closed, because the preset paper has no keyframes\n");
  write_text(folder / "s.yaml", "preset: paper\n");
  CHECK(call(run).err.empty());
}

TEST_CASE("A stack that is too small is named", "[faults]") {
  const auto result = call({"info", "--dataset", "x"}, [] {
    constexpr rlimit kBytes = {256 * 1024, 256 * 1024};
    setrlimit(RLIMIT_STACK, &kBytes);
  });
  check_one_line_failure(result, "the stack is limited to 256 kB");
}

TEST_CASE("Too little memory for the libraries of image codecs is named as that", "[faults]") {
  const TemporaryFolder folder;
  for (const int limit_mb : {350, 450, 550}) {  // enough for the program
    if (kReservesAddresses) continue;           // the sanitizer needs more than any limit
    CAPTURE(limit_mb);
    const auto result = call({"simulate", "--quiet", "--frames", "2", "--scale", "0.1", "--output",
                              folder / fmt::format("town{}", limit_mb)},
                             [&] {
                               const rlim_t bytes = static_cast<rlim_t>(limit_mb) << 20;
                               const rlimit limit{bytes, bytes};
                               (void)setrlimit(RLIMIT_AS, &limit);
                             });
    if (result.status != 0) check_one_line_failure(result, "there is not enough memory");
  }
}

TEST_CASE("Two poses of one stamp are named if they are far apart", "[faults]") {
  const TemporaryFolder folder;
  const std::string poses = "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n3 2 0 0 0 0 0 1\n";
  write_text(folder / "truth.txt", poses);
  const auto error_with = [&](const std::string& last) {
    write_text(folder / "tum.txt", poses + last);
    const auto result =
        call({"evaluate", "--groundtruth", folder / "truth.txt", "--estimate", folder / "tum.txt"});
    CHECK(result.status == 0);
    return result.err;
  };
  CHECK_THAT(error_with("3 2.01 0 0 0 0 0 1\n"), !Catch::Contains("the stamp of the pose before"));
  CHECK_THAT(error_with("3 99 0 0 0 0 0 1\n"),
             Catch::Contains("tum.txt: 1 pose has the stamp of the pose before"));
}
