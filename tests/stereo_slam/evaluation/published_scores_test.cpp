// SPDX-License-Identifier: MIT
// Scores of published trajectories by other programs.
#include <string>

#include <fmt/format.h>

#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// Figures of independent programs (the KITTI devkit's rule, evo 1.36), to the digits they were printed with.
struct Golden {
  const char* estimate;
  const char* t_rel;
  const char* r_rel;
  std::size_t segments;
  const char* ate_aligned;
  const char* ate_first;
};

std::string digits(double value, int count) { return fmt::format("{:.{}f}", value, count); }

Evaluation evaluate_files(const fs::path& truth, const fs::path& estimate) {
  return evaluate(read_trajectory(truth), read_trajectory(estimate));
}

}  // namespace

TEST_CASE("The KITTI scores and ATE of published trajectories come out to the last printed digit",
          "[evaluate][data]") {
  const auto data = data_folder();
  if (!data) return;
  const auto golden =
      GENERATE(Golden{"00/estimate_orbslam2_stereo.txt", "0.7035", "0.2492", 3283, "1.2981", "7.7540"},
               Golden{"00/estimate_orbslam2_evo.txt", "0.6997", "0.2533", 3283, "1.3034", "7.7903"},
               Golden{"00/estimate_sptam.txt", "1.4870", "0.5577", 3283, "3.7385", "9.2246"},
               Golden{"04/estimate_orbslam2_stereo.txt", "0.4834", "0.1724", 43, "0.2136", "0.8108"},
               Golden{"07/estimate_orbslam2_stereo.txt", "0.4861", "0.2688", 317, "0.5207", "0.8201"},
               Golden{"10/estimate_orbslam2_stereo.txt", "0.5912", "0.2437", 464, "0.9164", "5.6905"});
  CAPTURE(golden.estimate);
  const fs::path estimate = *data / "trajectories/kitti" / golden.estimate;
  const auto e = evaluate_files(estimate.parent_path() / "poses.txt", estimate);
  REQUIRE(e.kitti);
  CHECK(digits(e.kitti->t_rel_percent, 4) == golden.t_rel);
  CHECK(digits(e.kitti->r_rel_deg_per_100m, 4) == golden.r_rel);
  CHECK(e.kitti->segments == golden.segments);
  CHECK(digits(e.ate_aligned_m.rmse, 4) == golden.ate_aligned);
  CHECK(digits(e.ate_first_pose_m.rmse, 4) == golden.ate_first);
}

TEST_CASE("evo's statistics on KITTI 00 come out to the last printed digit", "[evaluate][data]") {
  const auto data = data_folder();
  if (!data) return;
  const fs::path folder = *data / "trajectories/kitti/00";
  const auto e = evaluate_files(folder / "poses.txt", folder / "estimate_orbslam2_evo.txt");
  CHECK(digits(e.ate_aligned_m.max, 6) == "3.587949");
  CHECK(digits(e.ate_aligned_m.mean, 6) == "1.156997");
  CHECK(digits(e.ate_aligned_m.median, 6) == "1.065625");
  CHECK(digits(e.ate_aligned_m.rmse, 6) == "1.303450");
  CHECK(digits(e.rpe_10m->translation_m.rmse, 6) == "0.226261");
  CHECK(digits(e.rpe_10m->translation_m.mean, 6) == "0.169017");
  CHECK(digits(e.rpe_frame->translation_m.rmse, 6) == "0.028120");
  CHECK(digits(e.rpe_frame->translation_m.mean, 6) == "0.019301");
}

TEST_CASE("evo's statistics on EuRoC V1_02 come out to the last printed digit", "[evaluate][data]") {
  const auto data = data_folder();
  if (!data) return;
  const fs::path folder = *data / "trajectories/euroc";
  const auto e = evaluate_files(folder / "V1_02_groundtruth.csv", folder / "V1_02_estimate.txt");
  CHECK(e.estimate_poses == 807);
  CHECK(e.matched == 798);
  CHECK(digits(e.ate_aligned_m.max, 6) == "0.255817");
  CHECK(digits(e.ate_aligned_m.mean, 6) == "0.081522");
  CHECK(digits(e.ate_aligned_m.median, 6) == "0.077912");
  CHECK(digits(e.ate_aligned_m.rmse, 6) == "0.091727");
  CHECK(digits(e.rpe_frame->translation_m.rmse, 6) == "0.015077");
  CHECK(digits(e.rpe_frame->translation_m.mean, 6) == "0.006107");
}
