// SPDX-License-Identifier: MIT
// The part of the SLAM that measures a frame. It changes no state, so that a frame can be measured twice.
#include <cmath>
#include <optional>
#include <utility>

#include "stereo_slam/core/robust_line.hpp"
#include "stereo_slam/core/symmetric_solve.hpp"
#include "stereo_slam/frontend/stereo_matching.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/odometry/displacement_search.hpp"
#include "stereo_slam/odometry/motion_in_left.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/tracking/associate.hpp"
#include "stereo_slam/tracking/landmark_search.hpp"
#include "stereo_slam/tracking/predict.hpp"
#include "stereo_slam/tracking/rig_constraints.hpp"

namespace stereo_slam {
namespace {

/// Whether the right image of a frame may be displaced that was measured as if it were not, with
/// `usual_matches` in the frame before.
[[nodiscard]] bool may_be_displaced(const FrameMeasurement& measured, std::size_t usual_matches) {
  if (!measured.right.monitor.fits() || !measured.odometry.valid || !measured.displacement_left) return true;
  return 2 * measured.matches.size() < usual_matches;
}

/// Whether a frame fits better if its right image is displaced: if that explains what the landmarks show, or
/// more of them are found.
[[nodiscard]] bool is_better(const FrameMeasurement& displaced, const FrameMeasurement& undisplaced,
                             bool explains) {
  constexpr double kMore = 1.2;  // by chance as many landmarks may be found, or a few more
  const auto fits = [](const FrameMeasurement& measured) {
    return measured.right.monitor.fits() && !measured.right.is_ignored();
  };
  const auto matches = [](const FrameMeasurement& measured) {
    return static_cast<double>(measured.matches.size());
  };
  if (!fits(displaced)) return false;
  return explains || !fits(undisplaced) || matches(displaced) > kMore * matches(undisplaced);
}

}  // namespace

/// Measures a frame, with the displacement of its right image if that is expected, or if a displacement
/// explains a frame in which too little is found otherwise.
FrameMeasurement Slam::measure(const FrameImages& images, AssociationTrace* trace, StageClock& clock) const {
  const RightImageState right = next_right_image(images);
  if (right_camera_.may_be_displaced())
    return measure(images, right, displacement_in(images, right), trace, clock);
  FrameMeasurement undisplaced = measure(images, right, {}, trace, clock);
  const auto& shown = undisplaced.displacement_left;
  const bool surprises = shown && right_camera_.is_surprised_by(*shown);
  if (!surprises && !may_be_displaced(undisplaced, previous_.matches)) return undisplaced;
  constexpr int kEnoughToBegin = 30;  // fewer may agree by chance
  const auto displacement = displacement_in(images, right);
  if (!displacement || displacement->agreeing < kEnoughToBegin) return undisplaced;
  FrameMeasurement measured = measure(images, right, displacement, trace, clock);
  const auto& left = measured.displacement_left;
  const bool explains = surprises && left && !right_camera_.is_surprised_by(*left);
  return is_better(measured, undisplaced, explains) ? measured : undisplaced;
}

/// The right image of a frame before it is measured. If it is late, the motion in the left images tells the
/// velocity, without the geometry that depends on it.
RightImageState Slam::next_right_image(const FrameImages& images) const {
  RightImageState right = right_camera_.next_image(images.frame.has_right());
  if (!right_camera_.is_late()) return right;
  const ConsecutivePyramids pyramids{previous_.pyramids, images.flow_pyramids};
  const Pose expected = motion_.expected_until(images.frame.stamp_ns).T_previous_current;
  const auto motion =
      motion_in_left(points_of_previous(), pyramids, right_camera_.view_of(images.frame, right), expected,
                     settings_.odometry);
  const auto velocity = motion ? motion_.velocity_by(*motion, images.frame.stamp_ns) : std::nullopt;
  if (velocity)
    right.late = right_camera_.motion_until_exposure(*velocity);
  else if (const auto shown = right_camera_.motion_by_rows(images.frame))
    right.late = shown;
  return right;
}

/// The points of the odometry in the previous frame. If they are few, as after a frame without a right image,
/// also the landmarks that were found there.
std::vector<StereoPlane> Slam::points_of_previous() const {
  constexpr std::size_t kFew = 60;
  std::vector<StereoPlane> points;
  for (const auto& point : tracks_.points()) points.push_back({point.z, point.disparity_slope});
  if (points.size() >= kFew || previous_.lost) return points;
  for (const auto& landmark : local_map_.landmarks()) {
    if (landmark.last_seen + 1 != path_.frames()) continue;
    const auto point = to_point(landmark, landmark.mean, right_camera_.camera());
    const auto z = project(point, posterior_.pose, right_camera_.camera());
    if (z && z->z() > 0.0) points.push_back({*z, landmark.disparity_slope});
  }
  return points;
}

/// The displacement of the right image, searched with the points of the previous frame.
std::optional<DisplacementEstimate> Slam::displacement_in(const FrameImages& images,
                                                          const RightImageState& right) const {
  if (!right_camera_.learns() || !images.frame.has_right()) return std::nullopt;
  const ConsecutivePyramids pyramids{previous_.pyramids, images.flow_pyramids};
  const StereoView view = right_camera_.view_of(images.frame, right);
  const Pose expected = motion_.expected_until(images.frame.stamp_ns).T_previous_current;
  return search_displacement(points_of_previous(), pyramids, view, expected,
                             right_camera_.searched_displacement(), settings_.odometry);
}

/// The measurement of a frame before anything is measured but the displacement of its right image, if one was
/// found.
FrameMeasurement Slam::begin_measurement(const RightImageState& right,
                                         const std::optional<DisplacementEstimate>& displacement) const {
  return {.right = displacement ? right_camera_.displaced(right, *displacement) : right, .tracks = tracks_};
}

/// System input, prediction, and data association with a right image, and its displacement if one was found.
FrameMeasurement Slam::measure(const FrameImages& images, const RightImageState& right,
                               const std::optional<DisplacementEstimate>& displacement,
                               AssociationTrace* trace, StageClock& clock) const {
  FrameMeasurement measured = begin_measurement(right, displacement);
  measure_motion(images, measured);  // u_k, eq. 11
  if (displacement && measured.odometry.valid)
    measured.odometry.T_previous_current.covariance +=
        displacement->pose_covariance(displacement->covariance);
  see_with_velocity(images, measured);
  clock.lap("odometry");
  predict(images.frame.stamp_ns, measured);  // eqs. 5-7
  clock.lap("predict");
  auto by_odometry = without_imu(measured);
  find_landmarks(images, measured, trace);  // Alg. 3
  if (by_odometry) {
    find_landmarks(images, *by_odometry, nullptr);
    if (by_odometry->matches.size() > measured.matches.size()) measured = *std::move(by_odometry);
  }
  measured.displacement_left = displacement_of(images, measured);
  clock.lap("associate");
  return measured;
}

void Slam::measure_motion(const FrameImages& images, FrameMeasurement& measured) const {
  const ConsecutivePyramids pyramids{previous_.pyramids, images.flow_pyramids};
  const ExpectedMotion expected = motion_.expected_until(images.frame.stamp_ns);
  const StereoView view = right_camera_.view_of(images.frame, measured.right);
  measured.odometry = odometry_from_tracks(measured.tracks, pyramids, view, expected, settings_);
  measured.right.monitor.add(measured.odometry.right_image);
  if (!measured.right.is_ignored()) return;
  measured.odometry = {};  // without disparities there is no length
  measured.odometry.T_previous_current.pose = expected.T_previous_current;
}

/// Sees a late right image with the velocity of the odometry, which is more exact than that of the left image
/// alone.
void Slam::see_with_velocity(const FrameImages& images, FrameMeasurement& measured) const {
  if (!right_camera_.is_late() || !measured.odometry.valid || !measured.right.late) return;
  const auto velocity = motion_.velocity_by(measured.odometry.T_previous_current.pose, images.frame.stamp_ns);
  if (!velocity) return;
  measured.tracks.remeasure(right_camera_.move_with(*velocity, measured.right));
}

/// The prior: by the odometry, and by an IMU if one is used. A motion that contradicts the IMU is not that of
/// the camera, but of a vehicle in view, say.
void Slam::predict(std::int64_t stamp_ns, FrameMeasurement& measured) const {
  OdometryResult& odometry = measured.odometry;
  std::optional<PoseGaussian> motion;
  if (odometry.valid) motion = odometry.T_previous_current;
  if (!motion_.inertial().predicted()) {
    measured.prior = predicted_pose(motion ? *motion : motion_.guessed_until(stamp_ns, settings_.motion));
    if (!motion || motion_.gap_until(stamp_ns) != Gap::kStart) return;
    // The first motion that was measured since the map began tells what it was before.
    const PoseGaussian before = motion_.motion_before_first(motion->pose, stamp_ns, settings_.motion);
    measured.prior = predict_pose(noise_.in_assumed_units(before), noise_.in_assumed_units(*motion));
    return;
  }
  measured.inertial = motion_.inertial().prior(motion);
  measured.prior = noise_.in_assumed_units(measured.inertial->T_keyframe_camera);
  odometry.valid = odometry.valid && !measured.inertial->contradicts;
}

/// The measurement with the prior by the odometry alone, if the odometry contradicts the IMU. One of both is
/// wrong: the landmarks tell which.
std::optional<FrameMeasurement> Slam::without_imu(const FrameMeasurement& measured) const {
  if (!measured.inertial || !measured.inertial->contradicts) return std::nullopt;
  FrameMeasurement result = measured;
  result.inertial.reset();
  result.refutes_imu = result.odometry.valid = true;
  result.prior = predicted_pose(result.odometry.T_previous_current);
  return result;
}

/// The prior by a motion since the last frame.
PoseGaussian Slam::predicted_pose(const PoseGaussian& T_previous_current) const {
  return predict_pose(posterior_, noise_.in_assumed_units(T_previous_current));
}

void Slam::find_landmarks(const FrameImages& images, FrameMeasurement& measured,
                          AssociationTrace* trace) const {
  const PoseGaussian& expected = measured.prior;
  const MapView map = local_map_.view();
  const ConsecutivePyramids pyramids{previous_.pyramids, images.flow_pyramids};
  const Pose T_keyframe_previous = posterior_.pose;
  const LandmarkSearch search{map,      reference_.left, pyramids, T_keyframe_previous, right_camera_.lens(),
                              settings_};
  ExpectedMotion motion;  // after a loss nothing is known
  if (!previous_.lost) motion = motion_.expected_until(images.frame.stamp_ns);
  const auto find = [&](bool in_right) {
    StereoView view = right_camera_.view_of(images.frame, measured.right);
    view.right_is_usable = in_right;
    const bool right_fits = measured.right.monitor.judgement() == RightImage::kFits;
    return search.align_patches(expected, view, right_fits, motion);
  };
  // Depths by motion have another scale than disparities: the pose must not be a compromise.
  const bool predicts = reference_.has_stereo_depths();
  const bool in_right = predicts && images.frame.has_right() && measured.right.monitor.fits();
  Association association = find(in_right);
  if (!predicts || (previous_.lost && measured.right.is_ignored())) {
    auto monitor = measured.right.monitor;
    monitor.add(searched_along_rows(images, measured.right, association.matches));
    if (!previous_.lost || monitor.fits()) measured.right.monitor = monitor;  // a loss raises no doubt
  } else if (!previous_.lost) {  // else the predicted pose may be wrong: missing landmarks tell nothing
    measured.right.monitor.add(association.right_image);
  }
  if (in_right && measured.right.is_ignored()) association = find(false);
  if (trace) {
    if (association.flow.empty()) search.observe(association);
    *trace = trace_association(association, positions(measured.odometry.inliers), settings_.association);
  }
  measured.matches = std::move(association.matches);
}

/// Whether a right image that is not used fits again: whether it shows the landmarks, each on its row, with
/// disparities in proportion to those that they have. Their depths may be of another scale, but an image that
/// is displaced along the rows does not fit. If few landmarks were found, any corners have to be on their
/// rows.
RightImageFit Slam::searched_along_rows(const FrameImages& images, const RightImageState& right,
                                        const std::vector<Match>& matches) const {
  constexpr std::size_t kFew = 30;           // as for the monitor
  constexpr double kScale_px = 1.0;          // of the errors of the disparities, at least
  constexpr double kLargestOffset_px = 1.0;  // between what is usual of rectifications and of displacements
  const StereoFrame& frame = images.frame;
  if (!frame.has_right()) return {};
  const bool few = matches.size() < kFew;
  const auto positions_px = few ? find_landmark_corners(frame.left, {}, settings_) : positions(matches);
  std::vector<PairSearch> searches;
  std::vector<Vector2<double>> disparities_px;  // that the landmark has, and that was found
  const auto found = match_stereo(right_camera_.view_of(frame, right), positions_px, settings_.stereo);
  for (std::size_t i = 0; i < found.size(); ++i) {
    searches.push_back({true, found[i] ? std::optional(found[i]->row_error_px) : std::nullopt});
    if (found[i] && !few) disparities_px.emplace_back(matches[i].predicted.z.z(), found[i]->z.z());
  }
  RightImageFit fit = fit_of(searches);
  if (std::abs(fit_line(disparities_px, {.slope = 1.0}, kScale_px).offset) > kLargestOffset_px)
    fit.in_right = 0;
  return fit;
}

/// What the landmarks show of the displacement of the right image besides that they were measured with. That
/// of a rig that does not vibrate is not known beforehand; it is only looked at.
std::optional<DisplacementEstimate> Slam::displacement_of(const FrameImages& images,
                                                          const FrameMeasurement& measured) const {
  constexpr std::size_t kFewestMatches = 30;
  constexpr std::size_t kEnoughToNotice = 40;  // they tell the displacement to .05 px
  constexpr double kUnknown_px = 10.0;
  const bool in_both = !measured.right.is_ignored() && reference_.has_stereo_depths();
  if (!right_camera_.learns() || !in_both || measured.matches.size() < kFewestMatches) return std::nullopt;
  const bool displaced = right_camera_.may_be_displaced();
  const PoseGaussian& prior = measured.prior;
  DisplacementPrior known{
      .mean = -measured.right.displacement,
      .information = ImageDisplacement::Covariance::Identity() / (kUnknown_px * kUnknown_px)};
  if (displaced) known = right_camera_.displacement_prior(measured.right);
  const bool all = displaced || right_camera_.measures_jump();
  known.pose_information = solve_symmetric(prior.covariance, Matrix6<double>::Identity());
  const StereoView view = right_camera_.view_of(images.frame, measured.right);
  return estimate_displacement(displacement_constraints(measured.matches, local_map_.view(), view, prior.pose,
                                                        all ? measured.matches.size() : kEnoughToNotice),
                               known);
}

}  // namespace stereo_slam
