// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/displacement_estimation.hpp"
#include "stereo_slam/rig/excess_variance.hpp"
#include "stereo_slam/rig/learned_cameras.hpp"
#include "stereo_slam/rig/lens_residual.hpp"
#include "stereo_slam/rig/rectification_estimator.hpp"
#include "stereo_slam/rig/right_image_monitor.hpp"
#include "stereo_slam/rig/seen_motion.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/rig/vibration.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// The right image of a frame: whether it fits the left one, as far as the frame was measured, and its
/// displacement besides the error of the rectification.
struct RightImageState {
  RightImageMonitor monitor;
  ImageDisplacement::Coefficients displacement = ImageDisplacement::Coefficients::Zero();  ///< px
  ImageDisplacement::Covariance covariance = ImageDisplacement::Covariance::Zero();        ///< of it, px^2
  std::optional<LateMotion> late{};  ///< how the rig moved until its exposure; nothing if it is unknown

  /// Whether it is left out, judged by the points searched so far.
  [[nodiscard]] bool is_ignored() const { return monitor.judgement() == RightImage::kIgnored; }
};

/// What the motion to a keyframe has to do with the rig.
struct KeyframeMotion {
  Matrix6<double> covariance = Matrix6<double>::Zero();  ///< of it, due to what is not known of the rig
  Eigen::Matrix<double, 6, LensResidual::kTerms> by_lens =
      Eigen::Matrix<double, 6, LensResidual::kTerms>::Zero();  ///< d motion / d coefficients of the lens
  Remeasurement remeasurement;                                 ///< of the keyframe, by what the motion taught
  Vector6<double> change = Vector6<double>::Zero();  ///< of the motion by the same, on the right, rad and m
};

/// The owner of what is known of the two cameras besides their calibration: the errors of rectification and
/// lenses, which are learned while driving, the delay of right images, how they are displaced, and whether
/// they fit the left ones. It tells how a frame is seen, is told what was seen, and tells what that changed.
class RightCamera {
 public:
  RightCamera(const StereoCamera& camera, const OnlineRectificationSettings& settings)
      : camera_(camera), settings_(settings), rectification_(camera, settings) {}

  /// Goes on from what an earlier run learned, with the drift that is possible since then.
  void resume(const RectificationEstimate& learned) {
    rectification_ = RectificationEstimator::after_drift(camera_, settings_, learned);
  }
  /// Begins with a delay of the right images that is known from elsewhere.
  void begin_with_delay(const DelayEstimate& known) {
    if (settings_.enabled) rectification_.begin_with_delay(known);
  }

  // How a frame is seen.

  [[nodiscard]] const StereoCamera& camera() const noexcept { return camera_; }
  /// The last frame.
  [[nodiscard]] StereoView view_of(const StereoFrame& frame) const { return view_of(frame, image_); }
  /// A frame whose right image is so.
  [[nodiscard]] StereoView view_of(const StereoFrame& frame, const RightImageState& image) const {
    return {frame, camera_, geometry(image), !image.is_ignored()};
  }
  /// What both lenses do to an image.
  [[nodiscard]] LensResidual lens() const { return rectification_.current().lens(); }
  /// What measures points without right images.
  [[nodiscard]] LeftCamera left_camera() const { return {camera_, lens(), rectification_.lens_covariance()}; }
  /// The right image of the next frame, of which nothing is measured yet.
  [[nodiscard]] RightImageState next_image(bool has_right) const;
  /// Whether the right image of the frame is left out, judged by the points searched so far.
  [[nodiscard]] bool is_ignored() const { return image_.is_ignored(); }
  /// Whether the points of the frame fit, or nothing is known: see RightImageMonitor.
  [[nodiscard]] bool fits() const { return image_.monitor.fits(); }
  [[nodiscard]] RightImage judgement() const { return image_.monitor.judgement(); }
  /// Whether right images are late, so that their geometry depends on the velocity.
  [[nodiscard]] bool is_late() const { return rectification_.delay().has_value(); }
  /// Whether the right images of frames may be displaced: the rig vibrates, or they are late, and the
  /// velocity at their exposure is not exactly known.
  [[nodiscard]] bool may_be_displaced() const { return vibration_.present() || is_late(); }
  /// Whether a right image has the displacement that next_image() expected.
  [[nodiscard]] bool expects(const RightImageState& image) const {
    return image.displacement == vibration_.held().displacement;
  }
  /// Whether that displacement is still to be measured: it jumped after the last keyframe.
  [[nodiscard]] bool measures_jump() const { return !vibration_.held().covariance.isZero(0.0); }
  /// Whether the right image of the last frame is displaced against where it was expected: its displacement
  /// is measured in this frame.
  [[nodiscard]] bool is_displaced() const { return may_be_displaced() || vibration_.has_jumped(); }
  /// Whether the displacement that the landmarks of a frame show is too large for the rig as it was so far: a
  /// knock, or the first frame of a vibration.
  [[nodiscard]] bool is_surprised_by(const DisplacementEstimate& shown) const {
    return vibration_.is_surprised_by(shown);
  }
  /// What is known of a displacement that is searched: hardly anything. That of a late image is a rotation.
  [[nodiscard]] DisplacementPrior searched_displacement() const;
  /// What is known of the displacement of such a frame, relative to that it has, besides what its landmarks
  /// show.
  [[nodiscard]] DisplacementPrior displacement_prior(const RightImageState& image) const;
  /// How the rig moves until the right image of a frame is exposed, if the motion to this frame had the
  /// velocity `measured`: the mean over that motion, and how it changed since the last one, until the
  /// exposure.
  [[nodiscard]] LateMotion motion_until_exposure(const RigVelocity& measured) const;
  /// The same if the velocity is unknown, by the rows of the frame: they show how the rig turns about two
  /// axes if its other motion is small, enough to search along them.
  [[nodiscard]] std::optional<LateMotion> motion_by_rows(const StereoFrame& frame) const;
  /// Sets the translation of a right image whose velocity is known to that of the motion to its frame.
  [[nodiscard]] Remeasurement move_with(const RigVelocity& measured, RightImageState& image) const;
  /// Whether the next motion is to show whether the disparities have a large error: until one has told, but
  /// not by frames before the first `motion_known`, which were lost; and at most ten times.
  [[nodiscard]] bool tests_disparities(bool motion_known) const noexcept {
    return disparity_tests_left_ > 0 && !(motion_known && disparities_tested_);
  }
  [[nodiscard]] bool learns() const noexcept { return settings_.enabled; }

  // What was seen. What was measured in the last frame follows the Remeasurement.

  /// Takes how the rig moves until the right image of the frame that begins the map is exposed, as its rows
  /// show it. Does nothing unless right images are late.
  void begin_late(const StereoFrame& frame);

  /// Tests the disparities by the error that a motion shows, if it shows one, and takes the error if it is
  /// clear: it was there from the start. Nothing if it is not.
  std::optional<Remeasurement> test_disparities(const std::optional<SharedDisparityError>& shown);
  /// Takes the right image of a frame as it was measured, and learns from its displacement how the rig
  /// vibrates; `left` is what the landmarks show of it besides.
  void take(const RightImageState& image, const std::optional<DisplacementEstimate>& left);
  /// The right image of a frame with a displacement that it shows. That of a late one is a rotation of the
  /// rig until its exposure.
  [[nodiscard]] RightImageState displaced(const RightImageState& image,
                                          const DisplacementEstimate& left) const;
  /// Corrects the displacement of the frame by what the landmarks show.
  Remeasurement displace(const DisplacementEstimate& left);
  /// Learns the velocity of the motion to the last frame; nothing if it is unknown. A late right image keeps
  /// the rotation with which it was measured, to which its displacement belongs.
  Remeasurement move_with(const std::optional<RigVelocity>& measured);
  /// Corrects how the rig moved until the late right image of the last frame, a keyframe, was exposed, by the
  /// velocity of the motion after it. It then tells of the delay, too.
  Remeasurement expose_with(const RigVelocity& next);
  /// Adds stereo matches of a keyframe, measured as view_of() says: they observe the row offsets and a delay.
  void add_rows(std::span<const StereoMeasurement> matches) {
    if (!settings_.enabled) return;
    if (is_late()) begin_late_keyframe(matches);
    if (!is_late() || measured_velocity_) rectification_.add_rows(matches);  // else they are in other rows
  }
  /// Refines the rectification by the motion from the last keyframe, seen by its landmarks. If the landmarks
  /// do not tell how the motion depends on the rectification, the points of the odometry do, if it alone
  /// measured the motion; they are followed over one frame only, and refine nothing.
  KeyframeMotion refine(const SeenMotion& by_landmarks, const SeenMotion& by_odometry);
  /// As refine(), but the rectification is not refined: for landmarks without disparities.
  KeyframeMotion consider(const SeenMotion& by_landmarks);
  /// Notes how the pose of a frame, seen by its landmarks, depends on the rig; `position` is its number.
  /// Returns its covariance due to what is not known of the rig.
  Matrix6<double> note_frame(std::size_t position, const SeenMotion& by_landmarks);
  /// Forgets what an earlier run learned if the rows of the first frame contradict it. Returns whether they
  /// do.
  bool refuse_learned();
  /// Learns the row offsets anew from a pair in which hardly any stereo match is found, or none was searched
  /// yet. Returns whether the rows had been displaced. Those of a late rig are displaced by its motion.
  bool relearn_rows(const StereoFrame& frame);
  /// Ends a frame, which was lost or whose right image did not fit if `unmeasured`. The cameras may have been
  /// moved: in the second such frame in a row, and then in every tenth, the row offsets are learned anew.
  /// Returns whether the rows had been displaced.
  bool end_frame(const StereoFrame& frame, bool unmeasured);

  // What changed.

  /// Whether the last keyframe told that the right camera was turned. That was measured in every frame since
  /// it happened.
  [[nodiscard]] bool noticed_turn() const noexcept { return came_to_rest_; }
  /// What the uncertainty of the motions until the late right images of the last keyframe and of the last
  /// frame were exposed adds to the covariance of the motion between them.
  [[nodiscard]] Matrix6<double> exposure_covariance(const SeenMotion& motion) const;
  /// At the end: what was learned of the rig since each of these motions was measured, which are those that
  /// were refined or considered, in order. Nothing if the rig is not learned.
  [[nodiscard]] std::vector<MotionChange> correct(const std::vector<Pose>& motions);
  /// Before correct(): the same for the frames between these keyframes that were noted, which are at
  /// `T_keyframe_frame`, by their numbers.
  [[nodiscard]] std::vector<FrameChange> frame_changes(const std::vector<Pose>& T_keyframe_frame) const;
  /// What was learned so far, to be reported.
  [[nodiscard]] RigSummary summary() const;
  /// What another run with the same cameras can begin with.
  [[nodiscard]] LearnedCameras learned() const { return {camera_, rectification_.estimate()}; }
  /// The errors that the calibration may have, given how large those are that the images show.
  [[nodiscard]] CalibrationError calibration_error(const CalibrationSettings& allowed) const;

 private:
  [[nodiscard]] PairGeometry geometry(const RightImageState& image) const;
  [[nodiscard]] double delay_s() const { return rectification_.delay().value_or(DelayEstimate{}).seconds; }
  [[nodiscard]] bool vibrates() const;
  void begin_late_keyframe(std::span<const StereoMeasurement> matches);
  [[nodiscard]] SeenMotion with_exposures(SeenMotion motion) const;
  KeyframeMotion keep(const MotionEvidence& motion, const PairGeometry& before);

  static constexpr int kFirstRelearn = 2;      // frames in a row
  static constexpr int kRelearnInterval = 10;  // frames

  StereoCamera camera_;
  OnlineRectificationSettings settings_;
  bool refused_learned_ = false;
  RectificationEstimator rectification_;
  std::vector<MotionEvidence> motions_;  // to the keyframes so far
  struct NotedFrame {
    std::size_t position, keyframe;
    FrameDependence dependence;
  };
  std::vector<NotedFrame> frames_;  // between keyframes
  RightImageState image_;           // of the last frame
  Vibration vibration_;
  std::optional<RigVelocity> measured_velocity_;            // of the motion to the last frame
  Vector6<double> change_per_s_ = Vector6<double>::Zero();  // of it, from the motion before
  Vector3<double> surprise2_ =
      Vector3<double>::Zero();  // mean square of what its translation was beside a constant change
  int surprises_ = 0;
  std::optional<LateMotion> keyframe_motion_;  // until the late right image of the last keyframe was exposed
  std::vector<StereoMeasurement> keyframe_matches_;  // of that image
  ExcessVariance turns_;       // of the right camera until it is exposed, beside those by the velocity, rad
  bool came_to_rest_ = false;  // at the last keyframe, after a displacement
  bool disparities_tested_ = false;  // a motion told whether they have a large error
  int disparity_tests_left_ = 10;
  int unmeasured_frames_ = 0;  // in a row
};

}  // namespace stereo_slam
