// SPDX-License-Identifier: MIT
#include "stereo_slam/report/comparison.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/report/page.hpp"
#include "stereo_slam/report/rounding.hpp"

namespace stereo_slam::report {
namespace {

using nlohmann::json;

constexpr std::size_t kMostFramesInAll = 8000;  // of all runs together
constexpr std::size_t kFewestFrames = 200;      // of each

/// The quantile of the finite values, `share` in [0, 1]; NaN if there are none.
[[nodiscard]] double quantile(std::vector<double> values, double share) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return kNaN;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Scores of a run, and its errors for the chart and the view.
struct Errors {
  json scores = nullptr;
  std::vector<double> error_m;           ///< after SE(3) alignment, one a frame
  std::vector<Vector3<double>> truth_m;  ///< positions of the ground truth in the world of the run
};

[[nodiscard]] json scores_of(const Evaluation& evaluation) {
  const auto score = [](const auto& optional, auto member) {
    return optional ? to_digits((*optional).*member, 4) : kNaN;
  };
  return {{"ate_m", to_digits(evaluation.ate_aligned_m.rmse, 4)},
          {"t_rel_percent", score(evaluation.kitti, &KittiScore::t_rel_percent)},
          {"r_rel_deg_per_100m", score(evaluation.kitti, &KittiScore::r_rel_deg_per_100m)},
          {"t_rel_short_percent", score(evaluation.segments_10_50_m, &KittiScore::t_rel_percent)},
          {"rpe_10m_m", evaluation.rpe_10m ? to_digits(evaluation.rpe_10m->translation_m.rmse, 4) : kNaN}};
}

/// Throws std::runtime_error if too few poses match.
[[nodiscard]] Errors errors_of(const RunFolder& run, const ComparisonTruth& truth) {
  Trajectory estimate = run.trajectory;
  if (truth.trajectory.stamps_ns.empty()) estimate.stamps_ns.clear();  // match by index, not by stamp
  Errors errors{.scores = scores_of(evaluate(truth.trajectory, estimate, truth.max_difference_s)),
                .error_m = std::vector<double>(estimate.poses.size(), kNaN),
                .truth_m = {}};
  const FramePairs pairs = match_poses(truth.trajectory, estimate, truth.max_difference_s);
  std::vector<Eigen::Isometry3d> true_poses, poses;
  for (const auto& [i, k] : pairs) {
    true_poses.push_back(truth.trajectory.poses[i]);
    poses.push_back(estimate.poses[k]);
  }
  const Eigen::Isometry3d T_world_truth = align(true_poses, poses).inverse();
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    errors.truth_m.push_back(T_world_truth * true_poses[p].translation());
    errors.error_m[pairs[p].second] = (errors.truth_m.back() - poses[p].translation()).norm();
  }
  return errors;
}

/// An array of every `step`-th element.
template <class Value, class Function>
[[nodiscard]] json thinned(const std::vector<Value>& values, std::size_t step, const Function& append) {
  json array = json::array();
  for (std::size_t k = 0; k < values.size(); k += step) append(array, values[k]);
  return array;
}

void append_number(json& array, double value) { array.push_back(to_digits(value, 4)); }

void append_position(json& array, const Vector3<double>& position) {
  for (Eigen::Index i = 0; i < 3; ++i) array.push_back(to_decimals(position[i], 3));
}

[[nodiscard]] json run_json(const RunFolder& run, const Errors& errors, std::size_t step) {
  const Trajectory& trajectory = run.trajectory;
  const auto distances_m = distances_along(trajectory.poses);
  json data = {{"dataset", run.entry("dataset.folder")},
               {"state", run.entry("state")},
               {"problem", run.problem},
               {"frame_count", trajectory.poses.size()},
               {"lost", run.lost},
               {"length_m", distances_m.empty() ? 0.0 : to_decimals(distances_m.back(), 2)},
               {"loops", run.accepted_loops},
               {"median_ms", to_decimals(quantile(run.total_ms, 0.5), 2)},
               {"p95_ms", to_decimals(quantile(run.total_ms, 0.95), 2)},
               {"seconds", run.number("seconds")},
               {"peak_mb", run.number("memory.peak_mb")},
               {"scores", errors.scores}};
  data["time_s"] = thinned(trajectory.stamps_ns, step, [&](json& array, std::int64_t stamp_ns) {
    array.push_back(to_decimals(1e-9 * static_cast<double>(stamp_ns - trajectory.stamps_ns.front()), 3));
  });
  data["position_m"] = thinned(trajectory.poses, step, [](json& array, const Eigen::Isometry3d& pose) {
    append_position(array, pose.translation());
  });
  data["sigma_m"] = thinned(run.sigma_m, step, append_number);
  data["nis_per_dof"] = thinned(run.nis_per_dof, step, append_number);
  data["total_ms"] = thinned(run.total_ms, step, append_number);
  data["resident_mb"] = thinned(run.resident_mb, step, append_number);
  data["error_m"] = thinned(errors.error_m, step, append_number);
  return data;
}

/// Names of the runs on the page: the last part of the folder, or the whole path if these are not unique.
[[nodiscard]] std::vector<std::string> names_of(const std::vector<RunFolder>& runs) {
  std::vector<std::string> names;
  names.reserve(runs.size());
  for (const auto& run : runs) names.push_back((run.folder / "").parent_path().filename().string());
  if (std::set<std::string>(names.begin(), names.end()).size() == names.size()) return names;
  for (std::size_t i = 0; i < runs.size(); ++i) names[i] = runs[i].folder.string();
  return names;
}

/// Whether an entry of run.yaml says how a run was made rather than what came out.
[[nodiscard]] bool is_condition(const std::string& key) {
  static const std::set<std::string> conditions = {"version",        "pose_frame",    "dataset.folder",
                                                   "dataset.format", "host.name",     "host.processor",
                                                   "host.cores",     "host.compiler", "host.opencv"};
  return key.starts_with("settings.") || conditions.contains(key);
}

[[nodiscard]] json differences(const std::vector<RunFolder>& runs) {
  std::set<std::string> keys;
  for (const auto& run : runs) {
    for (const auto& [key, value] : run.entries) {
      if (is_condition(key)) keys.insert(key);
    }
  }
  json array = json::array();
  for (const auto& key : keys) {
    std::vector<std::string> values;
    values.reserve(runs.size());
    for (const auto& run : runs) values.push_back(run.entries.contains(key) ? run.entry(key) : "–");
    if (std::set<std::string>(values.begin(), values.end()).size() < 2) continue;
    constexpr std::string_view kSettings = "settings.";
    array.push_back(
        {{"key", key.starts_with(kSettings) ? key.substr(kSettings.size()) : key}, {"values", values}});
  }
  return array;
}

[[nodiscard]] bool same_recording(const std::vector<RunFolder>& runs) {
  return std::ranges::all_of(runs, [&](const RunFolder& run) {
    return run.entry("dataset.folder") == runs.front().entry("dataset.folder");
  });
}

[[nodiscard]] std::size_t step_of(const std::vector<RunFolder>& runs) {
  const std::size_t each = std::max(kFewestFrames, kMostFramesInAll / runs.size());
  std::size_t longest = 1;
  for (const auto& run : runs) longest = std::max(longest, run.trajectory.poses.size());
  return (longest + each - 1) / each;
}

}  // namespace

json comparison_data(const std::vector<RunFolder>& runs, const std::optional<ComparisonTruth>& truth) {
  if (runs.empty()) throw std::invalid_argument("a comparison needs a run");
  const auto names = names_of(runs);
  const std::size_t step = step_of(runs);
  json data = {{"kind", "comparison"},
               {"title", "Comparison of " + counted(runs.size(), "run")},
               {"subtitle", same_recording(runs) ? runs.front().entry("dataset.folder") : ""},
               {"error", ""},
               {"version", STEREO_SLAM_VERSION},
               {"same_recording", same_recording(runs)},
               {"has_truth", truth.has_value()},
               {"truth_position_m", json::array()},
               {"runs", json::array()},
               {"differences", differences(runs)}};
  for (std::size_t i = 0; i < runs.size(); ++i) {
    RunFolder run = runs[i];
    Errors errors;
    try {
      if (truth && !run.trajectory.poses.empty()) errors = errors_of(run, *truth);
    } catch (const std::runtime_error& error) {
      if (run.problem.empty()) run.problem = error.what();
    }
    errors.error_m.resize(run.trajectory.poses.size(), kNaN);
    if (data["truth_position_m"].empty())
      data["truth_position_m"] = thinned(errors.truth_m, step, append_position);
    json entry = run_json(run, errors, step);
    entry["id"] = fmt::format("run{}", i);
    entry["name"] = names[i];
    data["runs"].push_back(std::move(entry));
  }
  return data;
}

void write_comparison(std::ostream& stream, const std::vector<RunFolder>& runs,
                      const std::optional<ComparisonTruth>& truth) {
  write_page(stream, kComparisonGenerator, comparison_data(runs, truth));
}

}  // namespace stereo_slam::report
