// SPDX-License-Identifier: MIT
#include "stereo_slam/report/report.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/report/line_chart.hpp"
#include "stereo_slam/report/markup.hpp"
#include "stereo_slam/report/run_charts.hpp"
#include "stereo_slam/report/style.hpp"
#include "stereo_slam/report/top_view.hpp"
#include "stereo_slam/report/trajectory_geometry.hpp"

namespace stereo_slam::report {
namespace {

constexpr std::string_view kPathNote =
    "The path seen from above; the first camera looks up the page. A ring marks a frame that closed a loop; "
    "a line joins it to "
    "the earlier place. An ellipse is one standard deviation of the position: 39 % of the true positions "
    "should lie inside it, "
    "and 86 % inside an ellipse twice as large.";
constexpr std::string_view kPositionNote =
    "Standard deviation of each final position relative to the first frame, along the camera's axes. It "
    "grows with the path "
    "length and the distance from the start, and falls where a loop connects the path to an earlier place.";
constexpr std::string_view kRotationNote =
    "Standard deviation of each final orientation relative to the first frame, about the camera's axes.";
constexpr std::string_view kHeightNote =
    "Height above the first camera, along its vertical axis. If the first camera was tilted by one degree, a "
    "level road rises "
    "or falls by 1.7 m in 100 m.";
constexpr std::string_view kInnovationNote =
    "Normalised innovation squared (NIS): the squared distance of the measured points from their "
    "predictions, relative to the "
    "assumed noise. It is about 1 if the noise is as assumed and lower if the noise is smaller. Values far "
    "above 1 mean moving "
    "objects, blur or a wrong calibration.";
constexpr std::string_view kCountNote =
    "Corners found in the left image, landmarks that the filter holds, and landmarks matched in the frame. "
    "With few matches "
    "the pose follows from the odometry alone.";
constexpr std::string_view kTimeNote =
    "Processing time of each frame without reading its images. Areas are means over neighbouring frames; the "
    "line shows every "
    "minimum and maximum.";
constexpr std::string_view kMemoryNote =
    "Physical memory of the program after each frame. It grows with the map and the keyframes.";
constexpr std::string_view kLoopsNote =
    "A loop connects a frame to an earlier one at the same place. Chi2 is its squared Mahalanobis distance "
    "from the prediction; "
    "a loop above the threshold is refused and changes nothing.";

void write_fact(std::ostream& stream, std::string_view name, const std::string& value,
                const std::string& more = "", std::string_view css_class = "") {
  fmt::print(stream, "<div><dt>{}</dt><dd{}>{}{}</dd></div>\n", name,
             css_class.empty() ? "" : fmt::format(" class=\"{}\"", css_class), escape_markup(value),
             more.empty() ? "" : fmt::format("<small>{}</small>", escape_markup(more)));
}

[[nodiscard]] std::size_t frames_of(const RunRecord& record, TrackingStatus status) {
  return count_frames(record, [&](const FrameResult& result) { return result.status == status; });
}

[[nodiscard]] std::string memory_detail(const RunHeader& header) {
  if (header.bytes_per_keyframe == 0) return "";
  return fmt::format("{:.0f} kB per keyframe", 1e-3 * static_cast<double>(header.bytes_per_keyframe));
}

[[nodiscard]] std::string length_text(double length_m) {
  return length_m < 1000.0 ? fmt::format("{:.1f} m", length_m) : fmt::format("{:.2f} km", 1e-3 * length_m);
}

void write_facts(std::ostream& stream, const RunRecord& record, const RunInfo& info) {
  const auto accepted = static_cast<std::size_t>(std::count_if(
      record.loops.begin(), record.loops.end(), [](const LoopEvent& loop) { return loop.accepted; }));
  const auto keyframes = count_frames(record, &FrameResult::is_keyframe);
  const auto lengths_m = path_lengths(record.trajectory);
  stream << "<dl class=\"facts\">\n";
  write_fact(stream, "State", info.header.state, "", info.header.state);
  write_fact(stream, "Frames", fmt::format("{}", record.results.size()),
             fmt::format("{} lost, {} weak", frames_of(record, TrackingStatus::kLost),
                         frames_of(record, TrackingStatus::kWeak)));
  write_fact(stream, "Path length", length_text(lengths_m.empty() ? 0.0 : lengths_m.back()));
  write_fact(stream, "Time per frame", fmt::format("{:.1f} ms", median(record.total_ms)),
             fmt::format("median; {:.1f} s in total", info.header.seconds));
  write_fact(stream, "Loops", fmt::format("{}", accepted),
             fmt::format("{} refused", record.loops.size() - accepted));
  write_fact(stream, "Landmarks", fmt::format("{}", record.map_points.size()),
             fmt::format("{} keyframes", keyframes));
  write_fact(stream, "Memory",
             std::isnan(info.header.peak_mb) ? "unknown" : fmt::format("{:.0f} MB", info.header.peak_mb),
             memory_detail(info.header));
  write_fact(stream, "Preset", info.preset);
  stream << "</dl>\n";
}

void write_header(std::ostream& stream, const RunRecord& record, const RunInfo& info) {
  const auto name = std::filesystem::path(info.dataset).filename().string();
  fmt::print(stream, "<header>\n<h1>{}</h1>\n<p>{}</p>\n", escape_markup(name.empty() ? info.dataset : name),
             escape_markup(info.dataset));
  if (!info.header.error.empty())
    fmt::print(stream, "<p class=\"error\">{}</p>\n", escape_markup(info.header.error));
  write_facts(stream, record, info);
  stream << "</header>\n";
}

void write_chart_section(std::ostream& stream, const LineChart& chart, std::string_view note) {
  stream << "<section>\n";
  write_line_chart(stream, chart);
  fmt::print(stream, "<p>{}</p>\n</section>\n", note);
}

void write_loop_table(std::ostream& stream, const std::vector<LoopEvent>& loops) {
  stream << "<section>\n<h3>Loops</h3>\n";
  if (loops.empty()) {
    stream << "<p class=\"empty\">None.</p>\n";
  } else {
    stream << "<div class=\"scroll\"><table>\n<tr><th>frame</th><th>earlier "
              "frame</th><th>inliers</th><th>chi2</th>"
              "<th>verdict</th></tr>\n";
    for (const auto& loop : loops) {
      fmt::print(stream, "<tr><td>{}</td><td>{}{}</td><td>{}</td><td>{:.1f}</td><td{}>{}</td></tr>\n",
                 loop.frame, loop.old_frame, loop.in_loaded_map ? " of the loaded map" : "", loop.inliers,
                 loop.chi2, loop.accepted ? "" : " class=\"refused\"",
                 loop.accepted ? "accepted" : "refused");
    }
    stream << "</table></div>\n";
  }
  fmt::print(stream, "<p>{}</p>\n</section>\n", kLoopsNote);
}

}  // namespace

void write_report(std::ostream& stream, const RunRecord& record, const RunInfo& info) {
  fmt::print(stream,
             "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
             "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
             "<title>stereo_slam: {}</title>\n<style>{}</style>\n</head>\n<body>\n",
             escape_markup(info.dataset), kStyle);
  write_header(stream, record, info);
  stream << "<main>\n<section class=\"wide\">\n";
  write_top_view(stream, record);
  fmt::print(stream, "<p>{}</p>\n</section>\n", kPathNote);
  write_chart_section(stream, position_sigma_chart(record), kPositionNote);
  write_chart_section(stream, rotation_sigma_chart(record), kRotationNote);
  write_chart_section(stream, height_chart(record), kHeightNote);
  write_chart_section(stream, innovation_chart(record), kInnovationNote);
  write_chart_section(stream, count_chart(record), kCountNote);
  write_chart_section(stream, time_chart(record), kTimeNote);
  write_chart_section(stream, memory_chart(record), kMemoryNote);
  write_loop_table(stream, record.loops);
  fmt::print(
      stream,
      "</main>\n<footer>Written by stereo_slam {}. All numbers are in the files beside this one; run.yaml "
      "contains all settings.</footer>\n</body>\n</html>\n",
      STEREO_SLAM_VERSION);
}

}  // namespace stereo_slam::report
