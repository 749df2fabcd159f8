// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/relocalisation.hpp"

#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/loop_closing/loop_verification.hpp"

namespace stereo_slam {
namespace {

/// At least one in this many of the landmarks that should be in view has to agree with the pose.
constexpr std::size_t kMinFoundShare = 3;

/// The alignment finds few landmarks if the rough pose is off by more than its reach. These few correct the
/// pose, so that the next round finds more.
constexpr int kRounds = 3;

}  // namespace

std::optional<PoseGaussian> recognise_keyframe(const Keyframe& keyframe, const PatchSource& source,
                                               const StereoView& view, const StereoPoints& points,
                                               const Settings& settings) {
  const auto& rule = settings.loop_verification;
  Keyframe seen;
  seen.points = keyframe_points(points, {});
  const auto verified = verify_loop(keyframe, seen, view.camera, rule, settings.seed + view.frame.index);
  if (!verified) return std::nullopt;

  const MapView map{source.landmarks, view.camera};
  const PoseGaussian& rough = verified->T_old_new;
  const PoseGaussian prior{rough.pose, kRecognisedScale * rough.covariance};
  PoseGaussian expected = prior;
  for (int round = 0; round < kRounds; ++round) {
    Association association = expect_landmarks(map, expected, view.geometry.lens(), settings.map);
    align_landmarks(association, source, view, expected.pose, settings.refinement);
    if (association.matches.size() < static_cast<std::size_t>(rule.min_inliers)) return std::nullopt;
    const auto update = update_pose(prior, association.matches, map, settings.update);
    if (!update.converged) return std::nullopt;
    const std::size_t agreeing = update.used.size();
    if (agreeing >= static_cast<std::size_t>(rule.min_inliers) &&
        kMinFoundShare * agreeing >= association.predicted.size()) {
      return update.posterior;
    }
    expected.pose = update.posterior.pose;  // the covariance stays that of the prior, where updates start
  }
  return std::nullopt;
}

}  // namespace stereo_slam
