// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/slam.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

#include <antipode/distributions/pose_algebra.hpp>

#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/frontend/spatial_index.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/local_map/landmark_projection.hpp"
#include "stereo_slam/local_map/map.hpp"
#include "stereo_slam/local_map/seen_landmarks.hpp"
#include "stereo_slam/loop_closing/async_loop_closer.hpp"
#include "stereo_slam/loop_closing/landmark_cloud.hpp"
#include "stereo_slam/odometry/constant_velocity.hpp"
#include "stereo_slam/odometry/odometry.hpp"
#include "stereo_slam/slam/bridging.hpp"
#include "stereo_slam/slam/relocalisation.hpp"
#include "stereo_slam/slam/stage_clock.hpp"
#include "stereo_slam/tracking/associate.hpp"
#include "stereo_slam/tracking/association_trace.hpp"
#include "stereo_slam/tracking/match_refinement.hpp"
#include "stereo_slam/tracking/predict.hpp"
#include "stereo_slam/tracking/rectification_constraints.hpp"
#include "stereo_slam/tracking/update.hpp"

namespace stereo_slam {
namespace {

/// Camera that landmarks and poses are relative to.
struct ReferenceFrame {
  std::size_t frame = 0;
  PoseGaussian T_previous_keyframe;
  PoseGaussian T_world_keyframe;
};

/// Pose of a frame relative to its keyframe.
struct TrackedFrame {
  std::size_t keyframe = 0;
  PoseGaussian T_keyframe_camera;
  bool seen = true;  // false: predicted
};

/// What the pose of a frame rests on.
enum class PoseBasis {
  kNothing,    ///< predicted
  kOdometry,   ///< measured against the last frame
  kLandmarks,  ///< and against the keyframe's landmarks
  kKeyframe,   ///< against the keyframe, recognised
};

[[nodiscard]] TrackingStatus status_of(PoseBasis basis, bool was_lost) {
  switch (basis) {
    case PoseBasis::kNothing:
      return TrackingStatus::kLost;
    case PoseBasis::kOdometry:
      return TrackingStatus::kWeak;
    case PoseBasis::kLandmarks:
      return was_lost ? TrackingStatus::kRelocalised : TrackingStatus::kOk;
    case PoseBasis::kKeyframe:
      return TrackingStatus::kRelocalised;
  }
  return TrackingStatus::kLost;
}

/// Pose of a keyframe in itself: known, up to what the densities' floors leave.
[[nodiscard]] PoseDensity certain_pose() {
  constexpr double kVariance = 1e-10;
  return PoseDensity::from_pose_covariance(Pose::identity(), kVariance * Matrix6<double>::Identity());
}

[[nodiscard]] std::vector<Vector2<double>> positions(const std::vector<Match>& matches) {
  std::vector<Vector2<double>> result;
  result.reserve(matches.size());
  for (const auto& match : matches) result.push_back(match.z.head<2>());
  return result;
}

[[nodiscard]] std::vector<StereoPoint> measurements(const std::vector<Match>& matches) {
  std::vector<StereoPoint> result;
  result.reserve(matches.size());
  for (const auto& match : matches) result.push_back(match.z);
  return result;
}

}  // namespace

struct Slam::State {
  StereoCamera camera;
  Settings settings;

  std::vector<ReferenceFrame> keyframes{1};  // the first is the world's origin
  bool started = false;                      // a picture came that a map could begin with
  std::size_t segment = 0;
  bool placed = true;         // the segment's place in the map is known
  bool place_news = false;    // and no frame's status has said so yet
  bool in_loaded_map = true;  // so is that of some segment of the run
  MapExtent loaded;           // the map that the run started with
  LoadedLandmarks loaded_landmarks;
  Pose T_odometry_keyframe = Pose::identity();  // the last keyframe without any loop correction
  std::vector<TrackedFrame> frames;
  PoseDensity posterior = certain_pose();  // T_keyframe_camera of the last frame
  Map map;
  std::size_t keyframe_landmarks = 0;  // when the keyframe was taken
  cv::Mat keyframe_left;
  Keyframe last_keyframe;  // what is recognised first after a loss

  RectificationEstimator rectification;
  std::optional<AsyncLoopCloser> loops;

  StereoPyramid previous;
  std::size_t previous_frame = 0;  // of `frames`, that the pictures are from
  std::vector<StereoPoint> odometry_points;
  std::vector<StereoPoint> static_points;  // landmarks as matched in the previous frame
  ConstantVelocity velocity;
  bool lost = false;  // the last frame

  [[nodiscard]] bool anchored() const { return settings.map.layout == MapLayout::kAnchored; }

  [[nodiscard]] bool tracks_correlation() const {
    return anchored() && settings.map.track_correlation && !settings.map.update_landmarks;
  }

  [[nodiscard]] CalibrationError calibration_error() const {
    const auto& sigma = settings.calibration;
    return {sigma.scale_sigma, sigma.principal_point_sigma_px / camera.fx};
  }

  [[nodiscard]] PoseGaussian in_world(const PoseGaussian& T_keyframe_camera) const {
    return compose(keyframes.back().T_world_keyframe, T_keyframe_camera);
  }

  /// Begins the map, if this picture shows enough for one.
  void start(const StereoFrame& frame, const StereoFeatures& features) {
    keyframes.front().frame = frame.index;
    map.restart(0, camera);
    auto points = add_landmarks(frame, features.left, {});
    velocity.found(frame.stamp_ns);
    started = points.size() >= static_cast<std::size_t>(settings.update.min_matches);
    if (started) begin_keyframe(frame, std::move(points));
  }

  /// The same picture once more, bit by bit, as a camera that hangs delivers it: it says nothing.
  [[nodiscard]] bool repeats_previous(const StereoFrame& frame) const {
    const auto same = [](const cv::Mat& a, const cv::Mat& b) {
      return a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0.0;
    };
    return !previous.left.empty() && same(previous.left.image(), frame.left) &&
           same(previous.right.image(), frame.right);
  }

  [[nodiscard]] std::vector<Match> find_landmarks(const StereoFrame& frame, const StereoFeatures& features,
                                                  const StereoPyramid& pyramids,
                                                  const OdometryResult& odometry, const PoseDensity& prior,
                                                  AssociationTrace* trace) const {
    const PoseGaussian expected = antipode::to_pose_gaussian(prior);
    const auto predicted = project_landmarks(map.landmarks(), expected, camera, settings.map.max_baselines);
    const auto observed =
        observe_flow(predicted, map.landmarks(), antipode::to_pose_gaussian(posterior).pose, camera,
                     previous.left, pyramids.left, settings.association.flow_window_px);
    const auto flow = gate_by_flow(predicted, observed, settings.association);
    const StereoFeatures usable{exclude_features(features.left, odometry.inliers_px, frame.left.size(),
                                                 settings.odometry.exclusion_px),
                                features.right};
    auto matches =
        associate(predicted, map.landmarks(), flow, usable, frame.left.size(), settings.association);
    if (anchored() && settings.refinement.enabled) {
      matches = refine_matches(matches, predicted, flow, map.landmarks(), keyframe_left, frame, expected.pose,
                               camera, rectification.current(), settings.refinement);
    }
    if (trace) {
      *trace =
          trace_association(predicted, observed, flow, matches, odometry.inliers_px, settings.association);
    }
    return matches;
  }

  /// New landmarks from features that have a stereo match and are away from `reserved_px`; what they were
  /// made from. Where one of `seen` is, it goes on.
  std::vector<KeyframePoint> add_landmarks(const StereoFrame& frame, const std::vector<Feature>& features,
                                           const std::vector<Vector2<double>>& reserved_px,
                                           const SeenLandmarks& seen = {}) {
    const auto points =
        measure_stereo_points(frame, features, reserved_px, rectification.current(), settings);
    std::vector<std::uint32_t> ids;
    for (const auto& known : seen.at(points.measurements, frame.left.size())) {
      ids.push_back(known ? *known : map.new_id());
    }
    map.add(points.measurements, points.descriptors, ids, antipode::to_pose_gaussian(posterior),
            stereo_pixel_covariance(settings.map.pixel_sigma_px), frame, camera, settings.map);
    if (settings.online_rectification.enabled) rectification.add_rows(points.rows);
    return keyframe_points(points, ids);
  }

  /// Lets the landmarks of the ending keyframe, last seen in this frame, tell about the rectification.
  void refine_rectification(const std::vector<Match>& matches) {
    if (!settings.online_rectification.enabled || !settings.refinement.enabled) return;
    rectification.add_motion(
        bias_constraints(matches, map.landmarks(), antipode::to_pose_gaussian(posterior).pose, camera));
    rectification.advance();
  }

  [[nodiscard]] bool needs_keyframe(const StereoFrame& frame, std::size_t matches) const {
    const auto& rule = settings.keyframes;
    return anchored() &&
           (static_cast<double>(matches) < rule.min_match_ratio * static_cast<double>(keyframe_landmarks) ||
            matches < static_cast<std::size_t>(rule.min_matches) ||
            frame.index >= keyframes.back().frame + static_cast<std::size_t>(rule.max_frames));
  }

  /// Cuts the map before this frame: where that is relative to the last keyframe is a guess. The frame that
  /// the odometry came from was not placed either, but is known from here.
  void begin_segment(const StereoFrame& frame, const StereoFeatures& features,
                     const OdometryResult& odometry) {
    ++segment;
    placed = place_news = false;
    change_keyframe(frame, features, {});
    const auto T_current_previous = antipode::inverse(odometry.T_previous_current);
    frames[previous_frame] = {keyframes.size() - 1, T_current_previous};
  }

  /// Makes the current camera the reference of pose and landmarks.
  void change_keyframe(const StereoFrame& frame, const StereoFeatures& features,
                       const std::vector<Match>& matches) {
    refine_rectification(matches);
    const PoseGaussian T_previous_keyframe = antipode::to_pose_gaussian(posterior);
    keyframes.push_back({frame.index, T_previous_keyframe, in_world(T_previous_keyframe)});
    T_odometry_keyframe = (T_odometry_keyframe * T_previous_keyframe.pose).renormalized();
    posterior = certain_pose();
    frames.back() = {keyframes.size() - 1, PoseGaussian{}};  // a correction that moves the keyframe moves it
    const SeenLandmarks seen(matches, map.landmarks());
    map.restart(keyframes.size() - 1, camera);
    begin_keyframe(frame, add_landmarks(frame, features.left, {}, seen));
  }

  void begin_keyframe(const StereoFrame& frame, std::vector<KeyframePoint> points) {
    keyframe_landmarks = map.landmarks().size();
    keyframe_left = frame.left.clone();
    last_keyframe = {};
    last_keyframe.frame = frame.index;
    last_keyframe.stamp_ns = frame.stamp_ns;
    last_keyframe.segment = segment;
    last_keyframe.points = std::move(points);
    last_keyframe.T_previous_keyframe = keyframes.back().T_previous_keyframe;
    if (loops) loops->add_keyframe(last_keyframe);
  }

  /// Moves the keyframes. The filter lives in the last one's frame and notices nothing.
  void apply(const LoopCorrection& correction) {
    const bool known = segment < correction.segment_placed.size() && correction.segment_placed[segment];
    if (known && !std::exchange(placed, true)) place_news = true;
    const auto& segments = correction.segment_placed;
    in_loaded_map = in_loaded_map || std::find(segments.begin(), segments.end(), true) != segments.end();
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
      keyframes[k].T_world_keyframe =
          k < correction.T_world_keyframe.size()
              ? correction.T_world_keyframe[k]
              : compose(keyframes[k - 1].T_world_keyframe, keyframes[k].T_previous_keyframe);
    }
    loaded_landmarks.correct(correction.T_world_known_keyframe);
  }

  /// Files the pose of the current frame, seen or predicted.
  void record(const PoseDensity& T_keyframe_camera, bool seen, FrameResult& result) {
    frames.push_back({keyframes.size() - 1, antipode::to_pose_gaussian(T_keyframe_camera), seen});
    result.segment = segment;
    result.keyframe = keyframes.back().frame;
    result.relative_covariance = frames.back().T_keyframe_camera.covariance;
    result.calibration = calibration_error();
    result.T_world_camera =
        with_calibration_error(in_world(frames.back().T_keyframe_camera), result.calibration);
    result.T_odometry_camera = (T_odometry_keyframe * frames.back().T_keyframe_camera.pose).renormalized();
  }

  /// Landmarks of the run, numbered as in the saved map, and those of the map that it started with.
  [[nodiscard]] std::vector<MapPoint> all_landmarks(bool with_loaded) const {
    std::vector<MapPoint> points;
    if (with_loaded) points = loaded_landmarks.points();
    for (const auto& point : map.points(camera)) {
      const Pose& T_world_keyframe = keyframes[point.keyframe].T_world_keyframe.pose;
      points.push_back({T_world_keyframe * point.position, point.intensity, loaded.keyframes + point.keyframe,
                        loaded.landmarks + point.landmark});
    }
    if (loops) {
      for (auto& point : points) point.landmark = loops->landmark(point.landmark);
    }
    return merge_landmarks(points);
  }

  /// Passes a picture over that repeats the last one: its pose is a guess, and the filter waits for another.
  void pass_over(const StereoFrame& frame, FrameResult& result) {
    const bool first = previous_frame + 1 == frames.size();
    result.status = started && first && !lost ? TrackingStatus::kWeak : TrackingStatus::kLost;
    PoseGaussian motion;
    motion.pose = velocity.motion_until(frame.stamp_ns);
    record(predict_pose(posterior, motion, false, settings, velocity.unseen_until(frame.stamp_ns)), false,
           result);
  }

  /// Where the filter says that the camera is now continues the odometry's way, whatever the filter says of
  /// the way before.
  void continue_odometry_frame(const PoseDensity& expected) {
    T_odometry_keyframe = (T_odometry_keyframe * expected.pose() * posterior.pose().inverse()).renormalized();
  }

  void learn_velocity(const StereoFrame& frame, PoseBasis basis, const OdometryResult& odometry,
                      const Pose& T_keyframe_previous) {
    if (basis == PoseBasis::kNothing) {
      velocity.unmeasured(frame.stamp_ns);
    } else if (basis == PoseBasis::kLandmarks && !lost) {
      velocity.measured(frame.stamp_ns, T_keyframe_previous.inverse() * posterior.pose());
    } else if (odometry.valid) {
      velocity.measured(frame.stamp_ns, odometry.T_previous_current.pose);
    } else {
      velocity.found(frame.stamp_ns);
    }
  }

  /// Drops landmarks, and adds some where it is time to. Returns whether the frame became a keyframe.
  bool extend_map(const StereoFrame& frame, const StereoFeatures& features, PoseBasis basis,
                  const OdometryResult& odometry, const std::vector<Match>& matches) {
    map.cull(frame.index, settings.map.cull_after_frames, camera);
    if (!anchored()) {
      add_landmarks(frame, features.left, positions(matches));
      return false;
    }
    if (basis == PoseBasis::kOdometry && lost) {
      begin_segment(frame, features, odometry);
      return true;
    }
    if (basis != PoseBasis::kKeyframe && !needs_keyframe(frame, matches.size())) return false;
    change_keyframe(frame, features, basis == PoseBasis::kLandmarks ? matches : std::vector<Match>{});
    return true;
  }

  /// The recursion of Fig. 2 for one frame; where its matches are in the left image.
  std::vector<Vector2<double>> track(const StereoFrame& frame, const StereoFeatures& features,
                                     const StereoPyramid& pyramids, AssociationTrace* trace,
                                     StageClock& clock, FrameResult& result);
};

Slam::Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread)
    : Slam(camera, settings, loop_thread, SavedMap{}, MapUse::kContinue) {}

Slam::Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread,
           const SavedMap& known, MapUse use)
    : state_(std::make_unique<State>()) {
  state_->camera = camera;
  state_->settings = settings;
  // The global layout has but one keyframe, and so nothing that a loop could move.
  if (settings.loop_closure.enabled && state_->anchored()) {
    state_->loops.emplace(camera, settings, loop_thread, known, use);
  }
  state_->rectification = RectificationEstimator(camera, settings.online_rectification);
  if (known.keyframes.empty()) return;
  if (!state_->loops) {
    throw std::invalid_argument(
        "the place in a loaded map is found by loop closure, which these settings leave out");
  }
  check_camera_of(known, camera);
  state_->rectification = RectificationEstimator::resumed(camera, known.rectification);
  state_->loaded = extent_of(known);
  state_->loaded_landmarks = LoadedLandmarks(known);
  state_->placed = state_->in_loaded_map = false;
}
Slam::~Slam() = default;
Slam::Slam(Slam&&) noexcept = default;
Slam& Slam::operator=(Slam&&) noexcept = default;

std::vector<Vector2<double>> Slam::State::track(const StereoFrame& frame, const StereoFeatures& features,
                                                const StereoPyramid& pyramids, AssociationTrace* trace,
                                                StageClock& clock, FrameResult& result) {
  const auto odometry = estimate_odometry(previous, odometry_points, static_points, pyramids, camera,
                                          rectification.current(), velocity.motion_until(frame.stamp_ns),
                                          settings.seed + frame.index, settings.odometry);
  clock.lap("odometry");

  const auto prior = predict_pose(posterior, odometry.T_previous_current, odometry.valid, settings,
                                  velocity.unseen_until(frame.stamp_ns));
  if (tracks_correlation()) map.predict_correlation(odometry.T_previous_current.pose);
  clock.lap("predict");

  const auto matches = find_landmarks(frame, features, pyramids, odometry, prior, trace);
  clock.lap("associate");

  const auto update = update_pose(prior, matches, map.landmarks(), camera, settings.update);
  if (tracks_correlation()) {
    map.update_correlation(antipode::to_pose_gaussian(prior), update.posterior.pose(), update.used, camera);
  }
  clock.lap("update");

  const Pose before = posterior.pose();
  posterior = update.posterior;
  const bool needs_odometry = settings.update.method == PoseUpdateMethod::kNone;
  PoseBasis basis = update.converged && (!needs_odometry || odometry.valid) ? PoseBasis::kLandmarks
                    : odometry.valid                                        ? PoseBasis::kOdometry
                                                                            : PoseBasis::kNothing;
  if (anchored() && (lost || basis == PoseBasis::kNothing)) {
    if (const auto recognised = recognise_keyframe({last_keyframe, map.landmarks(), keyframe_left}, frame,
                                                   features, camera, rectification.current(), settings)) {
      posterior = *recognised;
      basis = PoseBasis::kKeyframe;
    }
    clock.lap("recognise");
  }
  result.status = status_of(basis, lost);
  if (result.status == TrackingStatus::kRelocalised) continue_odometry_frame(prior);

  learn_velocity(frame, basis, odometry, before);
  map.mark_seen(matches, features.left, frame.index);
  if (settings.map.update_landmarks) map.update(matches, posterior, camera);
  static_points = basis == PoseBasis::kLandmarks ? measurements(matches) : std::vector<StereoPoint>{};
  record(posterior, basis != PoseBasis::kNothing, result);
  if (basis != PoseBasis::kNothing)
    result.is_keyframe = extend_map(frame, features, basis, odometry, matches);
  result.segment = segment;
  result.odometry = odometry.T_previous_current;
  result.matches = static_cast<int>(matches.size());
  result.nis = update.nis;
  result.nis_dof = update.nis_dof;
  return positions(matches);
}

FrameResult Slam::process(const StereoFrame& frame, AssociationTrace* trace) {
  State& s = *state_;
  StageClock clock;
  FrameResult result;
  result.index = frame.index;
  result.stamp_ns = frame.stamp_ns;

  if (s.loops) {
    const auto correction = s.loops->correction_due(frame.index);
    result.loop_corrected = correction.has_value();
    if (correction) s.apply(*correction);
    clock.lap("loops");
  }
  if (s.repeats_previous(frame)) {
    s.pass_over(frame, result);
    result.times = clock.times();
    return result;
  }
  const auto features = extract_features(frame, s.settings.features);
  const auto pyramids = build_pyramids(frame);
  clock.lap("features");

  std::vector<Vector2<double>> landmarks_px;
  if (s.started) {
    landmarks_px = s.track(frame, features, as_bright_as(s.previous, pyramids, frame), trace, clock, result);
  } else {
    s.start(frame, features);
    s.record(s.posterior, true, result);
    result.is_keyframe = s.started;
  }
  s.lost = result.status == TrackingStatus::kLost;
  if (s.started && !s.lost && !s.placed) result.status = TrackingStatus::kWeak;
  if (!s.lost && std::exchange(s.place_news, false)) result.status = TrackingStatus::kRelocalised;
  clock.lap("map");

  for (const auto& landmark : s.map.landmarks()) {
    if (landmark.last_seen == frame.index) landmarks_px.push_back(landmark.last_px);
  }
  s.odometry_points =
      select_odometry_points(features.left, landmarks_px, frame, s.rectification.current(), s.settings);
  s.previous = pyramids;
  s.previous_frame = s.frames.size() - 1;
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

SavedMap Slam::saved_map() const {
  if (!state_->loops) throw std::logic_error("a map without loop closure has no keyframes to save");
  SavedMap map;
  map.camera = state_->camera;
  map.rectification = state_->rectification.estimate();
  map.points = state_->all_landmarks(/*with_loaded=*/true);
  state_->loops->save(map);
  return map;
}

std::vector<LoopEvent> Slam::loop_events() const {
  return state_->loops ? state_->loops->events() : std::vector<LoopEvent>{};
}

std::size_t Slam::keyframe_memory_bytes() const { return state_->loops ? state_->loops->memory_bytes() : 0; }

std::vector<PoseGaussian> Slam::trajectory() const {
  std::vector<PoseGaussian> result;
  std::vector<bool> seen;
  for (const auto& frame : state_->frames) {
    result.push_back(compose(state_->keyframes[frame.keyframe].T_world_keyframe, frame.T_keyframe_camera));
    seen.push_back(frame.seen);
  }
  bridge_unseen(result, seen);
  for (auto& pose : result) pose = with_calibration_error(pose, state_->calibration_error());
  return result;
}

std::vector<MapPoint> Slam::map_points() const { return state_->all_landmarks(state_->in_loaded_map); }

}  // namespace stereo_slam
