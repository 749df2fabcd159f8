// SPDX-License-Identifier: MIT
#include "stereo_slam/report/run_charts.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "stereo_slam/report/trajectory_geometry.hpp"

namespace stereo_slam::report {
namespace {

/// One value per frame.
template <class Function>
[[nodiscard]] std::vector<double> of_frames(const RunRecord& record, const Function& value) {
  std::vector<double> values;
  for (const auto& result : record.results) values.push_back(static_cast<double>(value(result)));
  return values;
}

/// One value per final pose.
template <class Function>
[[nodiscard]] std::vector<double> of_poses(const RunRecord& record, const Function& value) {
  std::vector<double> values;
  for (const auto& estimate : record.trajectory) values.push_back(value(estimate));
  return values;
}

[[nodiscard]] LineChart over_frames(const RunRecord& record, const char* title) {
  LineChart chart;
  chart.title = title;
  chart.x_title = "frame";
  chart.x = of_frames(record, [](const FrameResult& result) { return result.index; });
  return chart;
}

[[nodiscard]] Series accepted_loops(const RunRecord& record) {
  Series marks{.name = "loop", .values = {}};
  for (const auto& loop : record.loops)
    if (loop.accepted) marks.values.push_back(static_cast<double>(loop.frame));
  return marks;
}

/// Square roots of the covariance's diagonal, `scale` times.
[[nodiscard]] Series sigma(const RunRecord& record, const char* name, int axis, double scale) {
  return {name, of_poses(record, [&](const PoseGaussian& estimate) {
            return scale * std::sqrt(estimate.covariance(axis, axis));
          })};
}

}  // namespace

LineChart height_chart(const RunRecord& record) {
  LineChart chart;
  chart.title = "Height, m";
  chart.x_title = "path length, m";
  chart.x = path_lengths(record.trajectory);
  chart.lines = {{"above the first camera", of_poses(record, [](const PoseGaussian& estimate) {
                    return -estimate.pose.translation().y();
                  })}};
  chart.band = {"1 sigma", of_poses(record, [](const PoseGaussian& estimate) {
                  return std::sqrt(position_covariance(estimate)(1, 1));
                })};
  chart.from_zero = false;
  return chart;
}

LineChart position_sigma_chart(const RunRecord& record) {
  LineChart chart = over_frames(record, "Position, 1 sigma, m");
  chart.lines = {sigma(record, "right", 3, 1.0), sigma(record, "down", 4, 1.0),
                 sigma(record, "forward", 5, 1.0)};
  chart.marks = accepted_loops(record);
  return chart;
}

LineChart rotation_sigma_chart(const RunRecord& record) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  LineChart chart = over_frames(record, "Rotation, 1 sigma, degrees");
  chart.lines = {sigma(record, "pitch", 0, kDegrees), sigma(record, "yaw", 1, kDegrees),
                 sigma(record, "roll", 2, kDegrees)};
  chart.marks = accepted_loops(record);
  return chart;
}

LineChart time_chart(const RunRecord& record) {
  LineChart chart = over_frames(record, "Time per frame, ms");
  for (const auto& stage : stage_names(record))
    chart.stack.push_back(
        {stage, of_frames(record, [&](const FrameResult& result) { return stage_ms(result, stage); })});
  chart.lines = {{"total", record.total_ms}};
  return chart;
}

LineChart memory_chart(const RunRecord& record) {
  LineChart chart = over_frames(record, "Memory of the process, MB");
  chart.lines = {{"resident", record.resident_mb}};
  return chart;
}

LineChart count_chart(const RunRecord& record) {
  LineChart chart = over_frames(record, "Features, landmarks, matches");
  chart.lines = {{"features", of_frames(record, [](const FrameResult& result) { return result.features; })},
                 {"landmarks", of_frames(record, [](const FrameResult& result) { return result.landmarks; })},
                 {"matches", of_frames(record, [](const FrameResult& result) { return result.matches; })}};
  return chart;
}

LineChart innovation_chart(const RunRecord& record) {
  LineChart chart = over_frames(record, "Innovation squared per degree of freedom");
  chart.lines = {{"pose update", of_frames(record, [](const FrameResult& result) {
                    return result.nis_dof > 0 ? result.nis / result.nis_dof
                                              : std::numeric_limits<double>::quiet_NaN();
                  })}};
  chart.level = {"expected", 1.0};
  return chart;
}

}  // namespace stereo_slam::report
