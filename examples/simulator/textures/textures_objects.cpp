// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "simulator/textures/pattern.hpp"
#include "simulator/textures/textures.hpp"

namespace stereo_slam::simulator {
namespace {

/// Rectangle given in fractions of the tile.
[[nodiscard]] cv::Rect part(int size, double x0, double y0, double x1, double y1) {
  return {cv::Point(cvRound(x0 * size), cvRound(y0 * size)),
          cv::Point(cvRound(x1 * size), cvRound(y1 * size))};
}

void fill(cv::Mat1f& tile, const cv::Rect& area, double grey) {
  cv::rectangle(tile, area, cv::Scalar(grey), cv::FILLED);
}

/// Random clutter inside a rectangle: goods in a shop, a room behind a window.
void clutter(cv::Mat1f& tile, Random& random, const cv::Rect& area, const ScatterSettings& settings) {
  cv::Mat1f inside(area.size(), static_cast<float>(settings.low));
  scatter(inside, random, settings);
  inside.copyTo(tile(area));
}

/// Dark pane with slanted reflections.
void draw_pane(cv::Mat1f& tile, Random& random, const cv::Rect& pane) {
  const double dark = random.uniform(0.08, 0.3);
  clutter(tile, random, pane,
          {.count = 24,
           .min_radius_px = 3.0,
           .max_radius_px = std::max(4.0, 0.4 * pane.width),
           .low = dark,
           .high = dark + 0.18,
           .corners = 4});
  if (random.chance(0.6)) {  // curtain or blind
    const double light = random.uniform(0.5, 0.9);
    const bool blind = random.chance(0.5);
    const int drop = cvRound(pane.height * random.uniform(0.15, 0.8));
    const int stripes = random.integer(5, 14);
    for (int i = 0; i < stripes; ++i) {
      const double grey = light + random.uniform(-0.12, 0.1);
      const cv::Rect stripe =
          blind ? cv::Rect(pane.x, pane.y + i * drop / stripes, pane.width, std::max(1, drop / stripes - 1))
                : cv::Rect(pane.x + i * pane.width / stripes, pane.y, std::max(1, pane.width / stripes - 1),
                           drop);
      fill(tile, stripe & pane, grey);
    }
  }
  if (random.chance(0.35)) {  // something on the sill
    const int radius = std::max(2, pane.width / 6);
    const double grey = random.uniform(0.2, 0.8);
    const int x = pane.x + random.integer(radius, std::max(radius, pane.width - radius));
    cv::circle(tile, {x, pane.y + pane.height - radius - 1}, radius, cv::Scalar(grey), cv::FILLED);
  }
}

}  // namespace

cv::Mat1f window_texture(Random& random, int size) {
  const double frame = random.chance(0.7) ? random.uniform(0.75, 0.95) : random.uniform(0.2, 0.45);
  cv::Mat1f tile(size, size, static_cast<float>(frame));
  const int columns = random.integer(1, 3);
  const bool transom = random.chance(0.5);
  const double split = random.uniform(0.22, 0.4);
  constexpr double kBar = 0.035;
  for (int i = 0; i < columns; ++i) {
    const double x0 = static_cast<double>(i) / columns + kBar;
    const double x1 = static_cast<double>(i + 1) / columns - kBar;
    if (transom) draw_pane(tile, random, part(size, x0, kBar, x1, split - kBar));
    draw_pane(tile, random, part(size, x0, transom ? split + kBar : kBar, x1, 1.0 - kBar));
  }
  tile += 0.015 * fractal_noise(random, tile.size(), 8, 6, 0.8);
  return tile;
}

cv::Mat1f door_texture(Random& random, int size) {
  const double base = random.uniform(0.15, 0.6);
  cv::Mat1f tile(size, size, static_cast<float>(base));
  const int rows = random.integer(2, 5);
  const int columns = random.integer(1, 3);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const cv::Rect panel = part(size, (column + 0.12) / columns, (row + 0.12) / rows,
                                  (column + 0.88) / columns, (row + 0.88) / rows);
      fill(tile, panel, base + random.uniform(-0.12, 0.2));
      cv::rectangle(tile, panel, cv::Scalar(base - 0.12), std::max(1, size / 128));
    }
  }
  fill(tile, part(size, 0.84, 0.5, 0.92, 0.54), 0.9);
  tile += 0.03 * fractal_noise(random, tile.size(), 8, 6, 0.8);
  return tile;
}

cv::Mat1f shop_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, static_cast<float>(random.uniform(0.2, 0.8)));
  const double board = random.uniform(0.1, 0.9);
  fill(tile, part(size, 0.0, 0.0, 1.0, 0.24), board);
  write_text(tile, random, part(size, 0.08, 0.03, 0.92, 0.21), board > 0.5 ? board - 0.45 : board + 0.5);
  const int panes = random.integer(2, 4);
  for (int i = 0; i < panes; ++i) {
    const cv::Rect pane = part(size, (i + 0.05) / panes, 0.28, (i + 0.95) / panes, 0.95);
    clutter(tile, random, pane,
            {.count = 160,
             .min_radius_px = 0.012 * size,
             .max_radius_px = 0.12 * size,
             .low = 0.08,
             .high = 0.75,
             .corners = random.integer(4, 6)});
    write_text(tile, random, part(size, (i + 0.15) / panes, 0.4, (i + 0.85) / panes, 0.5),
               random.uniform(0.7, 1.0));
  }
  return tile;
}

cv::Mat1f sign_texture(Random& random, int size) {
  const double ground = random.chance(0.5) ? random.uniform(0.75, 0.98) : random.uniform(0.1, 0.4);
  const double ink = ground > 0.5 ? random.uniform(0.02, 0.3) : random.uniform(0.75, 1.0);
  cv::Mat1f tile(size, size, static_cast<float>(ground));
  if (random.chance(0.4)) {
    clutter(tile, random, part(size, 0.1, 0.35, 0.9, 0.9),
            {.count = 60,
             .min_radius_px = 0.02 * size,
             .max_radius_px = 0.2 * size,
             .low = 0.1,
             .high = 0.95,
             .corners = 5});
  } else {
    write_text(tile, random, part(size, 0.1, 0.4, 0.9, 0.62), ink);
    write_text(tile, random, part(size, 0.2, 0.66, 0.8, 0.84), ink);
  }
  write_text(tile, random, part(size, 0.08, 0.1, 0.92, 0.34), ink);
  cv::rectangle(tile, part(size, 0.03, 0.03, 0.97, 0.97), cv::Scalar(ink), std::max(1, size / 40));
  return tile;
}

cv::Mat1f metal_texture(Random& random, int size) {
  cv::Mat1f tile = fractal_noise(random, {size, size}, 2, 8, 0.6);
  tile.convertTo(tile, CV_32F, 0.05, 0.5);
  draw_cracks(tile, random,
              {.count = 40, .length_px = 0.1 * size, .wander_rad = 0.1, .thickness_px = 1, .change = 0.12});
  scatter(tile, random,
          {.count = 40, .min_radius_px = 1.5, .max_radius_px = 0.02 * size, .low = 0.3, .high = 0.7});
  return tile;
}

cv::Mat1f glass_texture(Random& random, int size) {
  cv::Mat1f tile = fractal_noise(random, {size, size}, 3, 6, 0.6);
  tile.convertTo(tile, CV_32F, 0.05, 0.22);
  for (int i = 0; i < 9; ++i) {  // reflections: upright edges of houses, slanted ones of roofs
    const int x = random.integer(0, size);
    const int width = random.integer(size / 30, size / 8);
    const int lean = random.integer(-size / 6, size / 6);
    const int bottom = random.integer(size / 2, size);
    fill_wrapped(tile, {{x, 0}, {x + width, 0}, {x + width + lean, bottom}, {x + lean, bottom}},
                 random.uniform(0.12, 0.42));
  }
  return tile;
}

cv::Mat1f wheel_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.1F);
  const cv::Point centre(size / 2, size / 2);
  const double rim = random.uniform(0.5, 0.85);
  cv::circle(tile, centre, cvRound(0.32 * size), cv::Scalar(rim), cv::FILLED);
  const int spokes = random.integer(5, 9);
  for (int i = 0; i < spokes; ++i) {
    const double angle = 2.0 * CV_PI * i / spokes;
    const cv::Point hole =
        centre + cv::Point(cvRound(0.2 * size * std::cos(angle)), cvRound(0.2 * size * std::sin(angle)));
    cv::circle(tile, hole, cvRound(0.055 * size), cv::Scalar(0.15), cv::FILLED);
  }
  cv::circle(tile, centre, cvRound(0.07 * size), cv::Scalar(0.3), cv::FILLED);
  return tile;
}

cv::Mat1f bark_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.4F);
  scatter(tile, random,
          {.count = 1500,
           .min_radius_px = 0.006 * size,
           .max_radius_px = 0.06 * size,
           .low = 0.2,
           .high = 0.75,
           .roundness = 0.25,
           .outline = 0.1});
  tile += 0.06 * fractal_noise(random, tile.size(), 8, 7, 0.8);
  return tile;
}

cv::Mat1f leaf_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.2F);
  scatter(tile, random,
          {.count = 5000,
           .min_radius_px = 0.012 * size,
           .max_radius_px = 0.05 * size,
           .low = 0.12,
           .high = 0.9,
           .roundness = 0.4,
           .outline = 0.12});
  return tile;
}

cv::Mat1f leaf_opacity(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.0F);
  const int leaves = 420;
  for (int i = 0; i < leaves; ++i) {
    const double angle = random.uniform(0.0, 2.0 * CV_PI);
    const double radius = 0.43 * size * std::sqrt(random.uniform());
    const cv::Point centre(cvRound(0.5 * size + radius * std::cos(angle)),
                           cvRound(0.5 * size + radius * std::sin(angle)));
    const int length = std::max(2, cvRound(size * random.uniform(0.02, 0.05)));
    cv::ellipse(tile, centre, {length, std::max(1, length / 2)}, random.uniform(0.0, 360.0), 0.0, 360.0,
                cv::Scalar(1.0), cv::FILLED);
  }
  return tile;
}

cv::Mat1f fence_opacity(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.0F);
  constexpr int kBars = 16;
  for (int i = 0; i < kBars; ++i) {
    const double x = (i + 0.3) / kBars;
    fill(tile, part(size, x, random.uniform(0.0, 0.06), x + 0.4 / kBars, 1.0), 1.0);
  }
  fill(tile, part(size, 0.0, 0.15, 1.0, 0.21), 1.0);
  fill(tile, part(size, 0.0, 0.8, 1.0, 0.86), 1.0);
  return tile;
}

cv::Mat1f picket_opacity(int size) {
  constexpr int kPickets = 16;
  cv::Mat1f tile(size, size, 0.0F);
  for (int i = 0; i < kPickets; ++i)
    fill(tile, part(size, (i + 0.2) / kPickets, 0.0, (i + 0.8) / kPickets, 1.0), 1.0);
  return tile;
}

cv::Mat1f forest_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.4F);
  scatter(tile, random,
          {.count = 500,
           .min_radius_px = 0.03 * size,
           .max_radius_px = 0.2 * size,
           .low = 0.3,
           .high = 0.7,
           .corners = 5});
  scatter(tile, random,
          {.count = 9000,
           .min_radius_px = 0.004 * size,
           .max_radius_px = 0.04 * size,
           .low = 0.15,
           .high = 0.7,
           .outline = 0.12});
  return tile;
}

cv::Mat1f cloud_texture(Random& random, int size) {
  cv::Mat1f noise = fractal_noise(random, {size, size}, 3, 9, 0.58);
  cv::Mat1f tile(noise.size());
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float cover = std::clamp(0.8F * noise(y, x) - 0.1F, 0.0F, 1.0F);
      tile(y, x) = 0.4F + 0.12F * cover;
    }
  }
  return tile;
}

cv::Mat1f stain_texture(Random& random, int size) {
  cv::Mat1f tile(size, size, 0.5F);
  scatter(tile, random,
          {.count = 700,
           .min_radius_px = 0.02 * size,
           .max_radius_px = 0.25 * size,
           .low = 0.3,
           .high = 0.7,
           .corners = 7});
  cv::GaussianBlur(tile, tile, {}, 0.004 * size, 0.004 * size, cv::BORDER_REFLECT_101);
  tile += 0.12 * fractal_noise(random, tile.size(), 3, 9, 0.7);
  normalize_tile(tile, 0.5, 0.2);
  return tile;
}

}  // namespace stereo_slam::simulator
