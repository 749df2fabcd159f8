// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/loop_verification.hpp"

#include <algorithm>
#include <random>

#include <antipode/distributions/pose_algebra.hpp>

#include "stereo_slam/core/descriptor.hpp"
#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/symmetric_solve.hpp"
#include "stereo_slam/loop_closing/perspective_pose.hpp"
#include "stereo_slam/odometry/motion_estimation.hpp"

namespace stereo_slam {
namespace {

constexpr int kMaxDescriptorDistance = 64;  // bits of 256, of a match
constexpr double kDescriptorRatio = 0.9;    // largest, of best to second-best distance
constexpr double kSearchRadius_px = 8.0;    // of guided matching, around a predicted point
constexpr double kDrift_m_per_m =
    0.003;  // allowed for calibration errors that the covariance does not contain
constexpr double kDrift_rad_per_m = 1e-5;  // likewise

/// Indices of the same point in the old and the new keyframe.
struct PointPair {
  std::size_t old_point = 0;
  std::size_t new_point = 0;
};

/// Pairs of points whose descriptors are each other's nearest and clearly nearer than the second nearest.
[[nodiscard]] std::vector<PointPair> match_descriptors(const Keyframe& old_keyframe,
                                                       const Keyframe& new_keyframe) {
  std::vector<NearestDescriptor> of_old(old_keyframe.points.size());
  std::vector<NearestDescriptor> of_new(new_keyframe.points.size());
  for (std::size_t i = 0; i < of_old.size(); ++i) {
    for (std::size_t j = 0; j < of_new.size(); ++j) {
      const int distance =
          hamming_distance(old_keyframe.points[i].descriptor, new_keyframe.points[j].descriptor);
      of_old[i].offer(j, distance);
      of_new[j].offer(i, distance);
    }
  }
  std::vector<PointPair> pairs;
  for (std::size_t i = 0; i < of_old.size(); ++i) {
    const auto& nearest = of_old[i];
    if (nearest.distance <= kMaxDescriptorDistance && of_new[nearest.index].index == i &&
        nearest.distance <= kDescriptorRatio * nearest.second) {
      pairs.push_back({i, nearest.index});
    }
  }
  return pairs;
}

/// Pairs of points found where the pose predicts the old points: near in the image, in disparity and in
/// descriptor. A new point goes to one old point, the first of those with the nearest descriptor.
[[nodiscard]] std::vector<PointPair> match_guided(const Keyframe& old_keyframe, const Keyframe& new_keyframe,
                                                  const Pose& T_old_new, const StereoCamera& camera) {
  const Pose T_new_old = T_old_new.inverse();
  std::vector<NearestDescriptor> of_new(new_keyframe.points.size());
  std::vector<NearestDescriptor> of_old(old_keyframe.points.size());
  for (std::size_t i = 0; i < old_keyframe.points.size(); ++i) {
    const auto z = camera.project(T_new_old * camera.back_project(measurement(old_keyframe.points[i])));
    if (!z) continue;
    for (std::size_t j = 0; j < new_keyframe.points.size(); ++j) {
      const Vector3<double> e = measurement(new_keyframe.points[j]) - *z;
      if (e.cwiseAbs().maxCoeff() > kSearchRadius_px) continue;
      const int distance =
          hamming_distance(old_keyframe.points[i].descriptor, new_keyframe.points[j].descriptor);
      if (distance > kMaxDescriptorDistance) continue;
      of_old[i].offer(j, distance);
      of_new[j].offer(i, distance);
    }
  }
  std::vector<PointPair> pairs;
  for (std::size_t i = 0; i < of_old.size(); ++i) {
    const bool found = of_old[i].distance <= kMaxDescriptorDistance;
    if (found && of_new[of_old[i].index].index == i) pairs.push_back({i, of_old[i].index});
  }
  return pairs;
}

[[nodiscard]] std::vector<StereoCorrespondence> correspondences(const Keyframe& old_keyframe,
                                                                const Keyframe& new_keyframe,
                                                                const std::vector<PointPair>& pairs) {
  std::vector<StereoCorrespondence> result;
  result.reserve(pairs.size());
  for (const auto& pair : pairs) {
    result.push_back(
        {measurement(old_keyframe.points[pair.old_point]), measurement(new_keyframe.points[pair.new_point])});
  }
  return result;
}

}  // namespace

std::optional<LoopMeasurement> verify_loop(const Keyframe& old_keyframe, const Keyframe& new_keyframe,
                                           const StereoCamera& camera,
                                           const LoopVerificationSettings& settings, std::uint64_t seed) {
  const auto pairs = match_descriptors(old_keyframe, new_keyframe);
  // Guided matching finds more pairs than the descriptors alone, but needs a pose to start from. For that
  // half of settings.min_inliers pairs are enough.
  const int fewest_matches = (settings.min_inliers + 1) / 2;
  if (static_cast<int>(pairs.size()) < fewest_matches) return std::nullopt;

  std::mt19937_64 random(seed);
  const auto rough = perspective_pose(correspondences(old_keyframe, new_keyframe, pairs), fewest_matches,
                                      camera, settings, random);
  if (!rough) return std::nullopt;
  const auto guided = match_guided(old_keyframe, new_keyframe, *rough, camera);

  constexpr int kRefinementDraws = 30;  // few: the rough pose competes as the initial one
  OdometrySettings adjustment;
  adjustment.ransac_iterations = kRefinementDraws;
  adjustment.min_inliers = settings.min_inliers;
  adjustment.pixel_sigma_px = settings.pixel_sigma_px;
  const auto motion = estimate_motion(correspondences(old_keyframe, new_keyframe, guided), camera, {*rough},
                                      adjustment, random);
  if (!motion.valid || motion.inlier_count < settings.min_inliers) return std::nullopt;
  LoopMeasurement loop{old_keyframe.id, new_keyframe.id, motion.T_previous_current, motion.inlier_count};
  for (std::size_t i = 0; i < guided.size(); ++i) {
    const auto old_landmark = old_keyframe.points[guided[i].old_point].landmark;
    const auto new_landmark = new_keyframe.points[guided[i].new_point].landmark;
    if (motion.is_inlier[i] && old_landmark > 0 && new_landmark > 0) {
      loop.same_landmarks.emplace_back(old_landmark, new_landmark);
    }
  }
  return loop;
}

Matrix6<double> gate_allowance(double length_m) {
  const double rotation_rad = kDrift_rad_per_m * length_m;
  // A path that returns to its start was nowhere farther from it than half its length.
  const double swing_m = rotation_rad * 0.5 * length_m;
  const double stretch_m = kDrift_m_per_m * length_m;
  Vector6<double> variance;
  variance << Vector3<double>::Constant(rotation_rad * rotation_rad),
      Vector3<double>::Constant(stretch_m * stretch_m + swing_m * swing_m);
  return variance.asDiagonal();
}

std::vector<LoopMeasurement> LoopConsistency::add(const std::optional<LoopMeasurement>& loop,
                                                  const std::vector<Keyframe>& keyframes) {
  if (!loop) {
    agreeing_.clear();
    return {};
  }
  const auto segment = [&](std::size_t id) { return keyframes[id].segment; };
  if (!agreeing_.empty() && (segment(agreeing_.back().new_keyframe) != segment(loop->new_keyframe) ||
                             segment(agreeing_.back().old_keyframe) != segment(loop->old_keyframe))) {
    agreeing_.clear();
  }
  if (!agreeing_.empty()) {
    // Predict this loop from the last one, over the keyframes between their ends.
    const LoopMeasurement& last = agreeing_.back();
    const auto relative = [&](std::size_t from, std::size_t to) {
      PoseGaussian T_from_to;
      for (std::size_t id = std::min(from, to) + 1; id <= std::max(from, to); ++id) {
        T_from_to = compose_first_order(T_from_to, keyframes[id].T_previous_keyframe);
      }
      return from <= to ? T_from_to : antipode::inverse(T_from_to);
    };
    const PoseGaussian expected = compose_first_order(
        compose_first_order(relative(loop->old_keyframe, last.old_keyframe), last.T_old_new),
        relative(last.new_keyframe, loop->new_keyframe));
    const double tolerated = settings_.gate_scale * settings_.max_chi2;
    const double distance2 = mahalanobis_squared(expected.pose.boxminus(loop->T_old_new.pose),
                                                 expected.covariance + loop->T_old_new.covariance);
    if (distance2 > tolerated) agreeing_.clear();
  }
  agreeing_.push_back(*loop);
  const auto needed = static_cast<std::size_t>(kConsecutiveLoops);
  if (agreeing_.size() < needed) return {};
  if (agreeing_.size() == needed) return agreeing_;
  return {*loop};
}

}  // namespace stereo_slam
