// SPDX-License-Identifier: MIT
#include "stereo_slam/report/truth_errors.hpp"

#include <stdexcept>

#include <Eigen/SVD>

#include "stereo_slam/evaluation/nees.hpp"
#include "stereo_slam/report/rounding.hpp"

namespace stereo_slam::report {
namespace {

constexpr std::int64_t kMaxDifference_ns = 10'000'000;
constexpr std::size_t kFewest = 3;       // poses that an alignment needs
constexpr std::size_t kNeesFrames = 10;  // over which the NEES is taken

/// Matched poses of the ground truth and of the run.
struct MatchedPoses {
  FramePairs pairs;
  std::vector<Eigen::Isometry3d> truth;
  std::vector<Eigen::Isometry3d> estimate;
};

[[nodiscard]] MatchedPoses match(const RunRecord& record, const Trajectory& truth) {
  std::vector<std::int64_t> stamps_ns;
  for (const auto& result : record.results) stamps_ns.push_back(result.stamp_ns);
  MatchedPoses matched;
  for (const auto& [i, k] : associate_by_stamp(truth.stamps_ns, stamps_ns, kMaxDifference_ns)) {
    if (!record.trajectory[k].pose.translation().allFinite()) continue;
    matched.pairs.emplace_back(i, k);
    matched.truth.push_back(truth.poses[i]);
    matched.estimate.push_back(record.trajectory[k].pose.isometry());
  }
  return matched;
}

/// The rotation R that minimises the sum of |R_estimate - R R_truth|^2.
[[nodiscard]] Matrix3<double> align_orientations(const MatchedPoses& matched) {
  Matrix3<double> sum = Matrix3<double>::Zero();
  for (std::size_t i = 0; i < matched.pairs.size(); ++i)
    sum += matched.estimate[i].linear() * matched.truth[i].linear().transpose();
  const Eigen::JacobiSVD<Matrix3<double>> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3<double> signs = Vector3<double>::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) signs[2] = -1.0;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

/// The NEES of the frames; NaN where it does not exist.
[[nodiscard]] std::vector<double> nees_of_frames(const RunRecord& record, const MatchedPoses& matched) {
  const std::size_t count = record.results.size();
  TrackedRun run{.rows = {}, .poses = {}, .true_poses = std::vector<std::optional<Pose>>(count)};
  for (std::size_t k = 0; k < count; ++k) {
    const FrameResult& result = record.results[k];
    run.rows.push_back(
        {result.keyframe, result.relative_covariance, result.nis, result.nis_dof, result.calibration});
    run.poses.push_back(record.trajectory[k].pose);
  }
  for (std::size_t i = 0; i < matched.pairs.size(); ++i)
    run.true_poses[matched.pairs[i].second] = Pose::from_isometry(matched.truth[i]);
  std::vector<double> values(count, kNaN);
  try {
    for (const auto& nees : relative_nees(run, kNeesFrames, {})) values[nees.to] = nees.value;
  } catch (const std::runtime_error&) {  // a singular covariance: the report goes without
    values.assign(count, kNaN);
  }
  return values;
}

}  // namespace

std::optional<TruthErrors> truth_errors(const RunRecord& record, const Trajectory& truth) {
  const MatchedPoses matched = match(record, truth);
  if (matched.pairs.size() < kFewest) return std::nullopt;
  const Eigen::Isometry3d T_truth_world = align(matched.truth, matched.estimate);
  const Eigen::Isometry3d T_world_truth = T_truth_world.inverse();
  const Matrix3<double> R_world_truth = align_orientations(matched);
  const std::size_t count = record.results.size();
  TruthErrors errors{.position_m = std::vector<Vector3<double>>(count, Vector3<double>::Constant(kNaN)),
                     .error_m = std::vector<double>(count, kNaN),
                     .error_rad = std::vector<double>(count, kNaN),
                     .nees = nees_of_frames(record, matched),
                     .ate_m = absolute_trajectory_error(matched.truth, matched.estimate, T_truth_world)};
  for (std::size_t i = 0; i < matched.pairs.size(); ++i) {
    const std::size_t k = matched.pairs[i].second;
    errors.position_m[k] = T_world_truth * matched.truth[i].translation();
    errors.error_m[k] = (errors.position_m[k] - matched.estimate[i].translation()).norm();
    const Matrix3<double> difference =
        matched.estimate[i].linear().transpose() * R_world_truth * matched.truth[i].linear();
    errors.error_rad[k] = Eigen::AngleAxisd(difference).angle();
  }
  return errors;
}

}  // namespace stereo_slam::report
