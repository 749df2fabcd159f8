// SPDX-License-Identifier: MIT
#include "slam.hpp"

#include <chrono>

#include "features.hpp"
#include "odometry.hpp"
#include "optical_flow.hpp"

namespace stereo_slam {
namespace {

/// Names and times the stages of one frame.
class StageClock {
 public:
  void lap(const char* stage) {
    const auto now = std::chrono::steady_clock::now();
    times_.push_back({stage, std::chrono::duration<double, std::milli>(now - last_).count()});
    last_ = now;
  }
  [[nodiscard]] const std::vector<StageTime>& times() const noexcept { return times_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::vector<StageTime> times_;
};

}  // namespace

struct Slam::State {
  StereoCamera camera;
  Settings settings;
  StereoPyramid previous;
  std::vector<StereoPoint> odometry_points;
  Pose last_motion = Pose::identity();
  std::vector<PoseEstimate> trajectory;
};

Slam::Slam(const StereoCamera& camera, const Settings& settings)
    : state_(std::make_unique<State>(State{camera, settings, {}, {}, Pose::identity(), {}})) {}
Slam::~Slam() = default;
Slam::Slam(Slam&&) noexcept = default;
Slam& Slam::operator=(Slam&&) noexcept = default;

FrameResult Slam::process(const StereoFrame& frame) {
  StageClock clock;
  State& s = *state_;
  FrameResult result;
  result.index = frame.index;
  result.stamp_ns = frame.stamp_ns;
  const auto features = extract_features(frame, s.settings.features);
  clock.lap("features");
  const auto pyramids = build_pyramids(frame);
  clock.lap("pyramids");
  PoseEstimate pose = s.trajectory.empty() ? PoseEstimate{} : s.trajectory.back();
  if (!s.trajectory.empty()) {
    const auto odometry = estimate_odometry(s.previous, s.odometry_points, pyramids, s.camera, s.last_motion,
                                            s.settings.seed + frame.index, s.settings.odometry);
    s.last_motion = odometry.T_previous_current.pose;
    pose.pose = pose.pose * s.last_motion;
    result.odometry = odometry.T_previous_current;
    result.status = odometry.valid ? TrackingStatus::kOk : TrackingStatus::kLost;
    result.matches = static_cast<int>(odometry.inliers_px.size());
    clock.lap("odometry");
  }
  s.odometry_points = select_odometry_points(features.left, {}, frame, s.settings);
  clock.lap("stereo");
  s.previous = pyramids;
  s.trajectory.push_back(pose);
  result.features = static_cast<int>(features.left.size());
  result.T_world_camera = pose;
  result.times = clock.times();
  return result;
}

std::vector<PoseEstimate> Slam::trajectory() const { return state_->trajectory; }
std::vector<MapPoint> Slam::map_points() const { return {}; }

}  // namespace stereo_slam
