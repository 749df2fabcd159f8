// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/equal_brightness.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/median.hpp"

namespace stereo_slam {
namespace {

constexpr double kLeast = 5.0;  // grey levels

struct Brightness {
  double mean = 0.0;      ///< grey levels
  double contrast = 0.0;  ///< standard deviation, grey levels
};

/// Of every eighth row of a part of an image.
[[nodiscard]] Brightness brightness_of(const cv::Mat& image) {
  constexpr int kStep_px = 8;
  const cv::Mat rows((image.rows + kStep_px - 1) / kStep_px, image.cols, image.type(), image.data,
                     kStep_px * image.step);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(rows, mean, deviation);
  return {mean[0], deviation[0]};
}

/// Of the same tile of both images.
struct Tile {
  Brightness left;
  Brightness right;
};

/// The tiles that are neither black nor plain in either image.
[[nodiscard]] std::vector<Tile> textured_tiles(const StereoFrame& frame) {
  constexpr int kColumns = 8;
  constexpr int kRows = 4;
  std::vector<Tile> tiles;
  const cv::Size size(frame.left.cols / kColumns, frame.left.rows / kRows);
  if (size.empty() || frame.left.size() != frame.right.size()) return tiles;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const cv::Rect part({column * size.width, row * size.height}, size);
      const Tile tile{brightness_of(frame.left(part)), brightness_of(frame.right(part))};
      if (std::min({tile.left.mean, tile.left.contrast, tile.right.mean, tile.right.contrast}) >= kLeast)
        tiles.push_back(tile);
    }
  }
  return tiles;
}

[[nodiscard]] bool differs(double ratio) {
  constexpr double kMostRatio = 1.15;
  return ratio > kMostRatio || ratio * kMostRatio < 1.0;
}

}  // namespace

StereoFrame with_equal_brightness(const StereoFrame& frame) {
  constexpr std::size_t kFewestTiles = 8;
  constexpr double kMostGain = 4.0;
  const auto tiles = textured_tiles(frame);
  if (tiles.size() < kFewestTiles) return frame;
  const auto median_of = [&](auto value) {
    std::vector<double> values;
    values.reserve(tiles.size());
    for (const Tile& tile : tiles) values.push_back(value(tile));
    return median(values);
  };
  const double gain = median_of([](const Tile& t) { return t.left.contrast / t.right.contrast; });
  const double brightness = median_of([](const Tile& t) { return t.left.mean / t.right.mean; });
  if (!differs(gain) && !differs(brightness)) return frame;
  if (gain > kMostGain || gain * kMostGain < 1.0) return frame;
  const double offset = median_of([&](const Tile& t) { return t.left.mean - gain * t.right.mean; });
  StereoFrame result = frame;
  result.right = cv::Mat();  // not the recorded image's memory
  frame.right.convertTo(result.right, -1, gain, offset);
  return result;
}

}  // namespace stereo_slam
