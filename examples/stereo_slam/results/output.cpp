// SPDX-License-Identifier: MIT
#include "stereo_slam/results/output.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <antipode/geometry/interpolation.hpp>

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/io/covariance_columns.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/results/inertial_table.hpp"

namespace stereo_slam {
namespace {

constexpr std::array kResultFiles = {"trajectory_kitti.txt",
                                     "trajectory_tum.txt",
                                     "trajectory_online.txt",
                                     "covariances.csv",
                                     "timing.csv",
                                     "loops.csv",
                                     "map.ply",
                                     "cameras.yaml",
                                     "inertial.csv",
                                     "report.html"};

std::vector<Pose> poses_of(std::span<const PoseGaussian> estimates) {
  std::vector<Pose> poses;
  for (const auto& estimate : estimates) poses.push_back(estimate.pose);
  return poses;
}

/// The pose of a frame with this stamp that was dropped before the processed frame `next`: interpolated, or
/// the first pose if `next` is 0.
Pose pose_between(const RunRecord& record, std::size_t next, std::int64_t stamp_ns) {
  const auto& trajectory = record.trajectory;
  const auto& results = record.results;
  if (next == 0) return trajectory.front().pose;
  const std::int64_t before_ns = results[next - 1].stamp_ns;
  const auto gap_ns = static_cast<double>(results[next].stamp_ns - before_ns);
  return antipode::sclerp(trajectory[next - 1].pose, trajectory[next].pose,
                          static_cast<double>(stamp_ns - before_ns) / gap_ns);
}

}  // namespace

std::size_t count_frames(const RunRecord& record, const std::function<bool(const FrameResult&)>& property) {
  return static_cast<std::size_t>(std::ranges::count_if(record.results, property));
}

ReasonCounts count_reasons(const RunRecord& record, TrackingStatus status) {
  ReasonCounts counts{};
  for (const auto& result : record.results) {
    if (result.status != status) continue;
    for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += result.weak.*kWeakReasons[i].flag ? 1 : 0;
  }
  return counts;
}

FrameCost frame_cost(const RunRecord& record) {
  const auto mean = [](const std::vector<double>& values) {
    const auto count = static_cast<double>(std::max<std::size_t>(values.size(), 1));
    return std::accumulate(values.begin(), values.end(), 0.0) / count;
  };
  return {.median_ms = median(record.total_ms),
          .p95_ms = quantile(record.total_ms, 0.95),
          .max_ms = quantile(record.total_ms, 1.0),
          .cpu_ms = mean(record.cpu_ms),
          .read_cpu_ms = mean(record.read_cpu_ms)};
}

std::optional<RealtimeSummary> realtime_summary(const RunRecord& record) {
  if (!record.realtime) return std::nullopt;
  RealtimeSummary summary{.reading_delay_s = record.realtime->reading_delay_s};
  std::vector<double> latency_ms;
  for (const auto& frame : record.realtime->frames) {
    summary.dropped += frame.dropped_ns.size();
    latency_ms.push_back(frame.latency_ms);
  }
  summary.median_ms = median(latency_ms);
  summary.p95_ms = quantile(latency_ms, 0.95);
  summary.max_ms = quantile(latency_ms, 1.0);
  return summary;
}

std::vector<Pose> poses_of_all_frames(const RunRecord& record) {
  if (!record.realtime) return poses_of(record.trajectory);
  std::vector<Pose> poses;
  for (std::size_t k = 0; k < record.trajectory.size(); ++k) {
    for (const std::int64_t stamp_ns : record.realtime->frames[k].dropped_ns)
      poses.push_back(pose_between(record, k, stamp_ns));
    poses.push_back(record.trajectory[k].pose);
  }
  return poses;
}

std::span<const char* const> result_files() { return kResultFiles; }

void write_results(const std::filesystem::path& folder, const RunRecord& record) {
  const auto poses = poses_of(record.trajectory);
  std::vector<Pose> online;
  std::vector<std::int64_t> stamps_ns;
  for (const auto& result : record.results) {
    stamps_ns.push_back(result.stamp_ns);
    online.push_back(result.T_odometry_camera);
  }
  std::string first_error;
  const auto write = [&](const char* name, const std::function<void(std::ostream&)>& content) {
    try {
      write_file(folder / name, content);
    } catch (const std::exception& error) {
      if (first_error.empty()) first_error = error.what();
    }
  };
  write("trajectory_kitti.txt", [&](auto& out) { write_kitti_trajectory(out, poses_of_all_frames(record)); });
  write("trajectory_tum.txt", [&](auto& out) { write_tum_trajectory(out, stamps_ns, poses); });
  write("trajectory_online.txt", [&](auto& out) { write_tum_trajectory(out, stamps_ns, online); });
  write("covariances.csv", [&](auto& out) { write_covariances(out, record); });
  write("timing.csv", [&](auto& out) { write_timing(out, record); });
  write("loops.csv", [&](auto& out) { write_loops(out, record.loops); });
  write("map.ply", [&](auto& out) { write_ply(out, record.map_points); });
  if (record.inertial) write("inertial.csv", [&](auto& out) { write_inertial(out, record.results); });
  if (record.rig.learned)
    write("cameras.yaml", [&](auto& out) { write_learned_cameras(out, *record.rig.learned); });
  if (!first_error.empty()) throw std::runtime_error(first_error);
}

void write_covariances_header(std::ostream& stream) { stream << covariance_columns() << '\n'; }

void write_covariances_row(std::ostream& stream, const FrameResult& result,
                           const Matrix6<double>& covariance) {
  const auto print_triangle = [&](const Matrix6<double>& P) {
    for (int i = 0; i < 6; ++i) {
      for (int j = i; j < 6; ++j) fmt::print(stream, ",{:.9g}", P(i, j));
    }
  };
  fmt::print(stream, "{},{}", format_seconds(result.stamp_ns), to_string(result.status));
  print_triangle(covariance);
  fmt::print(stream, ",{},{:.6g},{},{:.6g},{:.6g},{:.6g}", result.keyframe, result.nis, result.nis_dof,
             result.calibration.scale_sigma, result.calibration.axes_sigma_rad,
             result.calibration.common_error_rad);
  print_triangle(result.relative_covariance);
  fmt::print(stream, ",{}\n", to_string(result.weak));
}

void write_covariances(std::ostream& stream, const RunRecord& record) {
  write_covariances_header(stream);
  for (std::size_t k = 0; k < record.results.size(); ++k)
    write_covariances_row(stream, record.results[k], record.trajectory[k].covariance);
}

std::vector<std::string> stage_names(const RunRecord& record) {
  std::vector<std::string> stages;
  for (const auto& result : record.results) {
    for (const auto& time : result.times) {
      if (std::ranges::find(stages, time.stage) == stages.end()) stages.push_back(time.stage);
    }
  }
  return stages;
}

double stage_ms(const FrameResult& result, const std::string& stage) {
  double ms = 0.0;
  for (const auto& time : result.times) ms += time.stage == stage ? time.ms : 0.0;
  return ms;
}

void write_timing(std::ostream& stream, const RunRecord& record) {
  const auto stages = stage_names(record);
  stream << "frame";
  for (const auto& stage : stages) fmt::print(stream, ",{}_ms", stage);
  fmt::print(stream, ",total_ms,cpu_ms,read_cpu_ms,rss_mb{}\n", record.realtime ? ",latency_ms,dropped" : "");
  for (std::size_t k = 0; k < record.results.size(); ++k) write_timing_row(stream, record, k, stages);
}

void write_timing_row(std::ostream& stream, const RunRecord& record, std::size_t k,
                      const std::vector<std::string>& stages) {
  const auto& result = record.results[k];
  fmt::print(stream, "{}", result.index);
  for (const auto& stage : stages) fmt::print(stream, ",{:.3f}", stage_ms(result, stage));
  fmt::print(stream, ",{:.3f},{:.3f},{:.3f},", record.total_ms[k], record.cpu_ms[k], record.read_cpu_ms[k]);
  if (!std::isnan(record.resident_mb[k])) fmt::print(stream, "{:.1f}", record.resident_mb[k]);
  if (record.realtime) {
    const RealtimeFrame& frame = record.realtime->frames[k];
    fmt::print(stream, ",{:.3f},{}", frame.latency_ms, frame.dropped_ns.size());
  }
  stream << '\n';
}

void write_loops_header(std::ostream& stream) {
  stream << "frame,old_frame,inliers,chi2,verdict,old_map,tx,ty,tz,qx,qy,qz,qw\n";
}

void write_loops_row(std::ostream& stream, const LoopEvent& loop) {
  const Vector3<double> t = loop.T_old_new.translation();
  const antipode::Vector4<double> q = antipode::canonical(loop.T_old_new.rotation());
  fmt::print(stream, "{},{},{},{:.6g},{},{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", loop.frame,
             loop.old_frame, loop.inliers, loop.chi2, loop.accepted ? "accepted" : "refused",
             loop.in_loaded_map ? "loaded" : "run", t[0], t[1], t[2], q[1], q[2], q[3], q[0]);
}

void write_loops(std::ostream& stream, std::span<const LoopEvent> loops) {
  write_loops_header(stream);
  for (const auto& loop : loops) write_loops_row(stream, loop);
}

void write_ply(std::ostream& stream, std::span<const MapPoint> points) {
  fmt::print(stream,
             "ply\nformat binary_{}_endian 1.0\nelement vertex {}\n"
             "property float x\nproperty float y\nproperty float z\n"
             "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
             std::endian::native == std::endian::little ? "little" : "big", points.size());
  for (const auto& point : points) {
    const Vector3<float> position = point.position_world.cast<float>();
    std::array<char, 15> vertex;
    std::memcpy(vertex.data(), position.data(), 12);
    std::fill(vertex.begin() + 12, vertex.end(), static_cast<char>(point.intensity));
    stream.write(vertex.data(), vertex.size());
  }
}

}  // namespace stereo_slam
