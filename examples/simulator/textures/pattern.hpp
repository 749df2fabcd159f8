// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "simulator/textures/random.hpp"

/// Building blocks of texture synthesis. A tile is a grey image around 0.5 that wraps in both directions.
namespace stereo_slam::simulator {

/// Band-limited noise of zero mean and unit standard deviation: octaves from `first_cells` lattice cells a
/// side, each with twice the frequency and `persistence` times the amplitude of the one before.
[[nodiscard]] cv::Mat1f fractal_noise(Random& random, cv::Size size, int first_cells, int octaves,
                                      double persistence);

/// How a tile is covered with shapes that hide each other ("dead leaves"; Lee, Mumford, Huang 2001): radii
/// with density ~ radius^-3 give the scale-invariant edges and corners of natural images.
struct ScatterSettings {
  int count = 1000;
  double min_radius_px = 2.0;
  double max_radius_px = 40.0;
  double low = 0.2;  ///< grey range
  double high = 0.8;
  double roundness = 0.6;  ///< smallest ratio of the axes
  int corners = 0;         ///< 0 draws ellipses, otherwise ragged polygons
  double outline = 0.0;    ///< how much darker the rim is
};
void scatter(cv::Mat1f& tile, Random& random, const ScatterSettings& settings);

/// Thin, branching dark (or bright) lines of a random walk.
struct CrackSettings {
  int count = 20;
  double length_px = 200.0;
  double wander_rad = 0.3;
  int thickness_px = 1;
  double change = -0.25;  ///< added to the grey value
};
void draw_cracks(cv::Mat1f& tile, Random& random, const CrackSettings& settings);

/// Line around a polygon; a thickness of 0 is no line.
struct Rim {
  double grey = 0.0;
  int thickness_px = 0;
};

/// Filled polygon, wrapped around the borders.
void fill_wrapped(cv::Mat1f& tile, const std::vector<cv::Point>& polygon, double grey, const Rim& rim = {});

/// Text of random letters and digits, scaled to fill the rectangle.
void write_text(cv::Mat1f& tile, Random& random, const cv::Rect& area, double grey);

/// 8-bit texture image of a tile whose values are [0, 1].
[[nodiscard]] cv::Mat1b to_bytes(const cv::Mat1f& tile);

/// Shifts and scales the values to the given mean and a standard deviation.
void normalize_tile(cv::Mat1f& tile, double mean, double deviation);

}  // namespace stereo_slam::simulator
