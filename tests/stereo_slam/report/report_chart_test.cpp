// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <sstream>

#include "stereo_slam/report/axis.hpp"
#include "stereo_slam/report/line_chart.hpp"
#include "stereo_slam/report/markup.hpp"
#include "stereo_slam/report/markup_check.hpp"
#include "stereo_slam/report/path_data.hpp"
#include "support/catch.hpp"

using namespace stereo_slam::report;
using stereo_slam::Vector2;
using stereo_slam::test::count_of;
using stereo_slam::test::markup_fault;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string chart_text(const LineChart& chart) {
  std::ostringstream text;
  write_line_chart(text, chart);
  return text.str();
}

LineChart chart_of(std::vector<double> values) {
  LineChart chart;
  chart.title = "Speed, m/s";
  chart.x_title = "frame";
  for (std::size_t i = 0; i < values.size(); ++i) chart.x.push_back(static_cast<double>(i));
  chart.lines = {{"speed", std::move(values)}};
  return chart;
}

}  // namespace

TEST_CASE("Text cannot become markup", "[report]") {
  CHECK(escape_markup(R"(a<b> & "c" 'd')") == "a&lt;b&gt; &amp; &quot;c&quot; &#39;d&#39;");
  CHECK(escape_markup("z\xC3\xBCge\x01\x7f") == "z\xC3\xBCge\xEF\xBF\xBD\xEF\xBF\xBD");
}

TEST_CASE("Ticks are round numbers within the range", "[report]") {
  CHECK(nice_ticks({0.0, 10.0}, 5).values == std::vector<double>{0.0, 2.0, 4.0, 6.0, 8.0, 10.0});
  CHECK(nice_ticks({-1.0, 1.2}, 4).values == std::vector<double>{-1.0, -0.5, 0.0, 0.5, 1.0});
  for (const double scale : {1e-9, 1e-3, 1.0, 37.0, 1e7}) {
    for (const double offset : {0.0, -0.4, 12.3}) {
      CAPTURE(scale, offset);
      const Range range{offset * scale, (offset + 1.0) * scale};
      const Ticks ticks = nice_ticks(range, 5);
      CHECK(ticks.values.size() >= 3);
      CHECK(ticks.values.size() <= 8);
      CHECK(ticks.values.front() >= range.low - 1e-6 * ticks.step);
      CHECK(ticks.values.back() <= range.high + 1e-6 * ticks.step);
    }
  }
}

TEST_CASE("A rounded range begins and ends at ticks", "[report]") {
  const Range range = rounded_out({0.03, 0.97}, 5);
  CHECK(range.low == Approx(0.0).margin(1e-15));
  CHECK(range.high == Approx(1.0));
}

TEST_CASE("A tick has the decimals that its step needs", "[report]") {
  CHECK(tick_label(0.0, 0.5) == "0.0");
  CHECK(tick_label(0.30000000000000004, 0.1) == "0.3");
  CHECK(tick_label(-20.0, 10.0) == "-20");
  CHECK(tick_label(0.05, 0.01) == "0.05");
  CHECK(tick_label(2e6, 1e6) == "2e+06");
}

TEST_CASE("A range ignores values that are not finite and is never empty", "[report]") {
  const auto range = range_of(std::vector<double>{kNaN, 3.0, -kInfinity, 1.0, kInfinity});
  CHECK(range.low == 1.0);
  CHECK(range.high == 3.0);
  for (const std::vector<double>& values : {std::vector<double>{}, {kNaN}, {0.0}, {5.0, 5.0}, {-1e9, -1e9}}) {
    const auto r = range_of(values);
    CHECK(r.low < r.high);
    if (!values.empty() && std::isfinite(values[0])) CHECK((r.low < values[0] && values[0] < r.high));
  }
}

TEST_CASE("Decimation keeps all extremes, the order, and gaps", "[report]") {
  std::vector<double> values;
  for (int i = 0; i < 10'000; ++i) values.push_back(std::sin(0.37 * i));
  values[1234] = 9.0;
  values[5678] = -7.0;
  values[8000] = kNaN;
  const auto kept = decimate(values, 100);
  CHECK(kept.size() <= 300);
  CHECK(std::is_sorted(kept.begin(), kept.end()));
  for (const std::size_t i : {1234U, 5678U, 8000U}) CHECK(std::count(kept.begin(), kept.end(), i) == 1);
}

TEST_CASE("A short series is drawn whole", "[report]") {
  CHECK(decimate(std::vector<double>{1.0, 1.0, kNaN, 1.0}, 2) == std::vector<std::size_t>{0, 1, 2, 3});
  CHECK(decimate({}, 5).empty());
}

TEST_CASE("A path is interrupted at missing points; a single point is a dot", "[report]") {
  const Vector2<double> gap(kNaN, 0.0);
  using Points = std::vector<Vector2<double>>;
  CHECK(path_data(Points{{1, 2}, {3, 4}, gap, {5, 6}, gap, {7, 8}, {9, 10}}) ==
        "M1.0 2.0 3.0 4.0M5.0 6.0h0M7.0 8.0 9.0 10.0");
  CHECK(path_data(Points{gap, gap}).empty());
  CHECK(path_data(Points{}).empty());
}

TEST_CASE("A chart of any values is well-formed and contains no nan or inf", "[report]") {
  for (const std::vector<double>& values : {std::vector<double>{},
                                            {1.0},
                                            {kNaN},
                                            {kNaN, kNaN, 2.0},
                                            {0.0, 0.0},
                                            {kInfinity, 1.0},
                                            {-3.0, 1e12},
                                            {1e-12, 2e-12}}) {
    auto chart = chart_of(values);
    chart.band = Series{"spread", values};
    chart.level = Level{"expected", 1.0};
    chart.marks = {"mark", {0.0}};
    const auto text = chart_text(chart);
    CAPTURE(text);
    CHECK(markup_fault(text).empty());
    CHECK(text.find("nan") == std::string::npos);
    CHECK(text.find("inf") == std::string::npos);
  }
}

TEST_CASE("A long series takes at most a few kilobytes", "[report]") {
  std::vector<double> values(100'000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = std::sin(static_cast<double>(i));
  CHECK(chart_text(chart_of(values)).size() < 12'000);
}

TEST_CASE("Areas of a stack lie on top of each other and keep the means of the values", "[report]") {
  LineChart chart;
  chart.x = {0.0, 1.0};
  chart.stack = {{"a", {1.0, 3.0}}, {"b", {kNaN, 1.0}}};
  const auto text = chart_text(chart);
  // 0 to 4 on 198 units from 208 upwards: a ends at 1 and 3, b at 1 and 4.
  CHECK_THAT(
      text, Catch::Contains(R"(<path class="area c0" d="M54.0 208.0 528.0 208.0 528.0 59.5 54.0 158.5Z"/>)"));
  CHECK_THAT(text,
             Catch::Contains(R"(<path class="area c1" d="M54.0 158.5 528.0 59.5 528.0 10.0 54.0 158.5Z"/>)"));
}

TEST_CASE("Names in a chart are escaped", "[report]") {
  auto chart = chart_of({1.0, 2.0});
  chart.lines[0].name = chart.title = chart.x_title = "<b>\"";
  const auto text = chart_text(chart);
  CHECK(text.find("<b>") == std::string::npos);
  CHECK(count_of(text, "&lt;b&gt;&quot;") == 4);
}
