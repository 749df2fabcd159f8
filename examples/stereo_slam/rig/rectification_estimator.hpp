// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/camera_errors.hpp"
#include "stereo_slam/rig/exposure_delay.hpp"
#include "stereo_slam/rig/image_displacement.hpp"
#include "stereo_slam/rig/motion_evidence.hpp"
#include "stereo_slam/rig/pair_geometry.hpp"
#include "stereo_slam/rig/seen_motion.hpp"
#include "stereo_slam/rig/stereo_measurement.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Complete state of a RectificationEstimator, from which another one can resume. The coefficients of rows
/// and of disparities are Gaussian, in information form: mean = information^-1 vector.
struct RectificationEstimate {
  using Information = antipode::Matrix<double, PairGeometry::kTerms>;
  using Basis = PairGeometry::Basis;

  PairGeometry::Coefficients coefficients =
      PairGeometry::Coefficients::Zero();  ///< px; in use: the means at the last advance()
  LensResidual::Coefficients lens = LensResidual::Coefficients::Zero();                     ///< likewise
  Information row_information = Information::Identity();                                    ///< 1/px^2
  Basis row_vector = Basis::Zero();                                                         ///< 1/px
  CameraErrors::Information disparity_information = CameraErrors::Information::Identity();  ///< 1/px^2
  CameraErrors::Coefficients disparity_vector = CameraErrors::Coefficients::Zero();         ///< 1/px
  std::optional<DelayEstimate> delay{};  ///< of the right images; nothing if none is known
  bool has_large_error = false;          ///< of the disparities; what is known tells, too, if it is clear
};

/// Estimates what the rectification has left while driving, as a Gaussian whose mean is fitted recursively.
///
/// Every stereo match observes the row offset. The disparity offset is observed over a motion: it makes near
/// and far points, or those on the left and on the right, disagree about the same motion. A pose and the
/// coefficients are solved for together, the pose is eliminated, and the information of the coefficients adds
/// up from keyframe to keyframe. No ground truth is used.
///
/// The row offset, which is known after a few frames, shows how good the calibration is. The prior of the
/// disparity offset has a standard deviation in proportion to it, so that an exact rectification is hardly
/// changed before enough motions were measured.
class RectificationEstimator {
 public:
  using History = std::vector<ErrorsDuring>;  ///< the errors during each motion

  RectificationEstimator() = default;
  RectificationEstimator(const StereoCamera& camera, const OnlineRectificationSettings& settings);

  /// Resumes from the state of another estimator of the same camera.
  [[nodiscard]] static RectificationEstimator resumed(const StereoCamera& camera,
                                                      const OnlineRectificationSettings& settings,
                                                      const RectificationEstimate& estimate);

  /// As resumed(), but at another time: the right camera may have turned a little since, as rigs do by a
  /// change of temperature. The lenses are as they were.
  [[nodiscard]] static RectificationEstimator after_drift(const StereoCamera& camera,
                                                          const OnlineRectificationSettings& settings,
                                                          const RectificationEstimate& estimate);

  /// Whether the rows since after_drift() are likelier if nothing had been learned: that was of other
  /// cameras.
  [[nodiscard]] bool contradicts_learned() const;
  /// Whether the motions have shown the same of the disparities and lenses; what was learned of them is
  /// dropped then.
  [[nodiscard]] bool dropped_learned() const noexcept { return disparity_.dropped_learned(); }

  /// Stereo matches of one frame, measured with current(). The rows of the next frames are seen with what
  /// they tell; the prior of the disparity offset follows with advance().
  void add_rows(std::span<const StereoMeasurement> matches);

  /// Adds what the same matches tell of a delay of the right images: measured with current() and the delay in
  /// use, while the rig moved so.
  void add_delay(std::span<const StereoMeasurement> matches, const LateMotion& motion);

  /// The delay of the right images in use; nothing if none was known at the start.
  [[nodiscard]] const std::optional<DelayEstimate>& delay() const noexcept { return delay_.used(); }

  /// Begins with a delay that is known from elsewhere.
  void begin_with_delay(const DelayEstimate& known) { delay_.begin_with(known); }

  /// Begins the row offset anew, if corners of a pair, matched without assuming rectification, agree that the
  /// right image is displaced or rolled far from current(). Returns whether they do. Call it where hardly any
  /// stereo match is found: at the start, or after the cameras may have been moved.
  bool relearn_rows(std::span<const CornerPair> corners);
  /// The displacement across the rows, and the roll, that the corners of a pair show besides. Nothing if they
  /// are few, or their rows differ by too much to search along them.
  [[nodiscard]] std::optional<ImageDisplacement::Coefficients> displacement_of_rows(
      std::span<const CornerPair> corners) const;

  /// A motion whose points were all measured with current(). Returns how it depends on the disparity offset.
  /// Ignores the points and returns zero if they are fewer than 30 or do not determine the motion.
  MotionEvidence add_motion(const SeenMotion& motion);

  /// As add_motion() of a rig that vibrates: the right image of the second frame was displaced against that
  /// of the first by what the points show, up to `displacement_covariance`. The coefficients are from then on
  /// those of the second frame.
  MotionEvidence add_motion_of_vibrating_rig(const SeenMotion& motion,
                                             const ImageDisplacement::Covariance& displacement_covariance);

  /// As add_motion(), but the points teach nothing about the disparity offset: only what its uncertainty
  /// means for this motion and for the scale is counted. For points that are measured too roughly to teach,
  /// or too briefly.
  MotionEvidence consider_motion(const SeenMotion& motion);

  /// How the pose of a frame depends on the errors, of which it teaches nothing: the motion to it from the
  /// last keyframe. Nothing if add_motion() would ignore its points.
  [[nodiscard]] std::optional<FrameDependence> dependence_of(const SeenMotion& motion, bool vibrates) const;

  /// Best estimate so far.
  [[nodiscard]] PairGeometry current() const { return PairGeometry(camera_, coefficients_, lens_); }
  [[nodiscard]] RectificationEstimate estimate() const;
  /// The error of the lenses, as far as it is known.
  [[nodiscard]] LensEstimate lens_error() const;
  /// Covariance of its coefficients, px^2.
  [[nodiscard]] Matrix2<double> lens_covariance() const;

  /// Whether the disparity offset contains an error that is larger than the rows suggest.
  [[nodiscard]] bool has_large_error() const noexcept { return disparity_.has_large_error(); }

  /// Best estimates so far of the errors during the motions that were added.
  [[nodiscard]] History history() const { return disparity_.history(); }

  /// The coefficients of the disparity offset when a motion was measured, px, as history() tells, or of now
  /// without it. If the motion itself contradicts a large change, they are those of that time.
  [[nodiscard]] CameraErrors::Coefficients coefficients_during(const MotionEvidence& motion,
                                                               const History& history = {}) const;

  /// Covariance of a motion due to the present uncertainty of the disparity offset, and of its drift during
  /// the motion.
  [[nodiscard]] Matrix6<double> covariance_of(const MotionEvidence& motion) const;

  /// covariance_of() without the error of the scale that all motions share, whose standard deviation is
  /// scale_sigma(). For a motion that was corrected to the best estimate so far.
  [[nodiscard]] Matrix6<double> covariance_besides_scale(const MotionEvidence& motion,
                                                         const Pose& T_first_second) const;

  /// Change of a motion by the change of current() since it was measured, to first order: on the right, rad
  /// and m. None of a rig that vibrates, whose coefficients held for this motion alone.
  [[nodiscard]] Vector6<double> change_in_use(const MotionEvidence& motion) const;

  /// What was learned since a motion was measured. Afterwards the motion counts as measured with the best
  /// estimate so far: that of history(), or of now without it.
  [[nodiscard]] MotionChange correct(MotionEvidence& motion, const Pose& T_first_second,
                                     const History& history = {}) const;
  /// The same of a frame before the second keyframe of a motion that is not corrected yet.
  [[nodiscard]] MotionChange correct(const FrameDependence& frame, const MotionEvidence& motion,
                                     const Pose& T_first_frame, const History& history = {}) const;

  /// Relative standard deviation of all lengths due to the present uncertainty of the disparity offset. Zero
  /// before the first motion.
  [[nodiscard]] double scale_sigma() const;

  /// Forgets most of the disparity offset: the right camera moves by as much as `displacement_px`, and did so
  /// before that was known.
  void forget_disparity_offset(double displacement_px) { disparity_.forget(displacement_px); }

  /// Adds a displacement that the right image will keep.
  void shift(const ImageDisplacement::Coefficients& displacement);

  /// Begins with a displacement of the right image, a and d of ImageDisplacement, that is known with this
  /// covariance, px and px^2.
  void begin_displaced(const Vector2<double>& displacement, const Matrix2<double>& covariance);

  /// Makes current() the mean of everything added so far. Earlier measurements used the former current() and
  /// have to be repeated.
  void advance();

 private:
  using RowInformation = antipode::GaussianInformation<double, PairGeometry::kTerms>;

  MotionEvidence add_motion(const SeenMotion& motion, double confidence, bool vibrates = false);
  [[nodiscard]] std::optional<MotionEvidence> measured(const SeenMotion& motion, bool vibrates) const;
  [[nodiscard]] double bent_rows_px() const;
  void expect_disparity_offset();
  [[nodiscard]] CameraErrors::Coefficients applied() const;
  [[nodiscard]] CameraErrors::Coefficients scale_derivative() const;
  [[nodiscard]] static Matrix6<double> covariance_of(const MotionEvidence& motion,
                                                     const MotionEvidence::Derivative& derivative,
                                                     const ErrorsDuring& errors);
  [[nodiscard]] Matrix6<double> covariance_besides_scale(const MotionEvidence& motion,
                                                         const Pose& T_first_second,
                                                         const ErrorsDuring& errors) const;
  [[nodiscard]] Vector6<double> change_by(const MotionEvidence& motion,
                                          const CameraErrors::Coefficients& coefficients) const;
  [[nodiscard]] static Matrix6<double> nonlinearity_of(const MotionEvidence& motion,
                                                       const ErrorsDuring& errors);
  [[nodiscard]] DelayEstimate used_delay() const { return delay_.used().value_or(DelayEstimate{}); }
  [[nodiscard]] ErrorsDuring errors_now() const;
  [[nodiscard]] ErrorsDuring errors_during(const MotionEvidence& motion, const History& history) const;
  [[nodiscard]] ErrorsDuring believed_during(const MotionEvidence& motion, const History& history) const;
  void displace_rows(double sigma_px);

  StereoCamera camera_;
  double row_sigma_px_ = 1.0;  // prior standard deviation of a row coefficient
  PairGeometry::Coefficients coefficients_ = PairGeometry::Coefficients::Zero();
  LensResidual::Coefficients lens_ = LensResidual::Coefficients::Zero();
  RowInformation rows_{RectificationEstimate::Information::Identity(), RectificationEstimate::Basis::Zero()};
  std::optional<RowInformation> learned_rows_{};  // of after_drift()
  bool rows_contradict_learned_ = false;
  ExposureDelay delay_;
  CameraErrors disparity_{1.0, ErrorTerms::ByDisplacement::Zero()};
  std::size_t motions_ = 0;
  // Sums over the motions: length times d length / d coefficients, squared length.
  CameraErrors::Coefficients length_derivative_m2_ = CameraErrors::Coefficients::Zero();
  double squared_length_m2_ = 0.0;
};

}  // namespace stereo_slam
