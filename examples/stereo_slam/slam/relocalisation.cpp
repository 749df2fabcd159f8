// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/relocalisation.hpp"

#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/local_map/landmark_projection.hpp"
#include "stereo_slam/loop_closing/loop_verification.hpp"
#include "stereo_slam/tracking/match_refinement.hpp"

namespace stereo_slam {
namespace {

/// Landmarks that look as they should, of those that should be in view: one in so many is enough.
constexpr std::size_t kBelieved = 3;

}  // namespace

std::optional<PoseDensity> recognise_keyframe(const RecognisableKeyframe& reference, const StereoFrame& frame,
                                              const StereoFeatures& features, const StereoCamera& camera,
                                              const RectificationResidual& rectification,
                                              const Settings& settings) {
  const auto& rule = settings.loop_verification;
  Keyframe seen;
  seen.points = keyframe_points(measure_stereo_points(frame, features.left, {}, rectification, settings), {});
  const auto verified = verify_loop(reference.keyframe, seen, camera, rule, settings.seed + frame.index);
  if (verified.check != LoopCheck::kVerified) return std::nullopt;

  const PoseGaussian& rough = verified.loop.T_old_new;
  const auto prior = PoseDensity::from_pose_covariance(rough.pose, rule.gate_scale * rough.covariance);
  const auto predicted = project_landmarks(reference.landmarks, antipode::to_pose_gaussian(prior), camera,
                                           settings.map.max_baselines);
  std::vector<std::optional<Vector2<double>>> expected_px;
  for (const auto& landmark : predicted) expected_px.emplace_back(landmark.z.head<2>());
  const auto matches = refine_matches({}, predicted, expected_px, reference.landmarks, reference.left, frame,
                                      rough.pose, camera, rectification, settings.refinement);
  if (matches.size() < static_cast<std::size_t>(rule.min_inliers) ||
      kBelieved * matches.size() < predicted.size()) {
    return std::nullopt;
  }
  const auto update = update_pose(prior, matches, reference.landmarks, camera, settings.update);
  return update.converged ? std::optional(update.posterior) : std::nullopt;
}

}  // namespace stereo_slam
