// SPDX-License-Identifier: MIT
#include "slam.hpp"

#include <algorithm>
#include <chrono>
#include <optional>

#include <Eigen/LU>

#include "associate.hpp"
#include "features.hpp"
#include "landmark_projection.hpp"
#include "loop_closing.hpp"
#include "map.hpp"
#include "match_refinement.hpp"
#include "odometry.hpp"
#include "optical_flow.hpp"
#include "rectification.hpp"
#include "spatial_index.hpp"
#include "stereo_matching.hpp"
#include "update.hpp"

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

/// Camera that landmarks and poses are relative to.
struct ReferenceFrame {
  std::size_t frame = 0;
  PoseEstimate T_previous_keyframe;
  PoseEstimate T_world_keyframe;
};

/// Pose of a frame relative to its keyframe.
struct TrackedFrame {
  std::size_t keyframe = 0;
  PoseEstimate T_keyframe_camera;
};

/// Pose of a keyframe in itself: known, up to what the densities' floors leave.
[[nodiscard]] PoseDensity certain_pose() {
  constexpr double kVariance = 1e-10;
  return PoseDensity::from_pose_covariance(Pose::identity(), kVariance * Matrix6<double>::Identity());
}

/// d (u, v, d) in the camera at `T_keyframe_camera` / d disparity in the keyframe.
[[nodiscard]] Vector3<double> disparity_jacobian(const StereoPoint& z, const Pose& T_keyframe_camera,
                                                 const StereoCamera& camera) {
  const Vector3<double> p_camera = T_keyframe_camera.inverse() * camera.back_project(z);
  return camera.projection_jacobian(p_camera) * T_keyframe_camera.rotation_matrix().transpose() *
         camera.back_projection_jacobian(z).col(2);
}

[[nodiscard]] std::vector<Vector2<double>> positions(const std::vector<Match>& matches) {
  std::vector<Vector2<double>> result;
  result.reserve(matches.size());
  for (const auto& match : matches) result.push_back(match.z.head<2>());
  return result;
}

}  // namespace

struct Slam::State {
  StereoCamera camera;
  Settings settings;

  std::vector<ReferenceFrame> keyframes;
  Pose T_odometry_keyframe = Pose::identity();  // the last keyframe without any loop correction
  std::vector<TrackedFrame> frames;
  PoseDensity posterior = certain_pose();  // T_keyframe_camera of the last frame
  Map map;
  std::size_t keyframe_landmarks = 0;  // when the keyframe was taken
  cv::Mat keyframe_left;

  RectificationEstimator rectification;
  std::optional<LoopClosing> loops;

  StereoPyramid previous;
  std::vector<StereoPoint> odometry_points;
  Pose last_motion = Pose::identity();
  int lost_frames = 0;  // in succession, without odometry

  [[nodiscard]] bool anchored() const { return settings.map.layout == MapLayout::kAnchored; }

  [[nodiscard]] bool tracks_correlation() const {
    return anchored() && settings.map.track_correlation && !settings.map.update_landmarks;
  }

  [[nodiscard]] PoseEstimate in_world(const PoseEstimate& T_keyframe_camera) const {
    return compose(keyframes.back().T_world_keyframe, T_keyframe_camera);
  }

  void start(const StereoFrame& frame, const StereoFeatures& features) {
    keyframes.push_back({frame.index, PoseEstimate{}, PoseEstimate{}});
    begin_keyframe(frame, add_landmarks(frame, features.left, {}));
  }

  [[nodiscard]] std::vector<Match> find_landmarks(const StereoFrame& frame, const StereoFeatures& features,
                                                  const StereoPyramid& pyramids,
                                                  const OdometryResult& odometry,
                                                  const PoseDensity& prior) const {
    const PoseEstimate expected = to_estimate(prior);
    const auto predicted = project_landmarks(map.landmarks(), expected, camera, settings.map.max_baselines);
    const auto flow = gate_by_flow(predicted, map.landmarks(), to_estimate(posterior).pose, camera,
                                   previous.left, pyramids.left, settings.association);
    const StereoFeatures usable{exclude_features(features.left, odometry.inliers_px, frame.left.size(),
                                                 settings.odometry.exclusion_px),
                                features.right};
    const auto matches =
        associate(predicted, map.landmarks(), flow, usable, frame.left.size(), settings.association);
    if (!anchored() || !settings.refinement.enabled) return matches;
    return refine_matches(matches, predicted, flow, map.landmarks(), keyframe_left, frame, expected.pose,
                          camera, rectification.current(), settings.refinement);
  }

  /// New landmarks from features that have a stereo match and are away from `reserved_px`; what they were
  /// made from.
  std::vector<KeyframePoint> add_landmarks(const StereoFrame& frame, const std::vector<Feature>& features,
                                           const std::vector<Vector2<double>>& reserved_px) {
    auto free = exclude_features(features, reserved_px, frame.left.size(), settings.odometry.exclusion_px);
    std::stable_sort(free.begin(), free.end(), [](auto& a, auto& b) { return a.response > b.response; });
    std::vector<Vector2<double>> candidates;
    for (const auto& feature : free) candidates.push_back(feature.position_px);
    std::vector<Vector2<double>> chosen_px;
    std::vector<Descriptor> chosen_descriptors;
    for (const std::size_t i :
         spread_over_buckets(candidates, frame.left.size(), settings.map.cell_px,
                             static_cast<std::size_t>(settings.map.max_new_landmarks))) {
      chosen_px.push_back(candidates[i]);
      chosen_descriptors.push_back(free[i].descriptor);
    }
    const auto stereo =
        match_stereo(frame.left, frame.right, chosen_px, rectification.current(), settings.stereo);
    std::vector<RectificationResidual::Measurement> rows;
    std::vector<StereoPoint> measurements;
    std::vector<Descriptor> descriptors;
    std::vector<KeyframePoint> points;
    for (std::size_t i = 0; i < stereo.size(); ++i) {
      if (!stereo[i]) continue;
      rows.push_back(*stereo[i]);
      measurements.push_back(stereo[i]->z);
      descriptors.push_back(chosen_descriptors[i]);
      points.push_back({stereo[i]->z.cast<float>(), chosen_descriptors[i]});
    }
    map.add(measurements, descriptors, to_estimate(posterior),
            stereo_pixel_covariance(settings.map.pixel_sigma_px), frame, camera, settings.map);
    if (settings.rectification.refine) rectification.add_rows(rows);
    return points;
  }

  /// Lets the landmarks of the ending keyframe, last seen in this frame, tell about the rectification.
  void refine_rectification(const std::vector<Match>& matches) {
    if (!settings.rectification.refine || !settings.refinement.enabled) return;
    const Pose T_keyframe_camera = to_estimate(posterior).pose;
    std::vector<BiasConstraint> constraints;
    for (const auto& match : matches) {
      const Landmark& landmark = map.landmarks()[match.landmark];
      const HomogeneousPoint point = to_point(landmark, landmark.mean, camera);
      const auto first = project(point, Pose::identity(), camera);
      const auto second = project(point, T_keyframe_camera, camera);
      if (!first || !second) continue;
      const Matrix3<double> S = match.predicted.landmark_part + match.R;
      constraints.push_back({match.z - *second, S.inverse(), pose_jacobian(point, T_keyframe_camera, camera),
                             disparity_jacobian(*first, T_keyframe_camera, camera), first->head<2>(),
                             match.z.head<2>()});
    }
    rectification.add_motion(constraints);
    rectification.advance();
  }

  [[nodiscard]] bool needs_keyframe(const StereoFrame& frame, std::size_t matches) const {
    const auto& rule = settings.keyframes;
    return anchored() &&
           (static_cast<double>(matches) < rule.min_match_ratio * static_cast<double>(keyframe_landmarks) ||
            matches < static_cast<std::size_t>(rule.min_matches) ||
            frame.index >= keyframes.back().frame + static_cast<std::size_t>(rule.max_frames));
  }

  /// Makes the current camera the reference of pose and landmarks.
  void change_keyframe(const StereoFrame& frame, const StereoFeatures& features,
                       const std::vector<Match>& matches) {
    refine_rectification(matches);
    const PoseEstimate T_previous_keyframe = to_estimate(posterior);
    keyframes.push_back({frame.index, T_previous_keyframe, in_world(T_previous_keyframe)});
    T_odometry_keyframe = (T_odometry_keyframe * T_previous_keyframe.pose).renormalized();
    posterior = certain_pose();
    frames.back() = {keyframes.size() - 1, PoseEstimate{}};  // a correction that moves the keyframe moves it
    map.restart(keyframes.size() - 1, camera);
    begin_keyframe(frame, add_landmarks(frame, features.left, {}));
  }

  void begin_keyframe(const StereoFrame& frame, std::vector<KeyframePoint> points) {
    keyframe_landmarks = map.landmarks().size();
    keyframe_left = frame.left.clone();
    if (!loops) return;
    Keyframe keyframe;
    keyframe.frame = frame.index;
    keyframe.stamp_ns = frame.stamp_ns;
    keyframe.points = std::move(points);
    keyframe.T_previous_keyframe = keyframes.back().T_previous_keyframe;
    loops->add_keyframe(std::move(keyframe));
  }

  /// Moves the keyframes. The filter lives in the last one's frame and notices nothing.
  void apply(const LoopCorrection& correction) {
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
      keyframes[k].T_world_keyframe =
          k < correction.T_world_keyframe.size()
              ? correction.T_world_keyframe[k]
              : compose(keyframes[k - 1].T_world_keyframe, keyframes[k].T_previous_keyframe);
    }
  }
};

Slam::Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread)
    : state_(std::make_unique<State>()) {
  state_->camera = camera;
  state_->settings = settings;
  // The global layout has but one keyframe, and so nothing that a loop could move.
  if (settings.loop_closure.enabled && state_->anchored()) {
    state_->loops.emplace(camera, settings, loop_thread);
  }
  state_->rectification = RectificationEstimator(camera, settings.rectification);
}
Slam::~Slam() = default;
Slam::Slam(Slam&&) noexcept = default;
Slam& Slam::operator=(Slam&&) noexcept = default;

FrameResult Slam::process(const StereoFrame& frame) {
  State& s = *state_;
  StageClock clock;
  FrameResult result;
  result.index = frame.index;
  result.stamp_ns = frame.stamp_ns;

  if (s.loops) {
    const auto correction = s.loops->correction_due(frame.index);
    if (correction) s.apply(*correction);
    result.loop_corrected = correction.has_value();
    clock.lap("loops");
  }
  const auto features = extract_features(frame, s.settings.features);
  const auto pyramids = build_pyramids(frame);
  clock.lap("features");

  std::vector<Match> matches;
  std::vector<Vector2<double>> landmarks_px;
  if (s.keyframes.empty()) {
    s.start(frame, features);
    result.is_keyframe = true;
  } else {
    const auto odometry =
        estimate_odometry(s.previous, s.odometry_points, pyramids, s.camera, s.rectification.current(),
                          s.last_motion, s.settings.seed + frame.index, s.settings.odometry);
    clock.lap("odometry");

    s.lost_frames = odometry.valid ? 0 : s.lost_frames + 1;
    const auto prior = predict_pose(s.posterior, odometry.T_previous_current, odometry.valid, s.settings,
                                    std::max(1, s.lost_frames));
    if (s.tracks_correlation()) s.map.predict_correlation(odometry.T_previous_current.pose);
    clock.lap("predict");

    matches = s.find_landmarks(frame, features, pyramids, odometry, prior);
    clock.lap("associate");

    const auto update = update_pose(prior, matches, s.map.landmarks(), s.camera, s.settings.update);
    if (s.tracks_correlation()) {
      s.map.update_correlation(to_estimate(prior), to_estimate(update.posterior).pose, update.used, s.camera);
    }
    clock.lap("update");

    const Pose before = to_estimate(s.posterior).pose;
    s.posterior = update.posterior;
    s.last_motion = (before.inverse() * to_estimate(s.posterior).pose).renormalized();
    s.map.mark_seen(matches, features.left, frame.index);
    if (s.settings.map.update_landmarks) s.map.update(matches, s.posterior, s.camera);
    s.map.cull(frame.index, s.settings.map.cull_after_frames, s.camera);
    landmarks_px = positions(matches);
    if (!s.anchored()) s.add_landmarks(frame, features.left, landmarks_px);

    const bool by_odometry_alone = s.settings.update.method == PoseUpdateMethod::kNone;
    result.status = update.converged && (!by_odometry_alone || odometry.valid) ? TrackingStatus::kOk
                    : odometry.valid                                           ? TrackingStatus::kWeak
                                                                               : TrackingStatus::kLost;
    result.odometry = odometry.T_previous_current;
    result.matches = static_cast<int>(matches.size());
    result.nis = update.nis;
    result.nis_dof = update.nis_dof;
    result.is_keyframe = s.needs_keyframe(frame, matches.size());
  }

  s.frames.push_back({s.keyframes.size() - 1, to_estimate(s.posterior)});
  result.keyframe = s.keyframes.back().frame;
  result.relative_covariance = s.frames.back().T_keyframe_camera.covariance;
  result.scale_sigma = s.settings.rectification.scale_sigma;
  result.T_world_camera = with_scale_error(s.in_world(s.frames.back().T_keyframe_camera), result.scale_sigma);
  result.T_odometry_camera = (s.T_odometry_keyframe * s.frames.back().T_keyframe_camera.pose).renormalized();
  if (result.is_keyframe && s.keyframes.back().frame != frame.index)
    s.change_keyframe(frame, features, matches);
  clock.lap("map");

  for (const auto& landmark : s.map.landmarks()) {
    if (landmark.last_seen == frame.index) landmarks_px.push_back(landmark.last_px);
  }
  s.odometry_points =
      select_odometry_points(features.left, landmarks_px, frame, s.rectification.current(), s.settings);
  s.previous = pyramids;
  clock.lap("stereo");

  result.features = static_cast<int>(features.left.size());
  result.landmarks = static_cast<int>(s.map.landmarks().size());
  result.times = clock.times();
  return result;
}

void Slam::finish() {
  if (!state_->loops) return;
  if (const auto correction = state_->loops->finish()) state_->apply(*correction);
}

std::vector<LoopEvent> Slam::loop_events() const {
  return state_->loops ? state_->loops->events() : std::vector<LoopEvent>{};
}

std::size_t Slam::keyframe_memory_bytes() const { return state_->loops ? state_->loops->memory_bytes() : 0; }

std::vector<PoseEstimate> Slam::trajectory() const {
  std::vector<PoseEstimate> result;
  result.reserve(state_->frames.size());
  for (const auto& frame : state_->frames) {
    result.push_back(
        with_scale_error(compose(state_->keyframes[frame.keyframe].T_world_keyframe, frame.T_keyframe_camera),
                         state_->settings.rectification.scale_sigma));
  }
  return result;
}

std::vector<MapPoint> Slam::map_points() const {
  std::vector<MapPoint> result;
  for (const auto& point : state_->map.points(state_->camera)) {
    result.push_back(
        {state_->keyframes[point.keyframe].T_world_keyframe.pose * point.position, point.intensity});
  }
  return result;
}

}  // namespace stereo_slam
