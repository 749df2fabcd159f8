// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/update.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>

#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "stereo_slam/local_map/landmark_projection.hpp"
#include "stereo_slam/tracking/pose_likelihood.hpp"

namespace stereo_slam {
namespace {

/// The matches in an order in which every consecutive subset is spread over the image: round-robin over the
/// matches sorted by column.
[[nodiscard]] std::vector<Match> interleaved(const std::vector<Match>& matches, int max_subset) {
  std::vector<std::size_t> by_column(matches.size());
  std::iota(by_column.begin(), by_column.end(), std::size_t{0});
  std::sort(by_column.begin(), by_column.end(),
            [&](std::size_t a, std::size_t b) { return matches[a].z.x() < matches[b].z.x(); });
  const std::size_t subsets =
      (matches.size() + static_cast<std::size_t>(max_subset) - 1) / static_cast<std::size_t>(max_subset);
  std::vector<Match> result;
  result.reserve(matches.size());
  for (std::size_t first = 0; first < subsets; ++first) {
    for (std::size_t i = first; i < by_column.size(); i += subsets) result.push_back(matches[by_column[i]]);
  }
  return result;
}

/// Whether the steps of an update settled. A posterior that is not Gaussian is accepted: the cap of the
/// likelihood can cause that, and update_pose() checks the matches themselves.
[[nodiscard]] bool is_settled(antipode::UpdateStatus status) {
  return status == antipode::UpdateStatus::kConverged || status == antipode::UpdateStatus::kNotGaussian;
}

/// Alg. 2 on subsets of the matches, with orientation and translation independent (sec. IV-D).
[[nodiscard]] PoseUpdate update_as_in_paper(const PoseDensity& prior, const std::vector<Match>& matches,
                                            const MapView& map, double cap, const UpdateSettings& settings) {
  const auto ordered = interleaved(matches, settings.max_correspondences);
  const auto likelihood_of = [&](int begin, int end) {
    const std::span<const Match> all(ordered);
    return PoseLikelihood(all.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)),
                          map, cap);
  };
  const auto result = antipode::progressive_update_subsets(
      prior, static_cast<int>(ordered.size()), likelihood_of, antipode::PaperPoseRule{},
      {.progressive = {.tau = settings.tau, .keep_coupling = false},
       .max_size = settings.max_correspondences,
       .min_translation_sigma_m = settings.regularizer_sigma_m,
       .forgetting = settings.regularizer_forgetting});
  return {.posterior = result.posterior, .converged = is_settled(result.status)};
}

/// Alg. 2 with degree-5 points and the coupling of orientation and translation.
[[nodiscard]] PoseUpdate update_progressively(const PoseDensity& prior, const PoseLikelihood& likelihood,
                                              const UpdateSettings& settings) {
  const auto result =
      antipode::progressive_update(prior, likelihood, antipode::RichPoseRule{}, {.tau = settings.tau});
  return {.posterior = result.posterior, .converged = is_settled(result.status)};
}

[[nodiscard]] PoseUpdate update_quadratically(const PoseDensity& prior, const PoseLikelihood& likelihood) {
  // With many landmarks the posterior has one mode; update_pose() removes the outliers among the matches.
  const auto result =
      antipode::quadratic_update(antipode::to_pose_gaussian(prior), likelihood, {.check_modes = false});
  return {.posterior = antipode::to_bingham_gaussian(result.posterior),
          .converged = is_settled(result.status)};
}

/// One update with the method of the settings. The squared Mahalanobis distance of each match is limited to
/// `cap`.
[[nodiscard]] PoseUpdate update_once(const PoseDensity& prior, const std::vector<Match>& matches,
                                     const MapView& map, double cap, const UpdateSettings& settings) {
  if (settings.method == PoseUpdateMethod::kPaper) {
    return update_as_in_paper(prior, matches, map, cap, settings);
  }
  const PoseLikelihood likelihood(matches, map, cap, antipode::to_pose_gaussian(prior));
  if (settings.method == PoseUpdateMethod::kProgressive) {
    return update_progressively(prior, likelihood, settings);
  }
  return update_quadratically(prior, likelihood);
}

/// Factor, at least 1, by which the prior's uncertainty increases the mean squared innovation over that of
/// the landmarks and pixels alone.
[[nodiscard]] double prior_spread(const std::vector<Match>& matches) {
  double sum = 0.0;
  for (const auto& match : matches) {
    const Matrix3<double> S = match.predicted.landmark_part + match.R;
    sum += S.llt().solve(match.predicted.pose_part).trace() / 3.0;
  }
  return 1.0 + sum / static_cast<double>(matches.size());
}

/// The matches with the landmarks' part of their covariance linearised at a pose, without those whose squared
/// Mahalanobis distance exceeds `cap` there.
[[nodiscard]] std::vector<Match> relinearised_inliers(const std::vector<Match>& matches, const MapView& map,
                                                      const Pose& T_keyframe_camera, double cap) {
  std::vector<Match> result;
  for (Match match : matches) {
    const Landmark& landmark = map.landmarks[match.landmark];
    const auto z = project(to_point(landmark, landmark.mean, map.camera), T_keyframe_camera, map.camera);
    if (!z) continue;
    const Matrix3<double> J = landmark_jacobian(landmark, T_keyframe_camera, map.camera);
    match.predicted.landmark_part = J * landmark.covariance * J.transpose();
    const Vector3<double> e = match.z - *z;
    if (e.dot((match.predicted.landmark_part + match.R).llt().solve(e)) <= cap) result.push_back(match);
  }
  return result;
}

/// Squared distance of the measurements from the posterior plus that of the posterior from the prior: for
/// linear models the normalised innovation squared.
[[nodiscard]] double normalised_innovation_squared(const PoseDensity& prior, const PoseDensity& posterior,
                                                   const PoseLikelihood& likelihood) {
  const Vector6<double> correction = posterior.pose().boxminus(prior.pose());
  return likelihood.squared_distance(posterior.pose()) +
         correction.dot(prior.covariance().ldlt().solve(correction));
}

/// Variance of the noise in u and v relative to that assumed: the mean squares of the residuals at the
/// posterior in units of their variances, corrected for the parameters that were fitted to the residuals:
/// six, less what the prior knew of them.
[[nodiscard]] Vector2<double> noise_variance_ratio(const std::vector<Match>& matches, const MapView& map,
                                                   const PoseDensity& prior, const PoseDensity& posterior) {
  Vector2<double> sum = Vector2<double>::Zero();
  int residuals = 0;
  for (const auto& match : matches) {
    const Landmark& landmark = map.landmarks[match.landmark];
    const auto z = project(to_point(landmark, landmark.mean, map.camera), posterior.pose(), map.camera);
    if (!z) continue;
    residuals += 3;
    const Matrix3<double> S = match.predicted.landmark_part + match.R;
    sum += (match.z - *z).cwiseAbs2().cwiseQuotient(S.diagonal()).head<2>();
  }
  const double known = prior.covariance().ldlt().solve(posterior.covariance()).trace();
  const double fitted = 6.0 - std::clamp(known, 0.0, 6.0);
  return sum * 3.0 / std::max(residuals - fitted, 1.0);
}

}  // namespace

PoseUpdate update_pose(const PoseDensity& prior, const std::vector<Match>& matches, const MapView& map,
                       const UpdateSettings& settings) {
  if (settings.method == PoseUpdateMethod::kNone) return {.posterior = prior};
  if (matches.size() < static_cast<std::size_t>(settings.min_matches)) return {.posterior = prior};

  // The innovations contain the prior's error: the wide cap allows for it. The second update starts from the
  // prior again, without the matches that contradict the first, and with covariances taken at its result.
  const double wide_cap = settings.robust_cap * prior_spread(matches);
  const auto first = update_once(prior, matches, map, wide_cap, settings);
  if (!first.converged) return {.posterior = prior};
  const auto kept = relinearised_inliers(matches, map, first.posterior.pose(), settings.robust_cap);
  if (kept.size() < static_cast<std::size_t>(settings.min_matches)) return {.posterior = prior};
  PoseUpdate update = update_once(prior, kept, map, wide_cap, settings);
  if (!update.converged) return {.posterior = prior};
  const PoseLikelihood likelihood(kept, map, wide_cap, antipode::to_pose_gaussian(prior));
  update.nis = normalised_innovation_squared(prior, update.posterior, likelihood);
  update.nis_dof = likelihood.dimension();
  update.variance_ratio = noise_variance_ratio(kept, map, prior, update.posterior);
  update.used = kept;
  return update;
}

}  // namespace stereo_slam
