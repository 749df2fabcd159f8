// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <antipode/distributions/bingham_gaussian.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Landmark that has left the active map, in its reference keyframe's camera coordinates.
struct ArchivedPoint {
  std::size_t keyframe = 0;
  std::uint32_t landmark = 0;
  Vector3<double> position;
  std::uint8_t intensity = 0;
};

/// Landmarks relative to one reference keyframe, and the archive of those before (sec. IV-E).
class Map {
 public:
  [[nodiscard]] const std::vector<Landmark>& landmarks() const noexcept { return landmarks_; }

  /// Landmarks that have left the map and were observed often enough to be kept, in the order in which they
  /// left.
  [[nodiscard]] const std::vector<ArchivedPoint>& archive() const noexcept { return archive_; }

  /// Landmarks of the map that have been observed as often.
  [[nodiscard]] std::vector<ArchivedPoint> established(const StereoCamera& camera) const;

  /// A number that no landmark has yet.
  [[nodiscard]] std::uint32_t new_id() noexcept { return next_id_++; }

  /// Adds a landmark for every measurement, with these numbers, made at `T_reference_camera` with pixel noise
  /// R. Its covariance includes that of the pose. Points nearer than `inverse_depth_beyond_baselines` are
  /// Euclidean, the others in inverse depth.
  void add(const std::vector<StereoPoint>& measurements, const std::vector<Descriptor>& descriptors,
           const std::vector<std::uint32_t>& ids, const PoseGaussian& T_reference_camera,
           const Matrix3<double>& R, const StereoFrame& frame, const StereoCamera& camera,
           const MapSettings& settings);

  /// Records that the matched landmarks were seen, and where.
  void mark_seen(const std::vector<Match>& matches, const std::vector<Feature>& left_features,
                 std::size_t frame);

  /// Moves every matched landmark by its measurement, given samples of the pose posterior (Alg. 4).
  void update(const std::vector<Match>& matches, const antipode::BinghamGaussian<double>& T_reference_camera,
              const StereoCamera& camera);

  /// Carries the correlation of the landmarks' errors with the pose's through a motion of the camera.
  void predict_correlation(const Pose& T_previous_current);

  /// Carries it through an update of the pose, in which the landmarks were known no better than before and
  /// their errors were taken into account (Schmidt's consider filter): prior of the pose, its posterior mean,
  /// and the matches that made the one into the other.
  void update_correlation(const PoseGaussian& prior, const Pose& posterior, const std::vector<Match>& matches,
                          const StereoCamera& camera);

  /// Removes landmarks unseen for more than `frames` frames.
  void cull(std::size_t frame, int frames, const StereoCamera& camera);

  /// Archives all landmarks and starts anew relative to another keyframe.
  void restart(std::size_t keyframe, const StereoCamera& camera);

 private:
  void append_if_established(const Landmark& landmark, const StereoCamera& camera,
                             std::vector<ArchivedPoint>& points) const;

  std::size_t keyframe_ = 0;
  std::uint32_t next_id_ = 1;
  std::vector<Landmark> landmarks_;
  std::vector<ArchivedPoint> archive_;
};

}  // namespace stereo_slam
