// SPDX-License-Identifier: MIT
// From raw images to a trajectory: rendered through distorting lenses, and real.
#include "simulator/recording/simulate.hpp"
#include "simulator/rendering/lens_view.hpp"
#include "stereo_slam/app/runner.hpp"
#include "stereo_slam/dataset/euroc.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

void write_rendered(const fs::path& folder, Distortion model, int frames, double scale) {
  simulator::SimulationSettings settings;
  settings.frames = frames;
  settings.samples_per_pixel = 4;
  settings.texture_size_px = 256;
  settings.rig = simulator::euroc_like_rig(model, scale);
  simulator::simulate(settings, folder);
}

StereoAgreement agreement(const StereoSequence& sequence) {
  std::vector<StereoFrame> frames;
  for (const std::size_t i : spread(sequence.frames.size(), 5)) frames.push_back(load_frame(sequence, i));
  return check_stereo_agreement(frames);
}

RunSummary run_quietly(const StereoSequence& sequence, const fs::path& output, PoseFrame frame,
                       int threads = 2) {
  return run(
      sequence, Settings{},
      {.output = output, .max_frames = std::nullopt, .threads = threads, .quiet = true, .pose_frame = frame});
}

}  // namespace

TEST_CASE("A rendered sequence with lens distortion is rectified and tracked, in either frame",
          "[euroc][slam]") {
  for (const auto model : {Distortion::kRadTan, Distortion::kEquidistant}) {
    CAPTURE(model);
    const TemporaryFolder folder;
    write_rendered(folder / "in", model, 14, 0.6);
    const auto scan = scan_sequence(folder / "in", "auto");
    CHECK(scan.problems.empty());
    const auto& sequence = scan.sequence;

    // Raw, the rows are several pixels apart.
    StereoSequence raw = sequence;
    raw.rectifier = nullptr;
    CHECK(agreement(raw).row_offset_px > 1.5);
    const auto rectified = agreement(sequence);
    CAPTURE(rectified.row_offset_px, rectified.matches);
    CHECK(rectified.conclusive());
    CHECK(rectified.row_offset_px <= 0.3);

    CHECK(run_quietly(sequence, folder / "body", PoseFrame::kBody).error.empty());
    const auto truth_file = folder / "in/mav0/state_groundtruth_estimate0/data.csv";
    const auto body =
        evaluate(read_trajectory(truth_file), read_trajectory(folder / "body/trajectory_tum.txt"));
    CAPTURE(body.truth_length_m, body.ate_aligned_m.rmse, body.ate_first_pose_m.rmse);
    CHECK(body.matched == 14);
    CHECK(body.ate_aligned_m.rmse < 0.005 * body.truth_length_m);
    CHECK(body.ate_first_pose_m.rmse < 0.01 * body.truth_length_m);
    CHECK(body.rpe_frame->rotation_deg.rmse < 0.1);

    // The truth in the camera's frame knows the rectifying rotation.
    CHECK(run_quietly(sequence, folder / "camera", PoseFrame::kCamera).error.empty());
    Trajectory truth{TrajectoryFormat::kTum, sequence.ground_truth_ns, sequence.ground_truth};
    const auto camera = evaluate(truth, read_trajectory(folder / "camera/trajectory_tum.txt"));
    CHECK(camera.ate_first_pose_m.rmse < 0.01 * body.truth_length_m);
    CHECK(camera.rpe_frame->rotation_deg.rmse == Approx(body.rpe_frame->rotation_deg.rmse).epsilon(1e-3));
  }
}

TEST_CASE("CLAHE changes the images, not the geometry", "[euroc][slam]") {
  const TemporaryFolder folder;
  write_rendered(folder / "in", Distortion::kRadTan, 3, 0.5);
  const auto sequence = open_sequence(folder / "in", "auto");
  const auto plain = load_frame(sequence, 0);
  const auto equalised = load_frame(sequence, 0, {.clahe = true});
  cv::Scalar mean;
  cv::Scalar plain_spread;
  cv::Scalar equalised_spread;
  cv::meanStdDev(plain.left, mean, plain_spread);
  cv::meanStdDev(equalised.left, mean, equalised_spread);
  CHECK(equalised_spread[0] > plain_spread[0]);
  CHECK(check_stereo_agreement({equalised}).row_offset_px <= 0.3);
}

TEST_CASE("Standing still for twelve real frames drifts by at most 5 mm, on any number of threads",
          "[euroc][data]") {
  const auto data = data_folder();
  if (!data) return;
  const TemporaryFolder folder;
  const auto scan = scan_sequence(*data / "euroc/V1_01_easy_first12", "auto");
  CHECK(scan.problems.empty());
  const auto& sequence = scan.sequence;
  REQUIRE(sequence.frames.size() == 12);
  // ORB-SLAM2's EuRoC.yaml has this camera rectified with fx 435.2047 and fx b 47.9064; how much of the
  // border is cut off differs between versions of OpenCV.
  CHECK(sequence.camera.fx == Approx(435.2047).epsilon(0.005));
  CHECK(sequence.camera.fx * sequence.camera.baseline_m == Approx(47.9064).epsilon(0.005));
  CHECK(sequence.rectifier->coverage() > 0.999);
  const auto check = agreement(sequence);
  CAPTURE(check.row_offset_px, check.matches);
  CHECK(check.conclusive());
  CHECK(check.row_offset_px <= 0.5);
  CHECK(problems_of(check, sequence).empty());

  CHECK(run_quietly(sequence, folder.path(), PoseFrame::kBody).error.empty());
  double drift_m = 0.0;
  for (const auto& pose : read_trajectory(folder / "trajectory_kitti.txt").poses)
    drift_m = std::max(drift_m, pose.translation().norm());
  CAPTURE(drift_m);
  CHECK(drift_m <= 0.005);
  CHECK(run_quietly(sequence, folder / "one", PoseFrame::kBody, 1).error.empty());
  for (const auto* name : {"trajectory_kitti.txt", "covariances.csv", "map.ply"})
    CHECK(read_text(folder / "one" / name) == read_text(folder / name));
  const auto scores =
      evaluate(read_trajectory(*data / "euroc/V1_01_easy_first12/mav0/state_groundtruth_estimate0/data.csv"),
               read_trajectory(folder / "trajectory_tum.txt"));
  CHECK(scores.matched == 12);
}
