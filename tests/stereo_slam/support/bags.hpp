// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>
#include <optional>
#include <string>
#include <sys/wait.h>

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

/// The bags of the tests, which write_bags.py writes once, and what is expected of all of them.
namespace stereo_slam::test {

constexpr int kFrames = 5;
constexpr std::int64_t kFirst_ns = 1'500'000'000'000'000'000;

/// The bags of write_bags.py; nothing, and a warning, where bags cannot be written or read.
inline std::optional<fs::path> bags() {
  static const TemporaryFolder folder;
  static const int status = [&] {
    write_tiny_folders(folder.path(), kFrames);
    fs::remove(folder / "calibration.yaml");
    for (const auto* side : {"left", "right"}) {
      for (int i = 0; i < kFrames; ++i) {
        const fs::path png = folder / side / frame_name(i);
        cv::imwrite(fs::path(png).replace_extension(".pgm").string(),
                    cv::imread(png.string(), cv::IMREAD_GRAYSCALE));
      }
    }
    const int result =
        std::system(fmt::format("/usr/bin/python3 {} {}", BAG_WRITER, folder.path().string()).c_str());
    return WIFEXITED(result) ? WEXITSTATUS(result) : 1;
  }();
  constexpr int kSkipped = 77;
  if (status == kSkipped || !BAGS_ARE_READ) {
    WARN("skipped: python3-rosbag, python3-sensor-msgs or librosbag-storage-dev is not installed");
    return std::nullopt;
  }
  REQUIRE(status == 0);
  return folder.path();
}

inline cv::Mat original(const fs::path& folder, const char* side, int frame) {
  return cv::imread((folder / side / frame_name(frame)).string(), cv::IMREAD_GRAYSCALE);
}

inline void check_images(const SequenceScan& scan, const fs::path& folder) {
  for (const auto& problem : scan.problems) FAIL(problem.text);
  const auto& sequence = scan.sequence;
  CHECK(sequence.format == "bag");
  CHECK(sequence.camera.baseline_m == Approx(0.4));
  REQUIRE(sequence.frames.size() == kFrames);
  for (const int i : {3, 0, 4}) {
    const auto frame = load_frame(sequence, static_cast<std::size_t>(i));
    CHECK(frame.stamp_ns == kFirst_ns + 100'000'000LL * i);
    CHECK(cv::norm(frame.left, original(folder, "left", i), cv::NORM_INF) <= 1.0);
    CHECK(cv::norm(frame.right, original(folder, "right", i), cv::NORM_INF) <= 1.0);
  }
}

inline std::string error_of(const fs::path& file, const BagOptions& options = {}) {
  const auto scan = scan_bag(file, options);
  REQUIRE_FALSE(scan.problems.empty());
  CHECK(is_error(scan.problems.front()));
  CHECK_THAT(scan.problems.front().text, Catch::StartsWith(file.string()));
  return scan.problems.front().text;
}

}  // namespace stereo_slam::test
