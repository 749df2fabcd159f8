// SPDX-License-Identifier: MIT
#include "simulator/textures/pattern.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace stereo_slam::simulator {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Interpolation of one pixel between two lattice nodes.
struct Lerp {
  int first = 0;
  int second = 0;
  float weight = 0.0F;
};

[[nodiscard]] std::vector<Lerp> lattice_weights(int pixels, int cells) {
  std::vector<Lerp> weights;
  for (int i = 0; i < pixels; ++i) {
    const double position = static_cast<double>(i) * cells / pixels;
    const int cell = static_cast<int>(position);
    const double t = position - cell;
    weights.push_back({cell % cells, (cell + 1) % cells, static_cast<float>(t * t * (3.0 - 2.0 * t))});
  }
  return weights;
}

void add_octave(cv::Mat1f& tile, Random& random, int cells, float amplitude) {
  cv::Mat1f lattice(cells, cells);
  for (float& node : lattice) node = amplitude * static_cast<float>(random.uniform(-1.0, 1.0));
  const auto columns = lattice_weights(tile.cols, cells);
  const auto rows = lattice_weights(tile.rows, cells);
  std::vector<float> line(static_cast<std::size_t>(cells));
  for (int y = 0; y < tile.rows; ++y) {
    const Lerp& row = rows[static_cast<std::size_t>(y)];
    for (int i = 0; i < cells; ++i) {
      const float first = lattice(row.first, i);
      line[static_cast<std::size_t>(i)] = first + row.weight * (lattice(row.second, i) - first);
    }
    for (int x = 0; x < tile.cols; ++x) {
      const Lerp& column = columns[static_cast<std::size_t>(x)];
      const float first = line[static_cast<std::size_t>(column.first)];
      tile(y, x) += first + column.weight * (line[static_cast<std::size_t>(column.second)] - first);
    }
  }
}

/// Calls draw(offset) for each copy of a shape, shifted by whole tiles, that is visible in a wrapping tile.
template <class Draw>
void for_each_copy(const cv::Mat1f& tile, const cv::Rect& bounds, Draw draw) {
  const cv::Rect whole(0, 0, tile.cols, tile.rows);
  for (const int dy : {-tile.rows, 0, tile.rows}) {
    for (const int dx : {-tile.cols, 0, tile.cols}) {
      const cv::Point offset(dx, dy);
      if (((bounds + offset) & whole).area() > 0) draw(offset);
    }
  }
}

[[nodiscard]] std::vector<cv::Point> ragged_polygon(Random& random, cv::Point2d centre, double radius,
                                                    const ScatterSettings& settings) {
  const double angle = random.uniform(0.0, kTurn);
  const double flattening = random.uniform(settings.roundness, 1.0);
  const int corners = settings.corners > 0 ? settings.corners : std::clamp(static_cast<int>(radius), 6, 16);
  std::vector<cv::Point> polygon;
  for (int i = 0; i < corners; ++i) {
    const double jitter = settings.corners > 0 ? random.uniform(0.7, 1.2) : 1.0;
    const double phase = kTurn * i / corners;
    const double a = radius * jitter * std::cos(phase);
    const double b = radius * jitter * flattening * std::sin(phase);
    polygon.emplace_back(cvRound(centre.x + std::cos(angle) * a - std::sin(angle) * b),
                         cvRound(centre.y + std::sin(angle) * a + std::cos(angle) * b));
  }
  return polygon;
}

/// Anywhere on the tile. The order of the two draws is fixed, as that of a function's arguments is not.
[[nodiscard]] cv::Point2d random_point(const cv::Mat1f& tile, Random& random) {
  const double y = random.uniform(0.0, tile.rows);
  const double x = random.uniform(0.0, tile.cols);
  return {x, y};
}

}  // namespace

cv::Mat1f fractal_noise(Random& random, cv::Size size, int first_cells, int octaves, double persistence) {
  cv::Mat1f tile = cv::Mat1f::zeros(size);
  double amplitude = 1.0;
  int cells = first_cells;
  for (int octave = 0; octave < octaves && cells <= std::min(size.width, size.height); ++octave) {
    add_octave(tile, random, cells, static_cast<float>(amplitude));
    amplitude *= persistence;
    cells *= 2;
  }
  normalize_tile(tile, 0.0, 1.0);
  return tile;
}

void fill_wrapped(cv::Mat1f& tile, const std::vector<cv::Point>& polygon, double grey, const Rim& rim) {
  for_each_copy(tile, cv::boundingRect(polygon), [&](cv::Point offset) {
    std::vector<std::vector<cv::Point>> copy{polygon};
    for (cv::Point& point : copy.front()) point += offset;
    cv::fillPoly(tile, copy, cv::Scalar(grey));
    if (rim.thickness_px > 0) cv::polylines(tile, copy, true, cv::Scalar(rim.grey), rim.thickness_px);
  });
}

void scatter(cv::Mat1f& tile, Random& random, const ScatterSettings& settings) {
  const double a = 1.0 / (settings.min_radius_px * settings.min_radius_px);
  const double b = 1.0 / (settings.max_radius_px * settings.max_radius_px);
  for (int i = 0; i < settings.count; ++i) {
    const double radius = 1.0 / std::sqrt(random.uniform(b, a));  // inverse of the cumulative density
    const cv::Point2d centre = random_point(tile, random);
    const double grey = random.uniform(settings.low, settings.high);
    Rim rim;
    if (settings.outline > 0.0) rim = {grey - settings.outline, 1 + static_cast<int>(radius / 20.0)};
    fill_wrapped(tile, ragged_polygon(random, centre, radius, settings), grey, rim);
  }
}

void draw_cracks(cv::Mat1f& tile, Random& random, const CrackSettings& settings) {
  cv::Mat1f layer = cv::Mat1f::zeros(tile.size());
  constexpr double kStep_px = 4.0;
  for (int i = 0; i < settings.count; ++i) {
    cv::Point2d point = random_point(tile, random);
    double heading = random.uniform(0.0, kTurn);
    const double length = settings.length_px * random.uniform(0.3, 1.0);
    for (double walked = 0.0; walked < length; walked += kStep_px) {
      heading += random.uniform(-settings.wander_rad, settings.wander_rad);
      const cv::Point2d next = point + kStep_px * cv::Point2d(std::cos(heading), std::sin(heading));
      const cv::Rect bounds =
          cv::Rect(cv::Point(point), cv::Size(1, 1)) | cv::Rect(cv::Point(next), cv::Size(1, 1));
      for_each_copy(layer, bounds, [&](cv::Point offset) {
        cv::line(layer, cv::Point(point) + offset, cv::Point(next) + offset, cv::Scalar(settings.change),
                 settings.thickness_px);
      });
      point = {next.x - tile.cols * std::floor(next.x / tile.cols),
               next.y - tile.rows * std::floor(next.y / tile.rows)};
    }
  }
  tile += layer;
}

void write_text(cv::Mat1f& tile, Random& random, const cv::Rect& area, double grey) {
  static constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPRSTUVWXYZabcdefghiklmnoprstuz0123456789";
  std::string text;
  for (int i = random.integer(3, 8); i > 0; --i) text += kLetters[random.index(kLetters.size())];
  constexpr int kFont = cv::FONT_HERSHEY_DUPLEX;
  int below = 0;
  const cv::Size unit = cv::getTextSize(text, kFont, 1.0, 1, &below);
  const double scale = std::min(static_cast<double>(area.width) / unit.width,
                                static_cast<double>(area.height) / (unit.height + below));
  const int thickness = std::max(1, cvRound(2.0 * scale));
  const cv::Point origin(area.x + cvRound(0.5 * (area.width - scale * unit.width)),
                         area.y + cvRound(0.5 * (area.height + scale * unit.height)));
  cv::putText(tile, text, origin, kFont, scale, cv::Scalar(grey), thickness);
}

cv::Mat1b to_bytes(const cv::Mat1f& tile) {
  cv::Mat1b bytes;
  tile.convertTo(bytes, CV_8U, 255.0);
  return bytes;
}

void normalize_tile(cv::Mat1f& tile, double mean, double deviation) {
  cv::Scalar old_mean;
  cv::Scalar old_deviation;
  cv::meanStdDev(tile, old_mean, old_deviation);
  const double scale = old_deviation[0] > 0.0 ? deviation / old_deviation[0] : 0.0;
  tile.convertTo(tile, CV_32F, scale, mean - scale * old_mean[0]);
}

}  // namespace stereo_slam::simulator
