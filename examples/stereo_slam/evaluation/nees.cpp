// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/nees.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <fmt/ranges.h>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/core/median.hpp"
#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/covariance_columns.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kTriangle = 21;
constexpr std::size_t kBetween = 6;  // columns between the covariances
constexpr std::size_t kColumns = 2 + kTriangle + kBetween + kTriangle;

[[nodiscard]] double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

[[nodiscard]] Matrix6<double> from_triangle(const double* values) {
  Matrix6<double> P;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) P(i, j) = P(j, i) = *values++;
  }
  return P;
}

/// The covariance of T_from_to, composed over the keyframes between the two frames. Nothing if `from` is not
/// one of the keyframes that lead to `to`.
[[nodiscard]] std::optional<Matrix6<double>> relative_covariance(const std::vector<CovarianceRow>& rows,
                                                                 const std::vector<Pose>& poses,
                                                                 std::size_t from, std::size_t to) {
  Matrix6<double> covariance = Matrix6<double>::Zero();
  Matrix6<double> J_common = Matrix6<double>::Zero();
  for (std::size_t k = to; k != from; k = rows[k].keyframe) {
    if (k < from || rows[k].keyframe >= k) return std::nullopt;
    const Matrix6<double> A = (poses[to].inverse() * poses[k]).adjoint();
    covariance += A * rows[k].relative * A.transpose();
    const bool keyframe = k + 1 < rows.size() && rows[k + 1].keyframe == k;
    const PoseGaussian link{poses[rows[k].keyframe].inverse() * poses[k], rows[k].relative};
    if (keyframe) J_common += A * common_error_per_rad(link).asDiagonal();
  }
  const LinkedPose relative{{poses[from].inverse() * poses[to], covariance}, J_common};
  const CalibrationError& error = rows[to].calibration;
  return with_calibration_error(relative.with_common_error(error.common_error_rad), error).covariance;
}

[[nodiscard]] std::vector<Pose> dual_quaternions(PoseSpan poses) {
  std::vector<Pose> result;
  for (const auto& pose : poses) result.push_back(Pose::from_isometry(pose));
  return result;
}

/// The NEES of frame `to` relative to frame `from`, whose relative pose has this covariance.
[[nodiscard]] FrameNees nees_of(const TrackedRun& run, std::size_t from, std::size_t to,
                                Matrix6<double> covariance, const GroundTruthNoise& noise) {
  covariance.diagonal().head<3>().array() += noise.rotation_rad * noise.rotation_rad;
  covariance.diagonal().tail<3>().array() += noise.translation_m * noise.translation_m;
  const Pose truth = run.true_poses[from]->inverse() * *run.true_poses[to];
  const Vector6<double> error = truth.boxminus(run.poses[from].inverse() * run.poses[to]);
  const Eigen::LLT<Matrix6<double>> factor(covariance);
  if (factor.info() != Eigen::Success) {
    throw std::runtime_error(
        fmt::format("the covariance from frame {} to frame {} is not positive definite; give a "
                    "covariances.csv as `run` wrote it",
                    from, to));
  }
  return {from, to, error.dot(factor.solve(error))};
}

[[nodiscard]] NeesScore score_of(const std::vector<FrameNees>& frames) {
  NeesScore score{.count = frames.size()};
  if (frames.empty()) return score;
  std::vector<double> nees(frames.size());
  std::ranges::transform(frames, nees.begin(), [](const FrameNees& f) { return f.value; });
  score.mean = mean_of(nees);
  score.median = median(nees);
  score.share_inside =
      static_cast<double>(std::ranges::count_if(nees, [](double e) { return e <= kChi2_6_95; })) /
      static_cast<double>(nees.size());
  return score;
}

void add_nis(const std::vector<CovarianceRow>& rows, NeesReport& report) {
  std::vector<double> nis;
  for (const auto& row : rows) {
    if (row.nis_dof > 0) nis.push_back(row.nis / row.nis_dof);
  }
  if (nis.empty()) return;
  report.updates = nis.size();
  report.mean_nis_per_dof = mean_of(nis);
  report.median_nis_per_dof = median(nis);
}

void print_score(std::ostream& stream, std::string_view name, const NeesScore& score, std::string_view what) {
  fmt::print(
      stream,
      "{:<32}mean {:.2f}  median {:.2f} (6 and 5.35 expected), {:.0f} % inside the 95 % bound ({} {})\n",
      name, score.mean, score.median, 100.0 * score.share_inside, score.count, what);
}

[[nodiscard]] std::string score_json(const NeesScore& score) {
  if (score.count == 0) return R"("count": 0)";
  return fmt::format(R"("count": {}, "mean": {}, "median": {}, "share_inside_95": {})", score.count,
                     score.mean, score.median, score.share_inside);
}

/// Throws std::runtime_error unless row i can belong to pose i, for every i.
void require_same_run(const Trajectory& estimate, const std::vector<CovarianceRow>& rows) {
  if (rows.size() != estimate.poses.size()) {
    throw std::runtime_error(
        fmt::format("{} of covariances for {}; give both files of the same run, and of one with --realtime "
                    "trajectory_tum.txt",
                    counted(rows.size(), "row"), counted(estimate.poses.size(), "estimated pose")));
  }
  for (std::size_t i = 0; i < estimate.stamps_ns.size(); ++i) {
    if (!rows[i].stamp_ns || is_same_stamp(*rows[i].stamp_ns, estimate.stamps_ns[i])) continue;
    throw std::runtime_error(
        fmt::format("the stamp of frame {} is {} s in the one and {} s in the other: they are of different "
                    "runs; give both files of the same run",
                    i, format_seconds(*rows[i].stamp_ns), format_seconds(estimate.stamps_ns[i])));
  }
}

/// Whether the file has the column of the reasons, which is the last one and which earlier versions did not
/// write. Throws std::runtime_error unless the first line has the names of the columns.
[[nodiscard]] bool has_reasons(const std::filesystem::path& file, const std::vector<TextLine>& lines) {
  const auto names = [](std::string_view text) {
    const auto fields = split_fields(text);
    return std::multiset<std::string_view>(fields.begin(), fields.end());
  };
  const std::string usual = covariance_columns();
  const std::string earlier = usual.substr(0, usual.rfind(','));
  const std::string_view first = lines.empty() ? "" : std::string_view(lines.front().text);
  if (first == usual || first == earlier) return first == usual;
  if (!first.empty()) require_whole_columns(file, lines.front());
  if (names(first) == names(usual) || names(first) == names(earlier))
    fail(file, "its columns are in another order than those that `run` writes; restore their order");
  if (!first.starts_with("stamp_s,status,"))
    fail(file, "not a covariances.csv: the header stamp_s,status,... is missing");
  fail(file, "its columns are not those of this version of stereo_slam; run this version on the recording");
}

/// What is wrong with a row of which a field before the reasons cannot be read.
[[nodiscard]] std::string fault_of_row(const std::vector<std::string_view>& fields, bool before_reasons) {
  const std::string expected = fmt::format("expected stamp, status and {} numbers{}", kColumns - 2,
                                           before_reasons ? " before the reasons" : "");
  if (fields.size() != kColumns) return fmt::format("{}, not {}", expected, counted(fields.size(), "field"));
  const auto wrong =
      std::find_if(fields.begin() + 2, fields.end(), [](auto field) { return !parse_numbers(field); });
  if (wrong == fields.end()) return fmt::format("{}; '{}' is not a stamp", expected, fields[0]);
  return fmt::format("{}; '{}' is not a finite number", expected, *wrong);
}

/// The row of a frame, from its line. Throws std::runtime_error naming file, line and what was wrong.
[[nodiscard]] CovarianceRow row_of(const std::filesystem::path& file, const TextLine& line, std::size_t frame,
                                   bool with_reasons) {
  const auto refuse = [&](std::string_view fault) { fail_at(file, line.number, fault); };
  const std::string_view text = line.text;
  const auto end = with_reasons ? std::min(text.rfind(','), text.size()) : text.size();
  const std::string_view reasons = end < text.size() ? text.substr(end + 1) : "";
  const auto fields = split_fields(text.substr(0, end));
  const auto numbers =
      fields.size() == kColumns ? parse_numbers({fields[2].data(), text.data() + end}) : std::nullopt;
  const auto stamp_ns = numbers ? parse_seconds(fields[0]) : std::nullopt;
  if (!stamp_ns) refuse(fault_of_row(fields, with_reasons));
  require_known_status(file, line.number, fields[1]);
  require_known_reasons(file, line.number, reasons);
  const double* tail = numbers->data() + kTriangle;
  constexpr double kMost = 1e9;  // far above any number of measurements and any calibration error
  if (*std::min_element(tail + 2, tail + kBetween) < 0.0 ||
      *std::max_element(tail + 2, tail + kBetween) > kMost)
    refuse("degrees of freedom and standard deviations must be from 0 to 1e9");
  if (tail[0] < 0.0 || tail[0] > static_cast<double>(frame)) refuse("the keyframe must be an earlier frame");
  return {
      static_cast<std::size_t>(tail[0]), from_triangle(tail + kBetween), tail[1], static_cast<int>(tail[2]),
      {tail[3], tail[4], tail[5]},       from_triangle(numbers->data()), stamp_ns};
}

}  // namespace

bool is_same_stamp(std::int64_t a_ns, std::int64_t b_ns) {
  constexpr std::int64_t kMost_ns = 1000;
  return std::abs(a_ns - b_ns) <= kMost_ns;
}

std::vector<CovarianceRow> read_covariances(const std::filesystem::path& file) {
  std::vector<CovarianceRow> rows;
  auto lines = read_text_lines(file);
  const bool with_reasons = has_reasons(file, lines);
  require_line_end(file, lines);
  rows.reserve(lines.size() - 1);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const TextLine line = std::move(lines[i]);  // its memory is not needed any longer
    rows.push_back(row_of(file, line, rows.size(), with_reasons));
  }
  return rows;
}

std::vector<FrameNees> relative_nees(const TrackedRun& run, std::size_t frames,
                                     const GroundTruthNoise& noise) {
  const auto& [rows, poses, true_poses] = run;
  std::vector<bool> anchored(rows.size(), false);
  for (const auto& row : rows) {
    if (row.keyframe < rows.size()) anchored[row.keyframe] = true;
  }
  std::vector<FrameNees> nees;
  for (std::size_t i = 0; i + frames < rows.size(); ++i) {
    const std::size_t j = i + frames;
    if (!anchored[i] || !true_poses[i] || !true_poses[j]) continue;
    const auto covariance = relative_covariance(rows, poses, i, j);
    if (covariance) nees.push_back(nees_of(run, i, j, *covariance, noise));
  }
  return nees;
}

std::vector<FrameNees> world_nees(const TrackedRun& run, const GroundTruthNoise& noise) {
  constexpr double kCertain = 1e-6;  // rad^2 and m^2
  constexpr double kUnknown = 1e4;
  const auto origin = std::ranges::find_if(
      run.rows, [](const CovarianceRow& row) { return row.in_world.trace() < kUnknown; });
  const auto first = static_cast<std::size_t>(origin - run.rows.begin());
  std::vector<FrameNees> nees;
  if (origin == run.rows.end() || !run.true_poses[first] || origin->in_world.trace() > kCertain) return nees;
  for (std::size_t i = first + 1; i < run.rows.size(); ++i) {
    const auto& covariance = run.rows[i].in_world;
    if (run.true_poses[i] && !covariance.isZero(0.0))
      nees.push_back(nees_of(run, first, i, covariance, noise));
  }
  return nees;
}

NeesReport score_covariances(const Trajectory& truth, const Trajectory& estimate, const FramePairs& pairs,
                             const std::vector<CovarianceRow>& rows, const GroundTruthNoise& noise) {
  require_same_run(estimate, rows);
  if (std::ranges::all_of(rows, [](const CovarianceRow& row) { return row.relative.isZero(0.0); }))
    throw std::runtime_error(
        "all covariances of relative poses are zero; give a covariances.csv as `run` wrote it");
  TrackedRun run{.rows = rows, .poses = dual_quaternions(estimate.poses), .true_poses = {}};
  run.true_poses.resize(run.poses.size());
  for (const auto& [i, j] : pairs) run.true_poses[j] = Pose::from_isometry(truth.poses[i]);

  NeesReport report;
  report.truth_taken_as_exact = noise.translation_m == 0.0 && noise.rotation_rad == 0.0;
  for (const std::size_t frames : {1, 10, 100}) {
    report.relative.push_back({score_of(relative_nees(run, frames, noise)), frames});
  }
  report.in_world = score_of(world_nees(run, noise));
  add_nis(rows, report);
  return report;
}

void print_nees(std::ostream& stream, const NeesReport& report) {
  for (const auto& r : report.relative) {
    const std::string name = "NEES over " + counted(r.frames, "frame");
    if (r.count == 0) {
      fmt::print(stream, "{:<32}n/a (the run is too short)\n", name);
    } else {
      print_score(stream, name, r, "relative poses");
    }
  }
  if (report.in_world.count > 0) print_score(stream, "NEES from the first frame", report.in_world, "poses");
  if (report.updates > 0) {
    fmt::print(stream, "{:<32}mean {:.3f}  median {:.3f} per degree of freedom (1 expected, {} updates)\n",
               "NIS of the pose updates", report.mean_nis_per_dof, report.median_nis_per_dof, report.updates);
  }
  if (report.truth_taken_as_exact) {
    fmt::print(stream,
               "hint: the ground truth is taken as exact, which is right for rendered drives only; "
               "--truth-sigma-m and --truth-sigma-deg allow for its errors (KITTI: 0.03 and 0.1)\n");
  }
}

std::string nees_json(const NeesReport& report) {
  std::vector<std::string> relative;
  for (const auto& r : report.relative) {
    relative.push_back(fmt::format(R"({{"frames": {}, {}}})", r.frames, score_json(r)));
  }
  return fmt::format(
      R"({{"relative_nees": [{}], "world_nees": {{{}}}, "updates": {}, "mean_nis_per_dof": {}, "median_nis_per_dof": {}}})",
      fmt::join(relative, ", "), score_json(report.in_world), report.updates, report.mean_nis_per_dof,
      report.median_nis_per_dof);
}

}  // namespace stereo_slam
