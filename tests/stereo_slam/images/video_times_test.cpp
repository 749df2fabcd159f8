// SPDX-License-Identifier: MIT
#include <cmath>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/matroska.hpp"
#include "stereo_slam/support/support.hpp"
#include "stereo_slam/support/tiny_video.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// The tiny recording as two Matroska videos whose frames have these times.
void write_videos(const fs::path& folder, const std::vector<int>& times_ms,
                  const MatroskaHeader& header = {}) {
  const int frames = static_cast<int>(times_ms.size());
  write_tiny_folders(folder, frames);
  write_text(folder / "calibration.yaml", tiny_calibration(""));
  for (const std::string side : {"left", "right"}) {
    MatroskaVideo video;
    for (int i = 0; i < frames; ++i) {
      video.add(cv::imread((folder / side / frame_name(i)).string()), times_ms[static_cast<std::size_t>(i)]);
    }
    video.write(folder / (side + ".mkv"), header);
    fs::remove_all(folder / side);
  }
}

/// Times at a constant rate with a pause of half a second, and every third frame dropped after it.
std::vector<int> variable_times_ms() {
  std::vector<int> times_ms;
  for (int i = 0; i < 40; ++i) {
    if (i < 20 || i % 3 != 0) times_ms.push_back(i * 33 + (i < 12 ? 0 : 500));
  }
  return times_ms;
}

void check_times(const StereoSequence& sequence, const std::vector<int>& times_ms) {
  REQUIRE(sequence.frames.size() == times_ms.size());
  for (std::size_t i = 0; i < times_ms.size(); ++i) {
    CAPTURE(i);
    constexpr double kRounding_ns = 1e6;  // of the times in the file
    CHECK(std::abs(static_cast<double>(load_frame(sequence, i).stamp_ns) - 1e6 * times_ms[i]) <=
          kRounding_ns);
  }
  CHECK(sequence.source->warning().empty());
}

}  // namespace

TEST_CASE("Frames of a video have their own times, and their number is counted", "[video]") {
  const auto times_ms = variable_times_ms();
  const double duration_ms = times_ms.back() + 33.0;
  // Without the duration of a frame, FFmpeg takes the rate for 1000 Hz; with it, the number of frames is
  // wrong.
  for (const MatroskaHeader& header :
       {MatroskaHeader{.frame_ms = 0.0, .duration_ms = duration_ms},
        MatroskaHeader{.frame_ms = 33.0, .duration_ms = duration_ms}, MatroskaHeader{}}) {
    CAPTURE(header.frame_ms, header.duration_ms);
    const TemporaryFolder folder;
    write_videos(folder.path(), times_ms, header);
    const SequenceScan scan = scan_sequence(folder.path(), "auto");
    INFO((scan.problems.empty() ? "" : scan.problems.front().text));
    CHECK(scan.problems.empty());
    check_times(scan.sequence, times_ms);
    const double nominal_ms = 1e-6 * static_cast<double>(scan.sequence.frames.back().stamp_ns);
    CHECK(nominal_ms == Approx(times_ms.back()).epsilon(0.05));
  }
}

TEST_CASE("A frame rate in the calibration replaces the times of a video", "[video]") {
  const TemporaryFolder folder;
  write_videos(folder.path(), variable_times_ms());
  write_text(folder / "calibration.yaml", tiny_calibration("frame_rate_hz: 10\n"));
  const StereoSequence sequence = open_sequence(folder.path(), "auto");
  for (const std::size_t i : {0U, 5U, 20U})
    CHECK(load_frame(sequence, i).stamp_ns == static_cast<std::int64_t>(i) * 100'000'000);
}

TEST_CASE("Times that are those of a constant rate but for rounding are those of the rate", "[video]") {
  const TemporaryFolder folder;
  std::vector<int> times_ms;
  for (int i = 0; i < 30; ++i) times_ms.push_back(static_cast<int>(std::lround(i * 1000.0 / 30.0)));
  write_videos(folder.path(), times_ms, {.frame_ms = 1000.0 / 30.0, .duration_ms = 1000.0});
  const StereoSequence sequence = open_sequence(folder.path(), "auto");
  for (std::size_t i = 0; i < times_ms.size(); ++i)
    CHECK(load_frame(sequence, i).stamp_ns == sequence.frames[i].stamp_ns);
  write_tiny_video(folder / "avi", 12, 12);
  const StereoSequence avi = open_sequence(folder / "avi", "auto");
  for (std::size_t i = 0; i < 12; ++i)
    CHECK(load_frame(avi, i).stamp_ns == static_cast<std::int64_t>(i) * 100'000'000);
}

TEST_CASE("The extension of a video may have capitals", "[video]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 6, 6);
  fs::rename(folder / "left.avi", folder / "left.AVI");
  fs::rename(folder / "right.avi", folder / "right.Avi");
  CHECK(open_sequence(folder.path(), "auto").frames.size() == 6);
}
