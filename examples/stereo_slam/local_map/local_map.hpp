// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/rig/pair_geometry.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Landmark that has left the local map, in the camera coordinates of its reference keyframe.
struct ArchivedPoint {
  std::size_t keyframe = 0;    ///< id of the reference keyframe
  std::uint32_t landmark = 0;  ///< id of the landmark
  Vector3<double> position;    ///< m
  std::uint8_t intensity = 0;  ///< grey value
};

/// Landmarks relative to the reference keyframe, and an archive of landmarks that left the map (sec. IV-E).
class LocalMap {
 public:
  LocalMap(const StereoCamera& camera, const MapSettings& settings) : camera_(camera), settings_(settings) {}

  [[nodiscard]] const std::vector<Landmark>& landmarks() const noexcept { return landmarks_; }

  /// Refers to this map; valid until the map changes.
  [[nodiscard]] MapView view() const noexcept { return {landmarks_, camera_}; }

  /// Established landmarks that have left the map, in the order in which they left. A landmark is established
  /// if it was observed in at least three frames and is not at infinity.
  [[nodiscard]] const std::vector<ArchivedPoint>& archive() const noexcept { return archive_; }

  /// Established landmarks that are in the map now.
  [[nodiscard]] std::vector<ArchivedPoint> established() const;

  /// An id that no landmark has yet.
  [[nodiscard]] std::uint32_t new_id() noexcept { return next_id_++; }

  /// Adds a landmark for every point of `frame`; `ids` has one id per point. The camera was at
  /// `T_keyframe_camera`, whose covariance becomes part of the landmarks'.
  /// Points beyond settings.max_baselines times the baseline are left out, and so are those whose patches
  /// probably contain more than one surface, a reflection, or something that moves, unless fewer than half of
  /// settings.max_new_landmarks are clearer: the patches correlate by less than settings.clear_correlation,
  /// or the point is near and the slope of its disparity is not that of a road, a wall, or a surface that
  /// faces the camera.
  void add(const StereoPoints& points, const std::vector<std::uint32_t>& ids,
           const PoseGaussian& T_keyframe_camera, const StereoFrame& frame);

  /// Converts the landmarks, all measured in the reference keyframe, and drops those whose disparity is then
  /// not positive.
  void remeasure(const Remeasurement& change);

  /// Positions in the left image of the landmarks that were observed in this frame, px.
  [[nodiscard]] std::vector<Vector2<double>> observed_in(std::size_t frame) const;

  /// Records when and where the matched landmarks were observed.
  void record_observations(const std::vector<Match>& matches, const std::vector<Feature>& left_features,
                           std::size_t frame);

  /// Updates every matched landmark with its measurement, given the posterior of the pose (Alg. 4).
  void update(const std::vector<Match>& matches, const PoseDensity& T_keyframe_camera);

  /// Propagates the cross-covariances of pose and landmarks through a motion of the camera: its error is that
  /// of the pose before times this matrix, and what has nothing to do with the landmarks.
  void predict_correlation(const Matrix6<double>& pose_regression);

  /// Updates the cross-covariances of pose and landmarks after an update of the pose that took the landmarks'
  /// errors into account but did not reduce them (Schmidt's consider filter). `prior` is the pose before the
  /// update, `posterior` its mean after the update, and `matches` are those that the update used.
  void update_correlation(const PoseGaussian& prior, const Pose& posterior,
                          const std::vector<Match>& matches);

  /// Removes landmarks unobserved for more than settings.cull_after_frames frames.
  void cull(std::size_t frame);

  /// Archives all landmarks and starts anew relative to another keyframe.
  void restart(std::size_t keyframe);

 private:
  /// The landmark as it is archived; nothing if it is not established.
  [[nodiscard]] std::optional<ArchivedPoint> archived(const Landmark& landmark) const;
  void move_to_archive(const Landmark& landmark);

  StereoCamera camera_;
  MapSettings settings_;
  std::size_t keyframe_ = 0;
  std::uint32_t next_id_ = 1;
  std::vector<Landmark> landmarks_;
  std::vector<ArchivedPoint> archive_;
};

}  // namespace stereo_slam
