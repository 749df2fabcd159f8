// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/update.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include <Eigen/LU>

#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/robust_least_squares.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/core/median.hpp"
#include "stereo_slam/core/symmetric_solve.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/tracking/landmark_equations.hpp"
#include "stereo_slam/tracking/pose_likelihood.hpp"

namespace stereo_slam {
namespace {

constexpr int kMaxCorrespondences = 30;       // matches of a subset (sec. IV-D)
constexpr double kRegularizerSigma_m = 1e-3;  // of the translation noise between subsets; not in the paper
constexpr double kRegularizerForgetting =
    1e-3;  // relative increase of the orientation uncertainty between subsets; not in the paper

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
/// likelihood can cause that, and update_robustly() checks the matches themselves.
[[nodiscard]] bool is_settled(antipode::UpdateStatus status) {
  return status == antipode::UpdateStatus::kConverged || status == antipode::UpdateStatus::kNotGaussian;
}

/// One update by Alg. 2. The squared Mahalanobis distance of each match is limited to `cap`.
[[nodiscard]] PoseUpdateOf<PoseDensity> update_once(const PoseDensity& prior,
                                                    const std::vector<Match>& matches, const MapView& map,
                                                    double cap, const UpdateSettings& settings,
                                                    const Pose& /*start*/) {
  const auto ordered = interleaved(matches, kMaxCorrespondences);
  const auto likelihood_of = [&](int begin, int end) {
    const std::span<const Match> all(ordered);
    return PoseLikelihood(all.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)),
                          map, cap);
  };
  const auto result = antipode::progressive_update_subsets(
      prior, static_cast<int>(ordered.size()), likelihood_of, antipode::PaperPoseRule{},
      {.progressive = {.tau = settings.tau, .keep_coupling = false},
       .max_size = kMaxCorrespondences,
       .min_translation_sigma_m = kRegularizerSigma_m,
       .forgetting = kRegularizerForgetting});
  return {.posterior = result.posterior, .converged = is_settled(result.status)};
}

[[nodiscard]] PoseUpdate update_quadratically(const PoseGaussian& prior, const PoseLikelihood& likelihood) {
  // With many landmarks the posterior has one mode; update_robustly() removes the outliers among the matches.
  const auto result = antipode::quadratic_update(prior, likelihood, {.check_modes = false});
  return {.posterior = result.posterior, .converged = is_settled(result.status)};
}

/// Gauss-Newton steps from `start` on.
[[nodiscard]] PoseUpdate update_by_least_squares(const PoseGaussian& prior, const WhitenedMatches& matches,
                                                 double cap, const Pose& start) {
  using Chart = PoseGaussian::Chart;
  constexpr double kTolerance = 0.1;  // of the last step but one; Gauss-Newton squares what is left
  const auto information = inverse_of_definite(prior.covariance);
  if (!information) return {.posterior = prior};
  const antipode::LeastSquaresPrior<Chart> known{prior.pose, *information};
  const LandmarkEquations equations{matches, {cap}};
  const auto result = antipode::robust_least_squares<Chart>(
      start, equations, equations.noise,
      {.tolerance = kTolerance, .covariance = antipode::CovarianceFrom::kNoise, .check_modes = false},
      &known);
  return {.posterior = {result.state, result.covariance}, .converged = result.converged()};
}

/// One update with the method of the settings, whose result will be near `start`. The cap applies as above.
[[nodiscard]] PoseUpdate update_once(const PoseGaussian& prior, const std::vector<Match>& matches,
                                     const MapView& map, double cap, const UpdateSettings& settings,
                                     const Pose& start) {
  const WhitenedMatches whitened = whiten(matches, map, prior);
  return settings.method == PoseUpdateMethod::kQuadratic
             ? update_quadratically(prior, {whitened, cap})
             : update_by_least_squares(prior, whitened, cap, start);
}

/// Factor, at least 1, by which the prior's uncertainty increases the mean squared innovation over that of
/// the landmarks and pixels alone.
[[nodiscard]] double prior_spread(const std::vector<Match>& matches) {
  double sum = 0.0;
  for (const auto& match : matches) {
    const Matrix3<double> S = match.predicted.landmark_part + match.R;
    sum += S.inverse().cwiseProduct(match.predicted.pose_part).sum() / 3.0;  // trace of S^-1 pose_part
  }
  return 1.0 + sum / static_cast<double>(matches.size());
}

/// Measurement of the match minus that expected at a pose; nothing if the landmark is not in front of the
/// camera.
[[nodiscard]] std::optional<Vector3<double>> residual_of(const Match& match, const MapView& map,
                                                         const Pose& T_keyframe_camera) {
  const Landmark& landmark = map.landmarks[match.landmark];
  const auto z = project(to_point(landmark, landmark.mean, map.camera), T_keyframe_camera, map.camera);
  if (!z) return std::nullopt;
  return match.z - *z;
}

[[nodiscard]] double squared_distance(const Vector3<double>& residual, const Match& match) {
  const Matrix3<double> S = match.predicted.landmark_part + match.R;
  return residual.dot(S.inverse() * residual);
}

/// The matches with the landmarks' part of their covariance linearised at a pose, without those whose squared
/// Mahalanobis distance exceeds `cap` there.
[[nodiscard]] std::vector<Match> relinearised_inliers(const std::vector<Match>& matches, const MapView& map,
                                                      const Pose& T_keyframe_camera, double cap) {
  std::vector<Match> result;
  for (Match match : matches) {
    const auto e = residual_of(match, map, T_keyframe_camera);
    if (!e) continue;
    const Landmark& landmark = map.landmarks[match.landmark];
    const Matrix3<double> J = landmark_jacobian(landmark, T_keyframe_camera, map.camera);
    match.predicted.landmark_part = J * landmark.covariance * J.transpose();
    if (squared_distance(*e, match) <= cap) result.push_back(match);
  }
  return result;
}

/// Matches with weights 1 / (1 + steepness d^2), by which their covariances are divided.
struct WeightedMatches {
  std::vector<Match> matches;
  std::vector<double> weights;
  double steepness = 0.0;
};

/// The matches with the weights of a Student-t distribution of their errors (Lange, Little and Taylor,
/// Journal of the American Statistical Association 1989), relative to a match without residual: 1 / (1 + d^2
/// / (dof s)), with the squared Mahalanobis distance d^2 at a pose. With `inverse_dof` 0, the normal
/// distribution, all weights are 1. The variance s of the errors relative to that assumed follows from the
/// median of d^2, as that of normal errors would.
[[nodiscard]] WeightedMatches weighted_by_residuals(const std::vector<Match>& matches, const MapView& map,
                                                    const Pose& T_keyframe_camera, double inverse_dof) {
  constexpr double kLeastScale = 0.05;  // with less, matches without residuals would decide alone
  WeightedMatches result;
  std::vector<double> distances;
  for (const auto& match : matches) {
    const auto e = residual_of(match, map, T_keyframe_camera);
    if (!e) continue;
    result.matches.push_back(match);
    distances.push_back(squared_distance(*e, match));
  }
  result.steepness = inverse_dof / std::max(median(distances) / kChi2_3_50, kLeastScale);
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const double weight = 1.0 / (1.0 + result.steepness * distances[i]);
    result.weights.push_back(weight);
    result.matches[i].R /= weight;
    result.matches[i].predicted.landmark_part /= weight;
  }
  return result;
}

/// Squared distance of the measurements from the posterior plus that of the posterior from the prior: for
/// linear models the normalised innovation squared.
[[nodiscard]] double normalised_innovation_squared(const PoseGaussian& prior, const PoseGaussian& posterior,
                                                   const PoseLikelihood& likelihood) {
  const Vector6<double> correction = posterior.pose.boxminus(prior.pose);
  return likelihood.squared_distance(posterior.pose) + mahalanobis_squared(correction, prior.covariance);
}

/// Sums over residuals e with variances v and weights, for two components of the measurements.
struct InfluenceSums {
  Vector2<double> squares = Vector2<double>::Zero();  ///< (weight e)^2 / v
  Vector2<double> slopes = Vector2<double>::Zero();   ///< d (weight e) / d e
  double weights = 0.0;

  /// Variance of an M-estimator (Huber, Robust Statistics, 1981) of these residuals relative to 1 / weights,
  /// which follows from the weighted variances.
  [[nodiscard]] Vector2<double> variance_ratio() const {
    constexpr double kLeastSlope = 0.1;  // of the weights; less is chance
    return weights * squares.cwiseQuotient(slopes.cwiseMax(kLeastSlope * weights).cwiseAbs2());
  }
};

/// Variance of the posterior's components that depend on u, and of those that depend on v, relative to that
/// of the posterior, as the residuals show it. Without weights it is the mean square of the residuals in
/// units of their standard deviations. It is corrected for the parameters that were fitted to the residuals:
/// six, less what the prior knew of them. NaN without matches.
[[nodiscard]] Vector2<double> posterior_variance_ratio(const WeightedMatches& weighted, const MapView& map,
                                                       const PoseGaussian& prior,
                                                       const PoseGaussian& posterior) {
  InfluenceSums sums;
  int residuals = 0;
  for (std::size_t i = 0; i < weighted.matches.size(); ++i) {
    const Match& match = weighted.matches[i];
    const auto e = residual_of(match, map, posterior.pose);
    if (!e) continue;
    residuals += 3;
    const double weight = weighted.weights[i];
    const Matrix3<double> S = match.predicted.landmark_part + match.R;  // divided by the weight
    const Vector2<double> weighted_squares = e->cwiseAbs2().cwiseQuotient(S.diagonal()).head<2>();
    sums.squares += weight * weighted_squares;
    sums.slopes += Vector2<double>::Constant(weight) - 2.0 * weighted.steepness * weight * weighted_squares;
    sums.weights += weight;
  }
  const double known = solve_symmetric(prior.covariance, posterior.covariance).trace();
  const double fitted = 6.0 - std::clamp(known, 0.0, 6.0);
  return sums.variance_ratio() * (residuals / std::max(residuals - fitted, 1.0));
}

[[nodiscard]] const PoseGaussian& as_gaussian(const PoseGaussian& density) { return density; }
[[nodiscard]] PoseGaussian as_gaussian(const PoseDensity& density) { return to_pose_gaussian(density); }

/// The innovations contain the prior's error: the wide cap allows for it. The second update starts from the
/// prior again, without the matches that contradict the first, and with covariances taken at its result. If
/// the matches are weighted, it is repeated with the weights at its own result.
template <class Density>
[[nodiscard]] PoseUpdateOf<Density> update_robustly(const Density& prior, const std::vector<Match>& matches,
                                                    const MapView& map, const UpdateSettings& settings) {
  if (matches.size() < static_cast<std::size_t>(settings.min_matches)) return {.posterior = prior};
  const double wide_cap = settings.robust_cap * prior_spread(matches);
  const auto first = update_once(prior, matches, map, wide_cap, settings, as_gaussian(prior).pose);
  if (!first.converged) return {.posterior = prior};
  const Pose first_pose = as_gaussian(first.posterior).pose;
  const auto kept = relinearised_inliers(matches, map, first_pose, settings.robust_cap);
  if (kept.size() < static_cast<std::size_t>(settings.min_matches)) return {.posterior = prior};
  WeightedMatches weighted;
  PoseUpdateOf<Density> update{.posterior = first.posterior};
  const int passes = settings.student_t_inverse_dof > 0.0 ? 2 : 1;
  for (int pass = 0; pass < passes; ++pass) {
    const Pose pose = as_gaussian(update.posterior).pose;
    weighted = weighted_by_residuals(kept, map, pose, settings.student_t_inverse_dof);
    update = update_once(prior, weighted.matches, map, wide_cap, settings, pose);
    if (!update.converged) return {.posterior = prior};
  }
  const PoseGaussian &before = as_gaussian(prior), &after = as_gaussian(update.posterior);
  const PoseLikelihood likelihood(kept, map, wide_cap, before);
  update.nis = normalised_innovation_squared(before, after, likelihood);
  update.nis_dof = likelihood.dimension();
  update.variance_ratio = posterior_variance_ratio(weighted, map, before, after);
  update.used = std::move(weighted.matches);
  return update;
}

}  // namespace

double expected_variance_ratio(const UpdateSettings& settings) {
  // Means over normal residuals of three components. Their Mahalanobis distance r has a density proportional
  // to r^2 exp(-r^2 / 2).
  constexpr double kStep = 0.01;
  constexpr double kFarthest = 8.0;
  const double steepness = settings.student_t_inverse_dof;
  if (steepness == 0.0) return 1.0;
  InfluenceSums sums;
  for (double r = kStep; r < kFarthest; r += kStep) {
    const double share = r * r * std::exp(-0.5 * r * r);
    const double weight = 1.0 / (1.0 + steepness * r * r);
    const double square = r * r / 3.0;  // of one component
    sums.squares.array() += share * weight * weight * square;
    sums.slopes.array() += share * (weight - 2.0 * steepness * weight * weight * square);
    sums.weights += share * weight;
  }
  return sums.variance_ratio().x();
}

PoseUpdate update_pose(const PoseGaussian& prior, const std::vector<Match>& matches, const MapView& map,
                       const UpdateSettings& settings) {
  return update_robustly(prior, matches, map, settings);
}

PoseUpdateOf<PoseDensity> update_as_in_paper(const PoseDensity& prior, const std::vector<Match>& matches,
                                             const MapView& map, const UpdateSettings& settings) {
  return update_robustly(prior, matches, map, settings);
}

}  // namespace stereo_slam
