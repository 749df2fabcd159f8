// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "simulator/recording/simulate.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/slam/slam_system.hpp"
#include "stereo_slam/tracking/associate.hpp"
#include "support/files.hpp"

/// Drives among moving vehicles whose pixels are known, and how much of what the SLAM uses lies on them.
namespace stereo_slam::test {

/// Rendered street of `frames` frames with `vehicles`, drawn with `seed`, in images of `scale` times KITTI's
/// size.
class DynamicDrive {
 public:
  DynamicDrive(int frames, int vehicles, double scale, std::uint64_t seed = 1) {
    simulator::SimulationSettings settings;
    settings.seed = seed;
    settings.frames = frames;
    settings.dynamic_objects = vehicles;
    settings.moving_masks = true;
    settings.camera = scaled(settings.camera, scale);
    simulator::simulate(settings, folder_.path());
    sequence_ = open_sequence(folder_.path(), "kitti");
  }

  [[nodiscard]] const StereoSequence& sequence() const { return sequence_; }
  [[nodiscard]] Trajectory truth() const { return read_trajectory(folder_ / "poses.txt"); }

  /// White where something moves.
  [[nodiscard]] cv::Mat1b mask(std::size_t frame) const {
    return cv::imread(folder_ / fmt::format("moving/{:06}.png", frame), cv::IMREAD_GRAYSCALE);
  }

 private:
  antipode::test::TemporaryFolder folder_;
  StereoSequence sequence_;
};

/// How many positions there are, and how many of them on what moves.
struct MovingShare {
  int all = 0;
  int moving = 0;

  void add(const cv::Mat1b& mask, const Vector2<double>& px) {
    const cv::Point nearest(static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y())));
    if (!cv::Rect({}, mask.size()).contains(nearest)) return;
    ++all;
    moving += mask(nearest) != 0 ? 1 : 0;
  }
  [[nodiscard]] int standing() const { return all - moving; }
  [[nodiscard]] double value() const { return all > 0 ? static_cast<double>(moving) / all : 0.0; }
};

struct DynamicOutcome {
  std::vector<FrameResult> results;
  double ate_m = 0.0;          ///< of the final poses
  MovingShare features;        ///< of the left images
  double most_features = 0.0;  ///< the largest share in one frame
  MovingShare landmarks;       ///< of those that should be in view
  MovingShare followed;        ///< landmarks whose flow was observed
  MovingShare refused;         ///< ... and refused by the flow gate
  MovingShare matches;         ///< that the pose rests on
  MovingShare odometry;        ///< points that the odometry rests on
};

/// Runs the SLAM on a drive.
inline DynamicOutcome run_among_vehicles(const DynamicDrive& drive, const Settings& settings) {
  DynamicOutcome outcome;
  const auto slam = make_slam_system(drive.sequence().camera, settings);
  cv::Mat1b mask_before;
  for (std::size_t i = 0; i < drive.sequence().frames.size(); ++i) {
    const StereoFrame frame = load_frame(drive.sequence(), i);
    const cv::Mat1b mask = drive.mask(i);
    AssociationTrace trace;
    outcome.results.push_back(slam->process(frame, &trace));
    MovingShare features;
    for (const auto& feature : extract_features(frame.left, settings.features)) {
      features.add(mask, feature.position_px);
    }
    outcome.features.all += features.all;
    outcome.features.moving += features.moving;
    outcome.most_features = std::max(outcome.most_features, features.value());
    for (const auto& landmark : trace.landmarks) {
      outcome.landmarks.add(mask, landmark.predicted_px);
      if (landmark.matched_px) outcome.matches.add(mask, *landmark.matched_px);
      if (!landmark.flow) continue;
      outcome.followed.add(mask_before, landmark.flow->from_px);
      if (!landmark.static_flow) outcome.refused.add(mask_before, landmark.flow->from_px);
    }
    for (const auto& px : trace.odometry_px) outcome.odometry.add(mask, px);
    mask_before = mask;
  }
  slam->finish();
  Trajectory estimate;
  for (const auto& pose : slam->trajectory()) {
    Eigen::Isometry3d T_world_camera = Eigen::Isometry3d::Identity();
    T_world_camera.linear() = pose.pose.rotation_matrix();
    T_world_camera.translation() = pose.pose.translation();
    estimate.poses.push_back(T_world_camera);
  }
  outcome.ate_m = evaluate(drive.truth(), estimate).ate_aligned_m.rmse;
  return outcome;
}

}  // namespace stereo_slam::test
