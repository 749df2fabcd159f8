// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace stereo_slam::report {

/// A quantity, one value for every x of its chart; NaN where there is none.
struct Series {
  std::string name;
  std::vector<double> values;
};

/// A reference value.
struct Level {
  std::string name;
  double value = 0.0;
};

/// Quantities over a common axis.
struct LineChart {
  std::string title;  ///< of the y axis, with its unit
  std::string x_title;
  std::vector<double> x;       ///< ascending
  std::vector<Series> stack;   ///< stacked areas; means where values outnumber columns
  std::vector<Series> lines;   ///< keep every minimum and maximum
  std::optional<Series> band;  ///< half the width of an area around the first line
  std::optional<Level> level;
  Series marks;           ///< marked positions on the x axis
  bool from_zero = true;  ///< else from the smallest value
};

/// A <figure>: title, legend and SVG. Colours and type are the page's, by the classes of style.hpp.
void write_line_chart(std::ostream& stream, const LineChart& chart);

}  // namespace stereo_slam::report
