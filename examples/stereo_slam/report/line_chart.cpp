// SPDX-License-Identifier: MIT
#include "stereo_slam/report/line_chart.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/report/axis.hpp"
#include "stereo_slam/report/markup.hpp"
#include "stereo_slam/report/path_data.hpp"

namespace stereo_slam::report {
namespace {

constexpr double kWidth_px = 540.0;
constexpr double kHeight_px = 256.0;
constexpr double kLeft_px = 54.0;
constexpr double kRight_px = 12.0;
constexpr double kTop_px = 10.0;
constexpr double kBottom_px = 48.0;
constexpr int kTicks = 5;
constexpr std::size_t kColumns = 300;  // of values

using Points = std::vector<Vector2<double>>;

/// Colour class of a series; the style sheet has eight.
[[nodiscard]] std::string colour_class(std::size_t series) { return fmt::format("c{}", series % 8); }

/// Position of the chart's data in the image.
struct Frame {
  Axis x;
  Axis y;
};

/// Sums of the first 0, 1 ... all series of the stack, averaged over columns, and x of the columns.
struct StackedColumns {
  std::vector<double> x;
  std::vector<std::vector<double>> sums;
};

[[nodiscard]] double mean_of(const std::vector<double>& values, std::size_t first, std::size_t last) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = first; i < last; ++i) {
    if (!std::isfinite(values[i])) continue;
    sum += values[i];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

[[nodiscard]] StackedColumns stacked(const LineChart& chart) {
  const std::size_t columns = std::min(kColumns, chart.x.size());
  StackedColumns result{.x = {}, .sums = {std::vector<double>(columns, 0.0)}};
  const auto begin_of = [&](std::size_t column) { return column * chart.x.size() / columns; };
  for (std::size_t c = 0; c < columns; ++c)
    result.x.push_back(0.5 * (chart.x[begin_of(c)] + chart.x[begin_of(c + 1) - 1]));
  for (const auto& series : chart.stack) {
    auto sum = result.sums.back();
    for (std::size_t c = 0; c < columns; ++c) sum[c] += mean_of(series.values, begin_of(c), begin_of(c + 1));
    result.sums.push_back(std::move(sum));
  }
  return result;
}

/// All values that the y axis must cover.
[[nodiscard]] std::vector<double> extreme_values(const LineChart& chart) {
  std::vector<double> values;
  if (chart.from_zero) values.push_back(0.0);
  if (chart.level) values.push_back(chart.level->value);
  for (const auto& line : chart.lines) values.insert(values.end(), line.values.begin(), line.values.end());
  if (chart.band) {
    for (std::size_t i = 0; i < chart.band->values.size(); ++i) {
      const double half = std::isfinite(chart.band->values[i]) ? chart.band->values[i] : 0.0;
      for (const double sign : {-1.0, 1.0}) values.push_back(chart.lines.front().values[i] + sign * half);
    }
  }
  if (!chart.stack.empty()) {
    const auto top = stacked(chart).sums.back();
    values.insert(values.end(), top.begin(), top.end());
  }
  return values;
}

[[nodiscard]] Frame frame_of(const LineChart& chart) {
  return {{range_of(chart.x), kLeft_px, kWidth_px - kRight_px},
          {rounded_out(range_of(extreme_values(chart)), kTicks), kHeight_px - kBottom_px, kTop_px}};
}

void write_grid(std::ostream& stream, const LineChart& chart, const Frame& frame) {
  const Ticks rows = nice_ticks(frame.y.range, kTicks);
  for (const double value : rows.values) {
    const double y = frame.y.to_px(value);
    fmt::print(stream, R"(<path class="grid" d="M{:.1f} {:.1f}H{:.1f}"/>)", frame.x.low_px, y,
               frame.x.high_px);
    fmt::print(stream, R"(<text class="end" x="{:.1f}" y="{:.1f}" dy=".35em">{}</text>)",
               frame.x.low_px - 7.0, y, tick_label(value, rows.step));
  }
  const Ticks columns = nice_ticks(frame.x.range, kTicks);
  for (const double value : columns.values) {
    const double x = frame.x.to_px(value);
    fmt::print(stream, R"(<path class="grid" d="M{:.1f} {:.1f}v4"/>)", x, frame.y.low_px);
    fmt::print(stream, R"(<text class="middle" x="{:.1f}" y="{:.1f}" dy="1.15em">{}</text>)", x,
               frame.y.low_px + 4.0, tick_label(value, columns.step));
  }
  fmt::print(stream, R"(<text class="end" x="{:.1f}" y="{:.1f}">{}</text>)", frame.x.high_px,
             kHeight_px - 4.0, escape_markup(chart.x_title));
  stream << '\n';
}

[[nodiscard]] Points points_of(std::span<const double> x, std::span<const double> y, const Frame& frame) {
  Points points;
  for (const std::size_t i : decimate(y, kColumns))
    points.emplace_back(frame.x.to_px(x[i]), frame.y.to_px(y[i]));
  return points;
}

/// The area between two curves, as one closed path.
void write_area(std::ostream& stream, const std::string& css_class, Points there, const Points& back) {
  there.insert(there.end(), back.rbegin(), back.rend());
  fmt::print(stream, R"(<path class="{}" d="{}Z"/>)", css_class, path_data(there));
  stream << '\n';
}

void write_stack(std::ostream& stream, const LineChart& chart, const Frame& frame) {
  if (chart.stack.empty()) return;
  const auto columns = stacked(chart);
  const auto curve = [&](std::size_t k) { return points_of(columns.x, columns.sums[k], frame); };
  for (std::size_t k = 0; k < chart.stack.size(); ++k)
    write_area(stream, "area " + colour_class(k), curve(k), curve(k + 1));
}

/// The band has the columns at which the line has its smallest and largest values.
void write_band(std::ostream& stream, const LineChart& chart, const Frame& frame) {
  if (!chart.band) return;
  const auto& middle = chart.lines.front().values;
  Points upper, lower;
  for (const std::size_t i : decimate(middle, kColumns)) {
    const double half = chart.band->values[i];
    if (!std::isfinite(middle[i]) || !std::isfinite(half)) continue;
    upper.emplace_back(frame.x.to_px(chart.x[i]), frame.y.to_px(middle[i] + half));
    lower.emplace_back(frame.x.to_px(chart.x[i]), frame.y.to_px(middle[i] - half));
  }
  write_area(stream, "band c0", std::move(upper), lower);
}

void write_lines(std::ostream& stream, const LineChart& chart, const Frame& frame) {
  for (std::size_t k = 0; k < chart.lines.size(); ++k) {
    fmt::print(stream, R"(<path class="line {}" d="{}"/>)", chart.stack.empty() ? colour_class(k) : "ink",
               path_data(points_of(chart.x, chart.lines[k].values, frame)));
    stream << '\n';
  }
  if (chart.level) {
    fmt::print(stream, R"(<path class="level" d="M{:.1f} {:.1f}H{:.1f}"/>)", frame.x.low_px,
               frame.y.to_px(chart.level->value), frame.x.high_px);
  }
}

void write_marks(std::ostream& stream, const LineChart& chart, const Frame& frame) {
  if (chart.marks.values.empty()) return;
  stream << R"(<path class="mark" d=")";
  for (const double x : chart.marks.values)
    fmt::print(stream, "M{:.1f} {:.1f}v-7", frame.x.to_px(x), frame.y.low_px);
  stream << "\"/>\n";
}

void write_legend(std::ostream& stream, const LineChart& chart) {
  stream << "<ul class=\"legend\">";
  const auto entry = [&](const std::string& css_class, const std::string& name) {
    fmt::print(stream, R"(<li><i class="{}"></i>{}</li>)", css_class, escape_markup(name));
  };
  for (std::size_t k = 0; k < chart.stack.size(); ++k) entry(colour_class(k), chart.stack[k].name);
  for (std::size_t k = 0; k < chart.lines.size(); ++k)
    entry(chart.stack.empty() ? colour_class(k) : "ink", chart.lines[k].name);
  if (chart.band) entry("c0 faint", chart.band->name);
  if (chart.level) entry("level", chart.level->name);
  if (!chart.marks.values.empty()) entry("mark", chart.marks.name);
  stream << "</ul>\n";
}

}  // namespace

void write_line_chart(std::ostream& stream, const LineChart& chart) {
  const std::string title = escape_markup(chart.title);
  fmt::print(stream, "<figure>\n<h3>{}</h3>\n", title);
  if (chart.x.empty()) {
    stream << "<p class=\"empty\">No frames.</p>\n</figure>\n";
    return;
  }
  const Frame frame = frame_of(chart);
  write_legend(stream, chart);
  fmt::print(stream, "<svg viewBox=\"0 0 {:g} {:g}\" role=\"img\" aria-label=\"{}\">\n", kWidth_px,
             kHeight_px, title);
  write_grid(stream, chart, frame);
  write_stack(stream, chart, frame);
  write_band(stream, chart, frame);
  write_lines(stream, chart, frame);
  write_marks(stream, chart, frame);
  stream << "</svg>\n</figure>\n";
}

}  // namespace stereo_slam::report
