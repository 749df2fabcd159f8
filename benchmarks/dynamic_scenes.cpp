// SPDX-License-Identifier: MIT
// Drives among more and more vehicles, with the flow gate and without: prints a Markdown table. See
// docs/results/dynamic.md.
//
//   dynamic_scenes [FRAMES [SCALE [VEHICLES...]]]     without: 200 frames of KITTI's size, among 0, 4, 12 and
//   40

#include "stereo_slam/support/dynamic_scenes.hpp"

#include <cstdio>
#include <cstdlib>
#include <string>

#include "stereo_slam/settings/presets.hpp"

namespace {

using namespace stereo_slam;
using namespace stereo_slam::test;

void print_row(int vehicles, const std::string& name, const DynamicOutcome& o) {
  const auto not_ok = std::count_if(o.results.begin() + 1, o.results.end(), [](const FrameResult& result) {
    return result.status != TrackingStatus::kOk;
  });
  const auto matches = static_cast<double>(o.matches.all) / static_cast<double>(o.results.size());
  const auto percent = [](int part, int whole) { return whole > 0 ? 100.0 * part / whole : 0.0; };
  fmt::print(
      "| {} | {} | {:.0f} ({:.0f}) | {:.0f} | {:.0f}, {:.1f} | {:.1f} | {:.1f} | {:.0f} | {} | {:.3f} |\n",
      vehicles, name, 100.0 * o.features.value(), 100.0 * o.most_features, 100.0 * o.landmarks.value(),
      percent(o.refused.moving, o.followed.moving), percent(o.refused.standing(), o.followed.standing()),
      100.0 * o.odometry.value(), 100.0 * o.matches.value(), matches, not_ok, o.ate_m);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : 200;
  const double scale = argc > 2 ? std::atof(argv[2]) : 1.0;
  std::vector<int> counts;
  for (int i = 3; i < argc; ++i) counts.push_back(std::atoi(argv[i]));
  if (counts.empty()) counts = {0, 4, 12, 40};
  fmt::print(
      "| vehicles | | features on them, most in a frame % | landmarks on them % | refused: moving, standing "
      "% | "
      "odometry on them % | matches on them % | matches a frame | not OK | ATE m |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
  for (const int vehicles : counts) {
    const DynamicDrive drive(frames, vehicles, scale);
    for (const auto& preset : {"default", "paper"}) {
      const Settings gated = preset_settings(preset);
      Settings ungated = gated;
      ungated.association.flow_tolerance_px = 1e4;
      print_row(vehicles, preset, run_among_vehicles(drive, gated));
      print_row(vehicles, fmt::format("{}, no flow gate", preset), run_among_vehicles(drive, ungated));
    }
  }
}
