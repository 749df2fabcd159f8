// SPDX-License-Identifier: MIT
#include "stereo_slam/report/run_data.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <optional>

#include <nlohmann/json.hpp>

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/report/inertial_data.hpp"
#include "stereo_slam/report/rounding.hpp"
#include "stereo_slam/report/trajectory_geometry.hpp"
#include "stereo_slam/report/truth_errors.hpp"

namespace stereo_slam::report {
namespace {

using nlohmann::json;
using Rows = std::vector<std::size_t>;

constexpr std::size_t kMostFrames = 5000;
constexpr std::size_t kMostMapPoints = 12'000;
constexpr std::size_t kMostEllipsoids = 40;
constexpr std::size_t kMostLoops = 500;
constexpr double kDegrees = 180.0 / std::numbers::pi;

/// One element a shown frame.
template <class Function>
[[nodiscard]] json array_of(const Rows& rows, const Function& value) {
  json array = json::array();
  for (const std::size_t k : rows) array.push_back(value(k));
  return array;
}

/// Appends the elements of a vector, rounded to `decimals` decimal places.
template <class Vector>
void append_decimals(json& array, const Vector& values, int decimals) {
  for (Eigen::Index i = 0; i < values.size(); ++i) array.push_back(to_decimals(values[i], decimals));
}

void append_digits(json& array, const Vector3<double>& values) {
  constexpr int kDigits = 3;
  for (Eigen::Index i = 0; i < values.size(); ++i) array.push_back(to_digits(values[i], kDigits));
}

[[nodiscard]] Eigen::Vector4d xyzw(const Pose& pose) {
  const antipode::Vector4<double> q = antipode::canonical(pose.rotation());
  return {q[1], q[2], q[3], q[0]};
}

[[nodiscard]] std::vector<std::int64_t> stamps_of(const RunRecord& record) {
  std::vector<std::int64_t> stamps_ns;
  for (const auto& result : record.results) stamps_ns.push_back(result.stamp_ns);
  return stamps_ns;
}

/// Poses and their standard deviations.
void add_poses(json& frames, const RunRecord& record, const Rows& rows) {
  json positions = json::array(), quaternions = json::array(), sigma_m = json::array(),
       sigma_deg = json::array();
  for (const std::size_t k : rows) {
    const PoseGaussian& estimate = record.trajectory[k];
    const Vector6<double> sigma = estimate.covariance.diagonal().cwiseSqrt();
    append_decimals(positions, estimate.pose.translation(), 3);
    append_decimals(quaternions, xyzw(estimate.pose), 4);
    append_digits(sigma_m, sigma.tail<3>());
    append_digits(sigma_deg, kDegrees * sigma.head<3>());
  }
  frames["position_m"] = std::move(positions);
  frames["quaternion_xyzw"] = std::move(quaternions);
  frames["sigma_position_m"] = std::move(sigma_m);
  frames["sigma_rotation_deg"] = std::move(sigma_deg);
  frames["sigma_height_m"] = array_of(rows, [&](std::size_t k) {
    return to_digits(std::sqrt(position_covariance(record.trajectory[k])(1, 1)), 3);
  });
  const auto speeds_mps = speeds(record.trajectory, stamps_of(record));
  frames["speed_mps"] = array_of(rows, [&](std::size_t k) { return to_decimals(speeds_mps[k], 2); });
}

/// The reasons that hold as a number: bit i is that of kWeakReasons[i].
[[nodiscard]] unsigned reason_bits(const WeakReasons& weak) {
  unsigned bits = 0;
  for (std::size_t i = 0; i < kWeakReasons.size(); ++i) {
    if (weak.*kWeakReasons[i].flag) bits |= 1U << i;
  }
  return bits;
}

/// What the tracking reports of each frame.
void add_tracking(json& frames, const RunRecord& record, const Rows& rows) {
  const auto of_results = [&](const auto& value) {
    return array_of(rows, [&](std::size_t k) { return value(record.results[k]); });
  };
  const std::int64_t begin_ns = record.results.front().stamp_ns;
  frames["index"] = of_results([](const FrameResult& result) { return result.index; });
  frames["time_s"] = of_results([&](const FrameResult& result) {
    return to_decimals(1e-9 * static_cast<double>(result.stamp_ns - begin_ns), 3);
  });
  frames["status"] = of_results([](const FrameResult& result) { return static_cast<int>(result.status); });
  frames["reasons"] = of_results([](const FrameResult& result) { return reason_bits(result.weak); });
  frames["keyframe"] = of_results([](const FrameResult& result) { return result.keyframe; });
  frames["segment"] = of_results([](const FrameResult& result) { return result.segment; });
  frames["features"] = of_results([](const FrameResult& result) { return result.features; });
  frames["landmarks"] = of_results([](const FrameResult& result) { return result.landmarks; });
  frames["matches"] = of_results([](const FrameResult& result) { return result.matches; });
  frames["nis_per_dof"] = of_results([](const FrameResult& result) {
    return result.nis_dof > 0 ? to_digits(result.nis / result.nis_dof, 3) : kNaN;
  });
}

void add_costs(json& frames, const RunRecord& record, const Rows& rows) {
  frames["total_ms"] = array_of(rows, [&](std::size_t k) { return to_decimals(record.total_ms[k], 2); });
  frames["resident_mb"] =
      array_of(rows, [&](std::size_t k) { return to_decimals(record.resident_mb[k], 1); });
  frames["stages"] = json::array();
  for (const auto& stage : stage_names(record)) {
    frames["stages"].push_back({{"name", stage}, {"ms", array_of(rows, [&](std::size_t k) {
                                                    return to_decimals(stage_ms(record.results[k], stage), 2);
                                                  })}});
  }
}

[[nodiscard]] json frames_json(const RunRecord& record, const Rows& rows) {
  json frames;
  if (rows.empty()) return {{"time_s", json::array()}};
  add_tracking(frames, record, rows);
  add_poses(frames, record, rows);
  add_costs(frames, record, rows);
  return frames;
}

/// Ellipsoids at equal distances along the path.
[[nodiscard]] json ellipsoids_json(const RunRecord& record) {
  json ellipsoids = json::array();
  const auto lengths_m = path_lengths(record.trajectory);
  for (std::size_t k = 0; k < lengths_m.size() && ellipsoids.size() < kMostEllipsoids; ++k) {
    const double due_m = static_cast<double>(ellipsoids.size() + 1) / kMostEllipsoids * lengths_m.back();
    const PoseGaussian& estimate = record.trajectory[k];
    if (!(lengths_m[k] > 0.0) || lengths_m[k] < due_m * (1.0 - 1e-12) || !estimate.covariance.allFinite())
      continue;
    const SigmaEllipsoid sigma = sigma_ellipsoid(estimate);
    json centre = json::array(), axes = json::array(), rotation = json::array();
    append_decimals(centre, estimate.pose.translation(), 3);
    append_digits(axes, sigma.half_axes_m);
    append_decimals(rotation, sigma.R_world_ellipsoid.coeffs(), 4);
    ellipsoids.push_back({{"frame", record.results[k].index},
                          {"centre", std::move(centre)},
                          {"half_axes", std::move(axes)},
                          {"rotation", std::move(rotation)}});
  }
  return ellipsoids;
}

/// The map, thinned out evenly. Points far from the path, which the view does not show, are left out.
[[nodiscard]] json map_json(const RunRecord& record) {
  Eigen::AlignedBox3d box;
  for (const auto& estimate : record.trajectory) {
    if (estimate.pose.translation().allFinite()) box.extend(estimate.pose.translation());
  }
  json positions = json::array(), intensity = json::array();
  if (box.isEmpty()) return {{"positions", positions}, {"intensity", intensity}};
  const double reach_m = std::max(100.0, 0.5 * box.diagonal().norm());
  std::vector<const MapPoint*> near;
  for (const auto& point : record.map_points) {
    if (box.exteriorDistance(point.position_world) < reach_m) near.push_back(&point);
  }
  const std::size_t shown = std::min(near.size(), kMostMapPoints);
  for (std::size_t i = 0; i < shown; ++i) {
    const MapPoint& point = *near[i * near.size() / shown];
    append_decimals(positions, point.position_world, 2);
    intensity.push_back(point.intensity);
  }
  return {{"positions", std::move(positions)}, {"intensity", std::move(intensity)}};
}

[[nodiscard]] json loops_json(const std::vector<LoopEvent>& loops) {
  json array = json::array();
  for (const auto& loop : loops) {
    if (array.size() == kMostLoops) break;
    array.push_back({{"frame", loop.frame},
                     {"old_frame", loop.old_frame},
                     {"in_loaded_map", loop.in_loaded_map},
                     {"inliers", loop.inliers},
                     {"chi2", to_digits(loop.chi2, 4)},
                     {"accepted", loop.accepted}});
  }
  return array;
}

/// Positions without loop closure. Null if no loop was accepted, and if there is a loop with a loaded map,
/// because the poses are in the world of that map then.
[[nodiscard]] json without_loops_json(const RunRecord& record, const Rows& rows) {
  const auto& loops = record.loops;
  if (std::ranges::none_of(loops, [](auto& loop) { return loop.accepted; }) ||
      std::ranges::any_of(loops, [](auto& loop) { return loop.in_loaded_map; }))
    return nullptr;
  json positions = json::array();
  for (const std::size_t k : rows)
    append_decimals(positions, record.results[k].T_odometry_camera.translation(), 3);
  return positions;
}

[[nodiscard]] json truth_json(const RunRecord& record, const Trajectory& truth, const Rows& rows) {
  const auto errors = truth_errors(record, truth);
  if (!errors) return nullptr;
  json positions = json::array();
  for (const std::size_t k : rows) append_decimals(positions, errors->position_m[k], 3);
  const auto digits_of = [&](const auto& value) {
    return array_of(rows, [&](std::size_t k) { return to_digits(value(k), 3); });
  };
  return {{"position_m", std::move(positions)},
          {"error_m", digits_of([&](std::size_t k) { return errors->error_m[k]; })},
          {"error_deg", digits_of([&](std::size_t k) { return kDegrees * errors->error_rad[k]; })},
          {"nees", digits_of([&](std::size_t k) { return errors->nees[k]; })},
          {"ate_m", to_digits(errors->ate_m.rmse, 3)}};
}

[[nodiscard]] json thumbnails_json(const std::vector<Thumbnail>& thumbnails) {
  json array = json::array();
  for (const auto& image : thumbnails)
    array.push_back({{"frame", image.frame}, {"jpeg", base64(image.jpeg)}});
  return array;
}

[[nodiscard]] json status_counts(const RunRecord& record) {
  std::array<std::size_t, 5> counts{};
  for (const auto& result : record.results) ++counts.at(static_cast<std::size_t>(result.status));
  return counts;
}

/// Each of kWeakReasons in plain words, with the numbers of frames that have it.
[[nodiscard]] json reasons_json(const RunRecord& record) {
  const ReasonCounts weak = count_reasons(record, TrackingStatus::kWeak),
                     lost = count_reasons(record, TrackingStatus::kLost);
  json array = json::array();
  for (std::size_t i = 0; i < kWeakReasons.size(); ++i)
    array.push_back({{"text", kWeakReasons[i].text}, {"weak", weak[i]}, {"lost", lost[i]}});
  return array;
}

[[nodiscard]] json loop_counts(const std::vector<LoopEvent>& loops) {
  const auto accepted = std::ranges::count_if(loops, [](auto& loop) { return loop.accepted; });
  return {{"accepted", accepted}, {"refused", static_cast<std::ptrdiff_t>(loops.size()) - accepted}};
}

void add_figures(json& data, const RunRecord& record, const RunInfo& info) {
  const auto name = std::filesystem::path(info.dataset).filename().string();
  const auto lengths_m = path_lengths(record.trajectory);
  data["title"] = name.empty() ? info.dataset : name;
  data["subtitle"] = info.dataset;
  data["version"] = STEREO_SLAM_VERSION;
  data["preset"] = info.preset;
  data["state"] = info.header.state;
  data["error"] = info.header.error;
  data["unreadable_images"] = info.header.unreadable.size();
  data["seconds"] = to_decimals(info.header.seconds, 3);
  data["peak_mb"] = to_decimals(info.header.peak_mb, 1);
  data["bytes_per_keyframe"] = info.header.bytes_per_keyframe;
  data["frame_count"] = record.results.size();
  data["keyframe_count"] = count_frames(record, &FrameResult::is_keyframe);
  data["landmark_count"] = record.map_points.size();
  data["length_m"] = lengths_m.empty() ? 0.0 : to_decimals(lengths_m.back(), 2);
  data["median_ms"] = to_decimals(median(record.total_ms), 2);
  data["status_counts"] = status_counts(record);
  data["reasons"] = reasons_json(record);
  data["loop_counts"] = loop_counts(record.loops);
}

/// Orders the statuses: the larger, the worse.
[[nodiscard]] int severity(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::kLost:
      return 3;
    case TrackingStatus::kWeak:
      return 2;
    case TrackingStatus::kRelocalised:
      return 1;
    case TrackingStatus::kInitializing:
    case TrackingStatus::kOk:
      return 0;
  }
  return 0;
}

}  // namespace

std::vector<std::size_t> shown_frames(std::span<const TrackingStatus> statuses, std::size_t most) {
  Rows rows;
  const std::size_t step = statuses.size() > most ? (statuses.size() + most - 2) / (most - 1) : 1;
  for (std::size_t begin = 0; begin < statuses.size(); begin += step) {
    const auto first = statuses.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = statuses.begin() + static_cast<std::ptrdiff_t>(std::min(begin + step, statuses.size()));
    const auto worst = std::max_element(
        first, last, [](TrackingStatus a, TrackingStatus b) { return severity(a) < severity(b); });
    rows.push_back(static_cast<std::size_t>(worst - statuses.begin()));
  }
  if (!rows.empty() && rows.back() + 1 < statuses.size()) rows.push_back(statuses.size() - 1);
  return rows;
}

json run_data(const RunRecord& record, const RunInfo& info) {
  std::vector<TrackingStatus> statuses;
  for (const auto& result : record.results) statuses.push_back(result.status);
  const Rows rows = shown_frames(statuses, kMostFrames);
  json data = {{"kind", "run"}};
  add_figures(data, record, info);
  data["frames"] = frames_json(record, rows);
  data["ellipsoids"] = ellipsoids_json(record);
  data["map"] = map_json(record);
  data["loops"] = loops_json(record.loops);
  data["without_loops_m"] = without_loops_json(record, rows);
  data["inertial"] = inertial_data(record.results, rows);
  data["truth"] = truth_json(record, info.ground_truth, rows);
  data["thumbnails"] = thumbnails_json(info.thumbnails);
  return data;
}

}  // namespace stereo_slam::report
