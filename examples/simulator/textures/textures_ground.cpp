// SPDX-License-Identifier: MIT
#include <algorithm>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "simulator/textures/pattern.hpp"
#include "simulator/textures/textures.hpp"

namespace stereo_slam::simulator {
namespace {

/// Number of shapes that cover a tile of `size` as densely as `count` cover one of 1024 pixels.
[[nodiscard]] int count_for(int size, int count_at_1024) {
  return std::max(1,
                  static_cast<int>(count_at_1024 * (static_cast<double>(size) * size) / (1024.0 * 1024.0)));
}

/// Rows of blocks with joints, every second row shifted by half a block.
struct Bond {
  int rows;
  int blocks_a_row;
  double spread;  ///< of the blocks' grey around 0.5
  double joint;   ///< grey of the joints
};

[[nodiscard]] cv::Mat1f blocks(Random& random, int size, const Bond& bond) {
  cv::Mat1f tile(size, size, static_cast<float>(bond.joint));
  const double height = static_cast<double>(size) / bond.rows;
  const double width = static_cast<double>(size) / bond.blocks_a_row;
  const int gap = std::max(1, size / 400);
  for (int row = 0; row < bond.rows; ++row) {
    for (int block = 0; block < bond.blocks_a_row; ++block) {
      const double x = (block + 0.5 * (row % 2)) * width;
      const double grey = 0.5 + random.uniform(-bond.spread, bond.spread);
      const int x0 = static_cast<int>(x) + gap;
      const int x1 = static_cast<int>(x + width) - 1;
      const int y0 = static_cast<int>(row * height) + gap;
      const int y1 = static_cast<int>((row + 1) * height) - 1;
      fill_wrapped(tile, {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, grey);
    }
  }
  return tile;
}

}  // namespace

cv::Mat1f asphalt_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.5F);
  scatter(tile, random,
          {.count = count_for(size, 60000),
           .min_radius_px = 1.0,
           .max_radius_px = 6.0,
           .low = 0.25,
           .high = 0.75});
  cv::GaussianBlur(tile, tile, {}, 0.7, 0.7, cv::BORDER_REFLECT_101);
  tile += 0.07 * fractal_noise(random, tile.size(), 4, 9, 0.75);
  for (int i = count_for(size, 14); i > 0; --i) {  // mended patches with tarred seams
    const int w = random.integer(size / 20, size / 5);
    const int h = random.integer(size / 20, size / 6);
    const int x = random.integer(0, size - 1);
    const int y = random.integer(0, size - 1);
    cv::Mat1f patch(tile.size(), 0.0F);
    fill_wrapped(patch, {{x, y}, {x + w, y}, {x + w, y + h}, {x, y + h}}, random.uniform(-0.16, 0.12),
                 {-0.22, std::max(1, size / 300)});
    tile += patch;
  }
  draw_cracks(tile, random,
              {.count = count_for(size, 26),
               .length_px = 0.5 * size,
               .wander_rad = 0.35,
               .thickness_px = std::max(1, size / 512),
               .change = -0.22});
  draw_cracks(tile, random,
              {.count = count_for(size, 8),
               .length_px = 0.9 * size,
               .wander_rad = 0.15,
               .thickness_px = std::max(1, size / 180),
               .change = -0.2});
  normalize_tile(tile, 0.5, 0.09);
  return tile;
}

cv::Mat1f paving_texture(Random& random, int size) {
  cv::Mat1f tile = blocks(random, size, {10, 10, 0.12, 0.25});
  tile += 0.07 * fractal_noise(random, tile.size(), 4, 9, 0.8);
  draw_cracks(tile, random,
              {.count = 14, .length_px = 0.25 * size, .wander_rad = 0.5, .thickness_px = 1, .change = -0.2});
  scatter(
      tile, random,
      {.count = count_for(size, 220), .min_radius_px = 2.0, .max_radius_px = 14.0, .low = 0.2, .high = 0.75});
  normalize_tile(tile, 0.5, 0.1);
  return tile;
}

cv::Mat1f cobble_texture(Random& random, int size) {
  cv::Mat1f tile = blocks(random, size, {46, 46, 0.22, 0.2});
  tile += 0.06 * fractal_noise(random, tile.size(), 4, 9, 0.8);
  normalize_tile(tile, 0.5, 0.12);
  return tile;
}

cv::Mat1f grass_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.4F);
  scatter(tile, random,
          {.count = count_for(size, 50000),
           .min_radius_px = 2.0,
           .max_radius_px = 24.0,
           .low = 0.15,
           .high = 0.85,
           .roundness = 0.15});
  tile += 0.08 * fractal_noise(random, tile.size(), 4, 6, 0.8);
  normalize_tile(tile, 0.5, 0.11);
  return tile;
}

cv::Mat1f gravel_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.4F);
  scatter(tile, random,
          {.count = count_for(size, 40000),
           .min_radius_px = 2.0,
           .max_radius_px = 16.0,
           .low = 0.15,
           .high = 0.85,
           .outline = 0.15});
  tile += 0.06 * fractal_noise(random, tile.size(), 4, 6, 0.8);
  normalize_tile(tile, 0.5, 0.13);
  return tile;
}

cv::Mat1f paint_texture(Random& random, int size) {
  cv::Mat1f tile = fractal_noise(random, {size, size}, 8, 8, 0.85);
  tile.convertTo(tile, CV_32F, 0.06, 0.55);
  scatter(tile, random,
          {.count = count_for(size, 2500),
           .min_radius_px = 2.0,
           .max_radius_px = 40.0,
           .low = 0.25,
           .high = 0.5,
           .roundness = 0.3});
  return tile;
}

cv::Mat1f brick_texture(Random& random, int size, int courses, int bricks_a_course) {
  cv::Mat1f tile = blocks(random, size, {courses, bricks_a_course, 0.2, 0.68});
  tile += 0.05 * fractal_noise(random, tile.size(), 4, 9, 0.8);
  scatter(
      tile, random,
      {.count = count_for(size, 120), .min_radius_px = 3.0, .max_radius_px = 40.0, .low = 0.25, .high = 0.7});
  normalize_tile(tile, 0.5, 0.1);
  return tile;
}

cv::Mat1f plaster_texture(Random& random, int size) {
  cv::Mat1f tile = fractal_noise(random, {size, size}, 4, 9, 0.8);
  tile.convertTo(tile, CV_32F, 0.035, 0.5);
  scatter(tile, random,
          {.count = count_for(size, 60),
           .min_radius_px = 8.0,
           .max_radius_px = 110.0,
           .low = 0.4,
           .high = 0.58,
           .corners = 7,
           .outline = 0.06});
  scatter(
      tile, random,
      {.count = count_for(size, 420), .min_radius_px = 2.0, .max_radius_px = 12.0, .low = 0.3, .high = 0.65});
  tile += 0.025 * fractal_noise(random, tile.size(), 64, 5, 0.9);
  draw_cracks(tile, random,
              {.count = 16,
               .length_px = 0.4 * size,
               .wander_rad = 0.4,
               .thickness_px = std::max(1, size / 512),
               .change = -0.15});
  normalize_tile(tile, 0.5, 0.05);
  return tile;
}

cv::Mat1f masonry_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.3F);
  scatter(tile, random,
          {.count = count_for(size, 2600),
           .min_radius_px = 14.0,
           .max_radius_px = 60.0,
           .low = 0.25,
           .high = 0.8,
           .corners = 6,
           .outline = 0.2});
  tile += 0.07 * fractal_noise(random, tile.size(), 8, 8, 0.85);
  normalize_tile(tile, 0.5, 0.11);
  return tile;
}

cv::Mat1f boards_texture(Random& random, int size) {
  cv::Mat1f tile(size, size);
  constexpr int kBoards = 32;
  cv::Mat1f grain = fractal_noise(random, {size, size}, 16, 7, 0.85);
  cv::resize(grain, grain, {size, size * 8}, 0.0, 0.0, cv::INTER_LINEAR);  // stretched along the boards
  for (int board = 0; board < kBoards; ++board) {
    const cv::Range columns(board * size / kBoards, (board + 1) * size / kBoards);
    const double grey = random.uniform(0.35, 0.65);
    grain.rowRange(0, size).colRange(columns).convertTo(tile.colRange(columns), CV_32F, 0.05, grey);
    tile.col(columns.start).setTo(0.15);
  }
  scatter(
      tile, random,
      {.count = count_for(size, 260), .min_radius_px = 2.0, .max_radius_px = 9.0, .low = 0.1, .high = 0.5});
  return tile;
}

cv::Mat1f roof_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.25F);
  constexpr int kRows = 18;
  constexpr int kTiles = 24;
  const double height = static_cast<double>(size) / kRows;
  const double width = static_cast<double>(size) / kTiles;
  for (int row = 0; row < kRows; ++row) {
    for (int i = 0; i < kTiles; ++i) {
      const int x0 = static_cast<int>((i + 0.5 * (row % 2)) * width);
      const int x1 = static_cast<int>((i + 1 + 0.5 * (row % 2)) * width) - 1;
      const int y0 = static_cast<int>(row * height);
      const int y1 = static_cast<int>((row + 0.75) * height);
      const int y2 = static_cast<int>((row + 0.95) * height);
      fill_wrapped(tile, {{x0, y0}, {x1, y0}, {x1, y1}, {(x0 + x1) / 2, y2}, {x0, y1}},
                   random.uniform(0.35, 0.68));
    }
  }
  tile += 0.05 * fractal_noise(random, tile.size(), 4, 8, 0.8);
  scatter(
      tile, random,
      {.count = count_for(size, 160), .min_radius_px = 3.0, .max_radius_px = 30.0, .low = 0.2, .high = 0.65});
  normalize_tile(tile, 0.5, 0.1);
  return tile;
}

}  // namespace stereo_slam::simulator
