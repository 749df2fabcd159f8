// SPDX-License-Identifier: MIT
// Monte-Carlo study of whole runs: which layout of the state gives the better pose, and a consistent
// covariance of it, after hundreds of frames. Prints a Markdown table.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include "bundle_adjustment.hpp"
#include "drive.hpp"
#include "layouts.hpp"
#include "stereo_world.hpp"

namespace consistency {
namespace {

constexpr std::array<int, 4> kReported = {10, 50, 100, 200};

struct Row {
  const char* name;
  bool has_covariance = true;
  std::array<ErrorStatistics, kReported.size()> errors{};
};

/// Runs an estimator over the drive and adds its errors at the reported frames.
template <class Estimator>
void run(Estimator estimator, const Drive& drive, Row& row) {
  for (std::size_t k = 0; k < drive.frames.size(); ++k) {
    const PoseGaussian<double> estimate = estimator.process(drive.frames[k], drive);
    for (std::size_t i = 0; i < kReported.size(); ++i) {
      if (static_cast<int>(k) == kReported[i]) row.errors[i].add(estimate, drive.frames[k].T_world_camera);
    }
  }
}

struct WindowOf {
  SlidingWindow window;
  PoseGaussian<double> process(const DriveFrame& frame, const Drive&) {
    return {window.process(frame), Matrix6<double>::Identity()};
  }
};

void print(const Row& row) {
  std::printf("| %s |", row.name);
  for (const auto& e : row.errors)
    row.has_covariance ? std::printf(" %.3g |", e.anees()) : std::printf(" - |");
  for (const auto& e : row.errors) std::printf(" %.4f |", e.translation_rmse_m());
  for (const auto& e : row.errors) std::printf(" %.4f |", e.rotation_rmse_deg());
  std::printf("\n");
}

}  // namespace
}  // namespace consistency

int main(int argc, char** argv) {
  using namespace consistency;
  const int runs = argc > 1 ? std::max(2, std::atoi(argv[1])) : 100;
  const bool yardstick = argc <= 2;
  Row odometry{"odometry alone"}, global{"one global map (paper)"},
      chain{"anchored, odometry chain as prior"}, recursive{"anchored, recursive"},
      considered{"anchored, recursive, correlations considered"},
      window{"bundle adjustment, 10 keyframes", false};
  for (int r = 0; r < runs; ++r) {
    const Drive drive = random_drive(static_cast<unsigned>(r), kReported.back() + 1);
    run(OdometryOnly{}, drive, odometry);
    run(GlobalMap{}, drive, global);
    run(Anchored{false}, drive, chain);
    run(Anchored{true}, drive, recursive);
    run(Considered{}, drive, considered);
    if (yardstick) run(WindowOf{SlidingWindow(drive.camera, 10)}, drive, window);
  }
  std::printf("%d runs; 95 %% band of the ANEES 6 +- %.2f\n\n| layout |", runs, anees_band(runs));
  for (const char* what : {"ANEES", "position RMSE (m)", "rotation RMSE (deg)"}) {
    for (const int k : kReported) std::printf(" %s, frame %d |", what, k);
  }
  std::printf("\n|---|");
  for (std::size_t i = 0; i < 3 * kReported.size(); ++i) std::printf("---|");
  std::printf("\n");
  for (const Row* row : {&odometry, &global, &chain, &recursive, &considered}) print(*row);
  if (yardstick) print(window);
  return 0;
}
