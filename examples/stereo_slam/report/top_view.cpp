// SPDX-License-Identifier: MIT
#include "stereo_slam/report/top_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/report/axis.hpp"
#include "stereo_slam/report/path_data.hpp"
#include "stereo_slam/report/trajectory_geometry.hpp"

namespace stereo_slam::report {
namespace {

constexpr double kWidth_px = 760.0;
constexpr double kLeast_px = 280.0;  // of height
constexpr double kMost_px = 520.0;
constexpr double kLeft_px = 50.0;
constexpr double kRight_px = 8.0;
constexpr double kTop_px = 8.0;
constexpr double kBottom_px = 28.0;
constexpr std::size_t kMostLandmarks = 12000;
constexpr double kLandmark_px = 1.5;  // one is drawn in a square of this size
constexpr std::size_t kEllipses = 24;
constexpr double kLargestEllipse_px = 22.0;

using Points = std::vector<Vector2<double>>;

[[nodiscard]] Vector2<double> gap() {
  return Vector2<double>::Constant(std::numeric_limits<double>::quiet_NaN());
}

/// The plane of the image, with equal scales of both axes.
struct View {
  Axis x;
  Axis z;
  double height_px = 0.0;

  [[nodiscard]] Vector2<double> to_px(const Vector3<double>& p_world) const {
    return {x.to_px(p_world.x()), z.to_px(p_world.z())};
  }
  [[nodiscard]] double px_per_m() const { return (x.high_px - x.low_px) / (x.range.high - x.range.low); }
  [[nodiscard]] bool holds(const Vector2<double>& p_px) const {
    return p_px.x() > x.low_px && p_px.x() < x.high_px && p_px.y() > z.high_px && p_px.y() < z.low_px;
  }
};

/// Positions of the final path and of the path without loop closure.
struct Paths {
  std::vector<Vector3<double>> final;
  std::vector<Vector3<double>> without_loops;  ///< empty if no loop was accepted, or one with a loaded map
};

[[nodiscard]] Paths paths_of(const RunRecord& record) {
  Paths paths;
  for (const auto& estimate : record.trajectory) paths.final.push_back(estimate.pose.translation());
  const auto& loops = record.loops;
  if (std::any_of(loops.begin(), loops.end(), [](auto& loop) { return loop.accepted; }) &&
      std::none_of(loops.begin(), loops.end(), [](auto& loop) { return loop.in_loaded_map; })) {
    for (const auto& result : record.results)
      paths.without_loops.push_back(result.T_odometry_camera.translation());
  }
  return paths;
}

/// The range with the same centre and another length.
[[nodiscard]] Range stretched(const Range& range, double length) {
  const double centre = 0.5 * (range.low + range.high);
  return {centre - 0.5 * length, centre + 0.5 * length};
}

[[nodiscard]] View view_of(const Paths& paths) {
  std::vector<double> x, z;
  for (const auto* path : {&paths.final, &paths.without_loops}) {
    for (const auto& p : *path) {
      x.push_back(p.x());
      z.push_back(p.z());
    }
  }
  const Range across = range_of(x);
  const Range along = range_of(z);
  const double margin_m = std::max(0.07 * std::max(across.high - across.low, along.high - along.low), 2.0);
  const double width_m = across.high - across.low + 2.0 * margin_m;
  const double depth_m = along.high - along.low + 2.0 * margin_m;
  const double width_px = kWidth_px - kLeft_px - kRight_px;
  const double depth_px = std::clamp(width_px * depth_m / width_m, kLeast_px, kMost_px);
  const double px_per_m = std::min(width_px / width_m, depth_px / depth_m);
  return {{stretched(across, width_px / px_per_m), kLeft_px, kWidth_px - kRight_px},
          {stretched(along, depth_px / px_per_m), kTop_px + depth_px, kTop_px},
          kTop_px + depth_px + kBottom_px};
}

void write_grid(std::ostream& stream, const View& view) {
  constexpr double kSpacing_px = 95.0;
  const Ticks x = nice_ticks(view.x.range, (view.x.high_px - view.x.low_px) / kSpacing_px);
  const Ticks z = nice_ticks(view.z.range, (view.z.range.high - view.z.range.low) / x.step);
  for (const double value : x.values) {
    const double at = view.x.to_px(value);
    fmt::print(stream, R"(<path class="grid" d="M{:.1f} {:.1f}V{:.1f}"/>)", at, view.z.low_px,
               view.z.high_px);
    fmt::print(stream, R"(<text class="middle" x="{:.1f}" y="{:.1f}" dy="1.2em">{}</text>)", at,
               view.z.low_px, tick_label(value, x.step));
  }
  for (const double value : z.values) {
    const double at = view.z.to_px(value);
    fmt::print(stream, R"(<path class="grid" d="M{:.1f} {:.1f}H{:.1f}"/>)", view.x.low_px, at,
               view.x.high_px);
    fmt::print(stream, R"(<text class="end" x="{:.1f}" y="{:.1f}" dy=".35em">{}</text>)", view.x.low_px - 6.0,
               at, tick_label(value, z.step));
  }
  stream << '\n';
}

/// One dot per grid cell that contains a landmark; thinned out evenly if there are very many.
void write_landmarks(std::ostream& stream, const View& view, const std::vector<MapPoint>& landmarks) {
  std::vector<std::pair<int, int>> squares;
  for (const auto& landmark : landmarks) {
    const Vector2<double> p = view.to_px(landmark.position_world);
    if (view.holds(p))
      squares.emplace_back(static_cast<int>(p.y() / kLandmark_px), static_cast<int>(p.x() / kLandmark_px));
  }
  std::sort(squares.begin(), squares.end());
  squares.erase(std::unique(squares.begin(), squares.end()), squares.end());
  const std::size_t step = squares.size() / kMostLandmarks + 1;
  stream << R"(<path class="landmarks" d=")";
  for (std::size_t i = 0; i < squares.size(); i += step)
    fmt::print(stream, "M{:g} {:g}h0", kLandmark_px * squares[i].second, kLandmark_px * squares[i].first);
  stream << "\"/>\n";
}

[[nodiscard]] Points to_px(const std::vector<Vector3<double>>& path, const View& view) {
  Points points;
  for (const auto& p : path) points.push_back(view.to_px(p));
  return points;
}

/// Frames that suffice to draw a path: those where the status changes, and one per pixel of the others.
[[nodiscard]] std::vector<std::size_t> thinned(const Points& path, const std::vector<FrameResult>& results) {
  constexpr double kStep_px = 0.7;
  std::vector<std::size_t> kept;
  for (std::size_t k = 0; k < path.size(); ++k) {
    const bool ends = k == 0 || k + 1 == path.size() || results[k].status != results[k + 1].status;
    if (ends || !((path[k] - path[kept.back()]).norm() < kStep_px)) kept.push_back(k);
  }
  return kept;
}

/// Path segments that end in a frame of this status.
[[nodiscard]] Points steps_with(TrackingStatus status, const Points& path,
                                const std::vector<std::size_t>& kept,
                                const std::vector<FrameResult>& results) {
  Points points;
  for (std::size_t i = 1; i < kept.size(); ++i) {
    if (results[kept[i]].status != status) continue;
    if (i == 1 || results[kept[i - 1]].status != status) {
      points.push_back(gap());
      points.push_back(path[kept[i - 1]]);
    }
    points.push_back(path[kept[i]]);
  }
  return points;
}

/// Name of a status in the legend and in the style sheet.
struct StatusStyle {
  TrackingStatus status;
  const char* css_class;
  const char* name;
};

constexpr std::array<StatusStyle, 5> kStatusStyles = {
    {{TrackingStatus::kInitializing, "initializing", "initialising"},
     {TrackingStatus::kOk, "ok", "tracked"},
     {TrackingStatus::kWeak, "weak", "weak: odometry only, or position in the map uncertain"},
     {TrackingStatus::kLost, "lost", "lost: predicted only"},
     {TrackingStatus::kRelocalised, "relocalised", "relocalised"}}};

void write_paths(std::ostream& stream, const View& view, const Paths& paths, const RunRecord& record) {
  const Points without_loops = to_px(paths.without_loops, view);
  Points dashed;
  for (const std::size_t k : thinned(without_loops, record.results)) dashed.push_back(without_loops[k]);
  if (!dashed.empty())
    fmt::print(stream, "<path class=\"track uncorrected\" d=\"{}\"/>\n", path_data(dashed));
  const Points path = to_px(paths.final, view);
  const auto kept = thinned(path, record.results);
  for (const auto& style : kStatusStyles) {
    const Points steps = steps_with(style.status, path, kept, record.results);
    if (!steps.empty())
      fmt::print(stream, "<path class=\"track {}\" d=\"{}\"/>\n", style.css_class, path_data(steps));
  }
}

/// An ellipse and its centre.
struct PlacedEllipse {
  Vector2<double> centre_px;
  SigmaEllipse sigma;
};

/// Ellipses at equal distances along the path.
[[nodiscard]] std::vector<PlacedEllipse> ellipses_of(const RunRecord& record, const Paths& paths,
                                                     const View& view) {
  const auto length_m = path_lengths(record.trajectory);
  std::vector<PlacedEllipse> ellipses;
  for (std::size_t k = 0; k < paths.final.size() && ellipses.size() < kEllipses; ++k) {
    const double due_m = static_cast<double>(ellipses.size() + 1) / kEllipses * length_m.back();
    if (length_m[k] < due_m * (1.0 - 1e-12) || !record.trajectory[k].covariance.allFinite()) continue;
    ellipses.push_back({view.to_px(paths.final[k]), sigma_ellipse(record.trajectory[k])});
  }
  return ellipses;
}

/// A round factor that enlarges the ellipses and keeps them small in the image; at least one.
[[nodiscard]] double magnification(const std::vector<PlacedEllipse>& ellipses, double px_per_m) {
  double largest_px = 0.0;
  for (const auto& ellipse : ellipses)
    largest_px = std::max(largest_px, px_per_m * ellipse.sigma.half_axes_m.x());
  double best = 1.0;
  for (const double factor : {2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0})
    if (factor * largest_px <= kLargestEllipse_px) best = factor;
  return best;
}

void write_ellipses(std::ostream& stream, const std::vector<PlacedEllipse>& ellipses, double px_per_sigma_m) {
  for (const auto& ellipse : ellipses) {
    fmt::print(
        stream,
        R"svg(<ellipse class="sigma" rx="{:.1f}" ry="{:.1f}" transform="translate({:.1f} {:.1f})rotate({:.0f})"/>)svg",
        px_per_sigma_m * ellipse.sigma.half_axes_m.x(), px_per_sigma_m * ellipse.sigma.half_axes_m.y(),
        ellipse.centre_px.x(), ellipse.centre_px.y(), -ellipse.sigma.angle_rad * 180.0 / std::numbers::pi);
  }
  stream << '\n';
}

void write_loops(std::ostream& stream, const View& view, const RunRecord& record) {
  for (const auto& loop : record.loops) {
    if (loop.in_loaded_map || std::max(loop.frame, loop.old_frame) >= record.trajectory.size()) continue;
    const auto now = view.to_px(record.trajectory[loop.frame].pose.translation());
    const auto then = view.to_px(record.trajectory[loop.old_frame].pose.translation());
    fmt::print(
        stream,
        R"(<g class="loop{}"><title>frame {} closes a loop with frame {}: {}</title><path d="M{:.1f} {:.1f}L{:.1f} {:.1f}"/>)"
        R"(<circle cx="{:.1f}" cy="{:.1f}" r="3"/></g>)",
        loop.accepted ? "" : " refused", loop.frame, loop.old_frame, loop.accepted ? "accepted" : "refused",
        now.x(), now.y(), then.x(), then.y(), now.x(), now.y());
    stream << '\n';
  }
}

/// A disc at the start of the path and a square at its end.
void write_ends(std::ostream& stream, const View& view, const Paths& paths) {
  const auto first = view.to_px(paths.final.front());
  const auto last = view.to_px(paths.final.back());
  fmt::print(stream, R"(<circle class="end-mark" cx="{:.1f}" cy="{:.1f}" r="4.5"/>)", first.x(), first.y());
  fmt::print(stream, "<rect class=\"end-mark\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"8\" height=\"8\"/>\n",
             last.x() - 4.0, last.y() - 4.0);
}

void write_legend(std::ostream& stream, const RunRecord& record, double factor) {
  const auto entry = [&](std::string_view css_class, std::string_view name) {
    fmt::print(stream, R"(<li><i class="{}"></i>{}</li>)", css_class, name);
  };
  const auto any_loop = [&](bool accepted) {
    return std::any_of(record.loops.begin(), record.loops.end(),
                       [&](const LoopEvent& loop) { return loop.accepted == accepted; });
  };
  stream << "<ul class=\"legend\">";
  for (const auto& style : kStatusStyles) {
    const bool present =
        std::any_of(record.results.begin(), record.results.end(),
                    [&](const FrameResult& result) { return result.status == style.status; });
    if (present && style.status != TrackingStatus::kInitializing) entry(style.css_class, style.name);
  }
  entry("disc", "start");
  entry("square", "end");
  if (any_loop(true)) entry("uncorrected", "without loop closure");
  if (any_loop(true)) entry("ring", "loop");
  if (any_loop(false)) entry("ring refused", "refused loop");
  entry("sigma", factor > 1.0 ? fmt::format("1 sigma, enlarged {:g} times", factor) : "1 sigma");
  entry("dot", "landmarks");
  stream << "</ul>\n";
}

}  // namespace

void write_top_view(std::ostream& stream, const RunRecord& record) {
  stream << "<figure class=\"top-view\">\n<h3>Path from above, m</h3>\n";
  if (record.trajectory.empty()) {
    stream << "<p class=\"empty\">No frames.</p>\n</figure>\n";
    return;
  }
  const Paths paths = paths_of(record);
  const View view = view_of(paths);
  const auto ellipses = ellipses_of(record, paths, view);
  const double factor = magnification(ellipses, view.px_per_m());
  write_legend(stream, record, factor);
  fmt::print(stream, "<svg viewBox=\"0 0 {:g} {:.0f}\" role=\"img\" aria-label=\"Path from above\">\n",
             kWidth_px, view.height_px);
  write_grid(stream, view);
  write_landmarks(stream, view, record.map_points);
  write_ellipses(stream, ellipses, factor * view.px_per_m());
  write_paths(stream, view, paths, record);
  write_loops(stream, view, record);
  write_ends(stream, view, paths);
  stream << "</svg>\n</figure>\n";
}

}  // namespace stereo_slam::report
