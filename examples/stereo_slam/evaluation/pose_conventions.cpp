// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/pose_conventions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <fmt/format.h>

namespace stereo_slam {
namespace {

/// A motion between two poses of a file: inverse(from) * to, and the rotation of `from`.
struct Motion {
  Eigen::Matrix3d R;
  Eigen::Vector3d turn_rad;  ///< rotation vector of R
  Eigen::Vector3d t_m;
  Eigen::Matrix3d R_world_from;
};

/// Pairs of motions of both files.
struct Motions {
  std::vector<Motion> truth;
  std::vector<Motion> estimate;
};

[[nodiscard]] Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(R).normalized());
  return turn.angle() * turn.axis();
}

[[nodiscard]] Eigen::Isometry3d changed(const Eigen::Isometry3d& pose, PoseChange change) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(pose.linear()).normalized();
  const Eigen::Translation3d t(pose.translation());
  switch (change) {
    case PoseChange::kScalarLast:
      return t * Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
    case PoseChange::kScalarFirst:
      return t * Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());
    case PoseChange::kInverse:
      return (t * q).inverse();
    case PoseChange::kInverseRotation:
      return t * q.conjugate();
    case PoseChange::kMirror:
      return Eigen::Translation3d(t.x(), t.y(), -t.z()) * Eigen::Quaterniond(q.w(), -q.x(), -q.y(), q.z());
    case PoseChange::kNone:
      break;
  }
  return t * q;
}

/// Motions over a fiftieth of the path, up to a hundred poses; at most about a thousand of them.
[[nodiscard]] std::vector<Motion> motions_of(PoseSpan poses, PoseChange change) {
  constexpr std::size_t kMostMotions = 1000;
  const std::size_t span = std::clamp<std::size_t>(poses.size() / 50, 1, 100);
  const std::size_t stride = 1 + poses.size() / kMostMotions;
  std::vector<Motion> motions;
  for (std::size_t i = 0; i + span < poses.size(); i += stride) {
    const Eigen::Isometry3d from = changed(poses[i], change);
    const Eigen::Isometry3d motion = from.inverse() * changed(poses[i + span], change);
    motions.push_back(
        {motion.linear(), rotation_vector(motion.linear()), motion.translation(), from.linear()});
  }
  return motions;
}

/// The motions after a change of the poses of one file.
[[nodiscard]] Motions motions_of(const PosePairs& poses, PoseChange change, bool of_truth) {
  return {motions_of(poses.truth, of_truth ? change : PoseChange::kNone),
          motions_of(poses.estimate, of_truth ? PoseChange::kNone : change)};
}

/// The orthogonal matrix Q that minimises the sum of |b - Q a|^2, from the sum of b a'.
[[nodiscard]] Eigen::Matrix3d nearest_orthogonal(const Eigen::Matrix3d& sum, bool rotation) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if (rotation && svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) signs[2] = -1.0;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

template <class Norm>
[[nodiscard]] double root_mean_square(const std::vector<Motion>& motions, const Norm& squared) {
  double sum = 0.0;
  for (const auto& motion : motions) sum += squared(motion);
  return std::sqrt(sum / static_cast<double>(motions.size()));
}

/// Size of the motions, never zero.
struct MotionSize {
  double turn_rad = 0.0;
  double t_m = 0.0;
};

[[nodiscard]] MotionSize size_of(const std::vector<Motion>& motions) {
  constexpr double kLeast = 1e-12;
  return {
      std::max(kLeast, root_mean_square(motions, [](const Motion& m) { return m.turn_rad.squaredNorm(); })),
      std::max(kLeast, root_mean_square(motions, [](const Motion& m) { return m.t_m.squaredNorm(); }))};
}

/// Root mean square without the largest tenth, which a few wrong poses may have caused.
[[nodiscard]] double trimmed(std::vector<double> squares) {
  std::ranges::sort(squares);
  squares.resize(squares.size() - squares.size() / 10);
  double sum = 0.0;
  for (const double square : squares) sum += square;
  return std::sqrt(sum / static_cast<double>(squares.size()));
}

/// Translation of the estimate's body for a motion of the ground truth: scale * (t + (R - I) lever), in the
/// axes of the ground truth's body. Fits scale and scaled lever arm by least squares. A lever arm of a metre
/// that the rotations do not show costs as much as an error of a per cent.
[[nodiscard]] Eigen::Vector4d fit_lever(const Motions& motions, const Eigen::Matrix3d& R_truth_estimate,
                                        bool lever) {
  const double noise_m = 0.01 * size_of(motions.truth).t_m;
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < motions.truth.size(); ++i) {
    Eigen::Matrix<double, 3, 4> J;
    J << motions.truth[i].t_m, motions.truth[i].R - Eigen::Matrix3d::Identity();
    if (!lever) J.rightCols<3>().setZero();
    information += J.transpose() * J;
    sum += J.transpose() * (R_truth_estimate * motions.estimate[i].t_m);
  }
  const double weight = static_cast<double>(motions.truth.size()) * noise_m * noise_m;
  information.diagonal().tail<3>().array() += weight;
  return information.ldlt().solve(sum);
}

[[nodiscard]] Eigen::Vector3d moved_by_lever(const Motion& truth, const Eigen::Vector4d& scale_lever) {
  return scale_lever[0] * truth.t_m + (truth.R - Eigen::Matrix3d::Identity()) * scale_lever.tail<3>();
}

/// The rotation between the axes of both bodies, from rotations and translations, weighted by their sizes.
[[nodiscard]] Eigen::Matrix3d fit_axes(const Motions& motions, const Eigen::Vector4d& scale_lever) {
  const MotionSize truth = size_of(motions.truth);
  const MotionSize estimate = size_of(motions.estimate);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < motions.truth.size(); ++i) {
    const Motion& a = motions.truth[i];
    const Motion& b = motions.estimate[i];
    sum += a.turn_rad * b.turn_rad.transpose() / (truth.turn_rad * estimate.turn_rad);
    sum += moved_by_lever(a, scale_lever) * b.t_m.transpose() / (truth.t_m * estimate.t_m);
  }
  return nearest_orthogonal(sum, /*rotation=*/true);
}

/// The axes of the estimate's positions in those of its rotations; a reflection if that fits better.
[[nodiscard]] Eigen::Matrix3d fit_position_axes(const Motions& motions) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < motions.truth.size(); ++i) {
    const Motion& b = motions.estimate[i];
    sum += b.R_world_from * (b.t_m * motions.truth[i].t_m.transpose()) * b.R_world_from.transpose();
  }
  return nearest_orthogonal(sum, /*rotation=*/false);
}

/// Fits the constant offset, and computes the errors that remain.
[[nodiscard]] ConventionFit fit(const Motions& motions, FrameOffset offset) {
  ConventionFit result;
  result.offset = offset;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  const bool lever = offset == FrameOffset::kOrigin || offset == FrameOffset::kBody;
  Eigen::Vector4d scale_lever(size_of(motions.estimate).t_m / size_of(motions.truth).t_m, 0.0, 0.0, 0.0);
  if (offset == FrameOffset::kPositions) result.axes = fit_position_axes(motions);
  constexpr int kIterations = 10;
  constexpr double kLeastScale = 1e-12;
  for (int i = 0; i < (offset == FrameOffset::kBody ? kIterations : 0); ++i) {
    R = fit_axes(motions, scale_lever);
    scale_lever = fit_lever(motions, R, lever);
  }
  Motions turned = motions;
  for (auto& b : turned.estimate)
    b.t_m = R * (b.R_world_from.transpose() * (result.axes.transpose() * (b.R_world_from * b.t_m)));
  scale_lever = fit_lever(turned, Eigen::Matrix3d::Identity(), lever);
  if (!(scale_lever[0] > kLeastScale)) scale_lever = {kLeastScale, 0.0, 0.0, 0.0};
  std::vector<double> turns;
  std::vector<double> translations;
  for (std::size_t i = 0; i < motions.truth.size(); ++i) {
    const Eigen::Matrix3d rotated = R * motions.estimate[i].R * R.transpose();
    turns.push_back(rotation_vector(rotated.transpose() * motions.truth[i].R).squaredNorm());
    translations.push_back(
        (turned.estimate[i].t_m - moved_by_lever(motions.truth[i], scale_lever)).squaredNorm());
  }
  result.T_truth_estimate =
      Eigen::Translation3d(scale_lever.tail<3>() / scale_lever[0]) * Eigen::Quaterniond(R);
  const MotionSize truth_size = size_of(motions.truth);
  const MotionSize estimate_size = size_of(motions.estimate);
  result.rotation_error = trimmed(std::move(turns)) / std::max(truth_size.turn_rad, estimate_size.turn_rad);
  result.translation_error = trimmed(std::move(translations)) / estimate_size.t_m;
  return result;
}

/// Order in which hypotheses that fit about as well are preferred.
[[nodiscard]] int complexity(const ConventionFit& fit) {
  const int change = fit.change == PoseChange::kNone ? 0 : 2;
  switch (fit.offset) {
    case FrameOffset::kNone:
      return change;
    case FrameOffset::kOrigin:
      return change + 2;
    case FrameOffset::kBody:
      return change + 3;
    case FrameOffset::kPositions:
      break;
  }
  return change + 4;
}

/// Product of the errors; the smallest ones count as a thousandth.
[[nodiscard]] double badness(const ConventionFit& fit) {
  return std::max(1e-3, fit.rotation_error) * std::max(1e-3, fit.translation_error);
}

[[nodiscard]] bool clearly_better(const ConventionFit& fit, const ConventionFit& as_given) {
  constexpr double kClear = 3.0;
  constexpr double kLeastError = 0.02;
  constexpr double kNoWorse = 1.1;
  const auto better = [&](double now, double before) {
    return before > kLeastError && kClear * now < before;
  };
  const auto no_worse = [&](double now, double before) { return now <= std::max(1e-3, kNoWorse * before); };
  return (better(fit.rotation_error, as_given.rotation_error) ||
          better(fit.translation_error, as_given.translation_error)) &&
         no_worse(fit.rotation_error, as_given.rotation_error) &&
         no_worse(fit.translation_error, as_given.translation_error);
}

/// All hypotheses that fit clearly better than the conventions as they are.
[[nodiscard]] std::vector<ConventionFit> better_fits(const PosePairs& poses, const ConventionFit& as_given) {
  struct Change {
    PoseChange change;
    bool of_truth;
  };
  using enum PoseChange;
  std::vector<ConventionFit> fits;
  for (const auto& [change, of_truth] :
       {Change{kNone, false}, Change{kScalarLast, false}, Change{kScalarFirst, false},
        Change{kInverse, false}, Change{kInverseRotation, false}, Change{kMirror, false},
        Change{kScalarLast, true}, Change{kScalarFirst, true}, Change{kInverse, true},
        Change{kInverseRotation, true}}) {
    const Motions motions = motions_of(poses, change, of_truth);
    for (const auto offset :
         {FrameOffset::kNone, FrameOffset::kOrigin, FrameOffset::kBody, FrameOffset::kPositions}) {
      ConventionFit tried = fit(motions, offset);
      tried.change = change;
      tried.of_truth = of_truth;
      if (clearly_better(tried, as_given)) fits.push_back(tried);
    }
  }
  return fits;
}

/// The simplest of the fits that are about as good as the best one; of those, one that changes the estimate.
[[nodiscard]] ConventionFit simplest(const std::vector<ConventionFit>& fits) {
  constexpr double kAsGood = 5.0;
  const auto best =
      std::ranges::min_element(fits, [](const auto& a, const auto& b) { return badness(a) < badness(b); });
  const double limit = kAsGood * badness(*best);
  std::optional<ConventionFit> chosen;
  for (const auto& tried : fits) {
    if (badness(tried) <= limit && (!chosen || complexity(tried) < complexity(*chosen))) chosen = tried;
  }
  return *chosen;
}

[[nodiscard]] double aligned_error_m(const PosePairs& poses) {
  return absolute_trajectory_error(poses.truth, poses.estimate, align(poses.truth, poses.estimate)).rmse;
}

}  // namespace

PosePairs corrected(PosePairs poses, const ConventionFit& fit) {
  for (auto& pose : fit.of_truth ? poses.truth : poses.estimate) pose = changed(pose, fit.change);
  for (auto& pose : poses.truth) pose = pose * fit.T_truth_estimate;
  for (auto& pose : poses.estimate) pose.translation() = fit.axes.transpose() * pose.translation();
  return poses;
}

std::optional<ConventionFinding> find_conventions(const PosePairs& poses) {
  constexpr std::size_t kFewestMotions = 10;
  const Motions motions = motions_of(poses, PoseChange::kNone, false);
  if (motions.truth.size() < kFewestMotions) return std::nullopt;
  ConventionFinding finding;
  finding.as_given = fit(motions, FrameOffset::kNone);
  const auto fits = better_fits(poses, finding.as_given);
  if (fits.empty()) return std::nullopt;
  finding.better = simplest(fits);
  finding.ate_as_given_m = aligned_error_m(poses);
  finding.ate_better_m = aligned_error_m(corrected(poses, finding.better));
  return finding;
}

namespace {

constexpr double kDegreesPerRad = 180.0 / std::numbers::pi;

/// "if ...": what is to be assumed of a file.
[[nodiscard]] std::string change_text(PoseChange change, std::string_view file) {
  switch (change) {
    case PoseChange::kScalarLast:
      return fmt::format("the quaternions of the {} are taken with qw last instead of first", file);
    case PoseChange::kScalarFirst:
      return fmt::format("the quaternions of the {} are taken with qw first instead of last", file);
    case PoseChange::kInverse:
      return fmt::format("the poses of the {} are inverted (T_camera_world in place of T_world_camera)",
                         file);
    case PoseChange::kInverseRotation:
      return fmt::format("the rotations of the {} are inverted (R_camera_world in place of R_world_camera)",
                         file);
    case PoseChange::kMirror:
      return fmt::format("the {} is mirrored (left-handed axes in place of right-handed ones)", file);
    case PoseChange::kNone:
      break;
  }
  return "";
}

[[nodiscard]] std::string offset_text(const ConventionFit& fit) {
  const double lever_m = fit.T_truth_estimate.translation().norm();
  switch (fit.offset) {
    case FrameOffset::kBody:
      return fmt::format(
          "the estimate is of a body or camera that is turned by {:.1f} degrees and moved by {:.2g} m",
          kDegreesPerRad * rotation_vector(fit.T_truth_estimate.linear()).norm(), lever_m);
    case FrameOffset::kOrigin:
      return fmt::format("the estimate is of a point of the body that is {:.2g} m away", lever_m);
    case FrameOffset::kPositions:
      if (fit.axes.determinant() < 0.0)
        return "the positions of the estimate are mirrored against its rotations";
      return fmt::format("the positions of the estimate are turned by {:.1f} degrees against its rotations",
                         kDegreesPerRad * rotation_vector(fit.axes).norm());
    case FrameOffset::kNone:
      break;
  }
  return "";
}

[[nodiscard]] std::string advice(const ConventionFit& fit) {
  if (fit.change == PoseChange::kScalarLast || fit.change == PoseChange::kScalarFirst)
    return "; name the columns in the first line of the file: timestamp,tx,ty,tz,qx,qy,qz,qw";
  if (fit.change != PoseChange::kNone || fit.offset == FrameOffset::kPositions) return "; convert the file";
  return "; if the ground truth is of the body, give an estimate of `run` with --pose-frame body";
}

}  // namespace

std::string describe(const ConventionFinding& finding) {
  const ConventionFit& as_given = finding.as_given;
  const ConventionFit& better = finding.better;
  std::string assumption = change_text(better.change, better.of_truth ? "ground truth" : "estimate");
  const std::string offset = offset_text(better);
  if (!assumption.empty() && !offset.empty()) assumption += ", and if ";
  const double least_m = 0.99 * finding.ate_as_given_m;
  const std::string ate = finding.ate_better_m > least_m
                              ? ""
                              : fmt::format("; the ATE is then {:.4f} m in place of {:.4f} m",
                                            finding.ate_better_m, finding.ate_as_given_m);
  return fmt::format(
      "the files do not mean the same by a pose: relative motions differ by {:.1f} % in rotation and {:.1f} "
      "% in translation, but only by {:.1f} and {:.1f} % if {}{}; all scores are of the files as they are, "
      "so RPE, the errors of segments and NEES mean little{}",
      100.0 * as_given.rotation_error, 100.0 * as_given.translation_error, 100.0 * better.rotation_error,
      100.0 * better.translation_error, assumption + offset, ate, advice(better));
}

}  // namespace stereo_slam
