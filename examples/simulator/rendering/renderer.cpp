// SPDX-License-Identifier: MIT
#include "simulator/rendering/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "simulator/rendering/tile.hpp"

namespace stereo_slam::simulator {
namespace {

/// The scene with quantities that depend on the camera pose of one image.
struct View {
  const Scene& scene;
  AffineCoordinate sun_u;  ///< coordinates of the map of sunlight
  AffineCoordinate sun_v;
};

[[nodiscard]] View make_view(const Scene& scene, const Eigen::Isometry3d& T_camera_world,
                             const PinholeCamera& camera) {
  const Sunlight& sun = scene.sunlight;
  return {scene,
          view_coordinate(Eigen::Vector3d::UnitX() / sun.side_m, -sun.corner.x() / sun.side_m, T_camera_world,
                          camera),
          view_coordinate(Eigen::Vector3d::UnitZ() / sun.side_m, -sun.corner.y() / sun.side_m, T_camera_world,
                          camera)};
}

/// Share of the light that falls on a face at (x, y).
[[nodiscard]] float sunlight(const ScreenFace& face, const View& view, double x, double y) {
  const Sunlight& sun = view.scene.sunlight;
  const ImagePlane& w = face.inverse_depth;
  const float sunny =
      sun.map->sample_round(footprint_at(view.sun_u.over_depth(w), view.sun_v.over_depth(w), w, x, y));
  return sun.shadow + (1.0F - sun.shadow) * sunny;
}

/// Grey value of a face over the pixel centred at (x, y).
[[nodiscard]] float shade(const ScreenFace& face, const View& view, double x, double y) {
  const Footprint footprint = footprint_at(face.u_over_depth, face.v_over_depth, face.inverse_depth, x, y);
  const Material& material = *face.material;
  float grey = 255.0F * face.brightness;
  if (material.detail) grey *= material.detail->sample(footprint);
  if (material.macro) {
    const double s = material.macro_scale;
    const Footprint wide{s * footprint.u,     s * footprint.v,     s * footprint.du_dx,
                         s * footprint.dv_dx, s * footprint.du_dy, s * footprint.dv_dy};
    grey *= 1.0F + material.macro_contrast * (2.0F * material.macro->sample_round(wide) - 1.0F);
  }
  if (material.takes_shadow && view.scene.sunlight.map) grey *= sunlight(face, view, x, y);
  const double clear_m = view.scene.haze_distance_m;
  const auto clear = static_cast<float>(clear_m / (clear_m + 1.0 / face.inverse_depth(x, y)));
  return clear * grey + (1.0F - clear) * view.scene.horizon_grey;
}

/// Grey value of a pixel: the mean over its samples of the grey values of the faces visible at them.
template <int Samples>
[[nodiscard]] float resolve(const std::array<std::uint32_t, Samples>& ids,
                            const std::vector<ScreenFace>& faces, const View& view, int x, int y) {
  const auto colour = [&](std::uint32_t id, double dx, double dy) {
    return id == kNoFace ? view.scene.horizon_grey : shade(faces[id], view, x + dx, y + dy);
  };
  if (std::all_of(ids.begin(), ids.end(), [&](std::uint32_t id) { return id == ids[0]; })) {
    return colour(ids[0], 0.0, 0.0);
  }
  constexpr auto kPattern = sample_pattern<Samples>();
  std::array<bool, Samples> done{};
  float sum = 0.0F;
  for (std::size_t s = 0; s < Samples; ++s) {
    if (done[s]) continue;
    SampleOffset centroid;
    int count = 0;
    for (std::size_t t = s; t < Samples; ++t) {
      if (ids[t] != ids[s]) continue;
      done[t] = true;
      centroid.x += kPattern[t].x;
      centroid.y += kPattern[t].y;
      ++count;
    }
    const auto n = static_cast<float>(count);
    sum += n * colour(ids[s], static_cast<double>(centroid.x / n), static_cast<double>(centroid.y / n));
  }
  return sum / Samples;
}

/// Draws the tile whose first pixel is `corner`.
template <int Samples>
void draw_tile(cv::Mat1f& image, const cv::Point& corner, const std::vector<ScreenFace>& faces,
               const std::vector<std::uint32_t>& listed, const View& view) {
  const int column = corner.x;
  const int row = corner.y;
  Tile<Samples> tile;
  tile.first_column = column;
  tile.first_row = row;
  rasterize(tile, std::span(faces), std::span(listed));
  for (int y = row; y < std::min(row + kTileSize_px, image.rows); ++y) {
    for (int x = column; x < std::min(column + kTileSize_px, image.cols); ++x) {
      const auto pixel = static_cast<std::size_t>((y - row) * kTileSize_px + (x - column));
      image(y, x) = resolve<Samples>(tile.face[pixel], faces, view, x, y);
    }
  }
}

/// Whether the polygon may touch the tile: no edge has all of the tile outside.
[[nodiscard]] bool may_touch(const ScreenFace& face, int column, int row) {
  constexpr double kHalf = 0.5 * kTileSize_px;
  const double x = column - 0.5 + kHalf;
  const double y = row - 0.5 + kHalf;
  return std::all_of(face.edges.begin(), face.edges.begin() + face.edge_count, [&](const ImagePlane& edge) {
    return edge(x, y) + kHalf * (std::abs(edge.dx) + std::abs(edge.dy)) >= 0.0;
  });
}

}  // namespace

/// Reused from image to image, so that rendering no longer allocates after the first images.
struct Renderer::Buffers {
  std::vector<std::pair<double, const Chunk*>> near_to_far;
  std::vector<ScreenFace> faces;
  int tile_columns = 0;
  int tile_rows = 0;
  std::vector<std::vector<std::uint32_t>> tiles;  ///< faces that may touch each tile, near to far
};

Renderer::Renderer(const Scene& scene, const PinholeCamera& camera, int samples)
    : scene_(&scene), camera_(camera), samples_(samples), buffers_(std::make_unique<Buffers>()) {
  if (samples != 4 && samples != 8 && samples != 16) {
    throw std::invalid_argument("samples a pixel must be 4, 8 or 16, not " + std::to_string(samples));
  }
  validate(camera);
  buffers_->tile_columns = (camera.width_px + kTileSize_px - 1) / kTileSize_px;
  buffers_->tile_rows = (camera.height_px + kTileSize_px - 1) / kTileSize_px;
  buffers_->tiles.resize(static_cast<std::size_t>(buffers_->tile_columns) *
                         static_cast<std::size_t>(buffers_->tile_rows));
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

void Renderer::project(const Eigen::Isometry3d& T_camera_world, const std::vector<Face>& moving) {
  auto& near_to_far = buffers_->near_to_far;
  auto& faces = buffers_->faces;
  near_to_far.clear();
  faces.clear();
  const Eigen::Vector3f eye = T_camera_world.inverse().translation().cast<float>();
  for (const Chunk& chunk : scene_->chunks) {
    if (!may_be_visible(chunk.bounds, T_camera_world, camera_)) continue;
    near_to_far.emplace_back(chunk.bounds.squaredExteriorDistance(eye), &chunk);
  }
  std::stable_sort(near_to_far.begin(), near_to_far.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto add = [&](const Face& face) {
    if (const auto screen = project_face(face, T_camera_world, camera_, scene_->materials))
      faces.push_back(*screen);
  };
  for (const Face& face : moving) add(face);
  for (const auto& [distance, chunk] : near_to_far) {
    for (const Face& face : chunk->faces) add(face);
  }
}

void Renderer::bin() {
  Buffers& buffers = *buffers_;
  for (auto& tile : buffers.tiles) tile.clear();
  for (std::uint32_t id = 0; id < buffers.faces.size(); ++id) {
    const ScreenFace& face = buffers.faces[id];
    for (int row = face.first_row / kTileSize_px; row <= face.last_row / kTileSize_px; ++row) {
      for (int column = face.first_column / kTileSize_px; column <= face.last_column / kTileSize_px;
           ++column) {
        if (!may_touch(face, column * kTileSize_px, row * kTileSize_px)) continue;
        buffers.tiles[static_cast<std::size_t>(row * buffers.tile_columns + column)].push_back(id);
      }
    }
  }
}

cv::Mat1f Renderer::render(const Eigen::Isometry3d& T_world_camera, const std::vector<Face>& moving) {
  const Eigen::Isometry3d T_camera_world = T_world_camera.inverse();
  project(T_camera_world, moving);
  bin();
  const View view = make_view(*scene_, T_camera_world, camera_);
  cv::Mat1f image(camera_.height_px, camera_.width_px);
  const auto draw = samples_ == 4 ? draw_tile<4> : samples_ == 8 ? draw_tile<8> : draw_tile<16>;
  for (int row = 0; row < buffers_->tile_rows; ++row) {
    for (int column = 0; column < buffers_->tile_columns; ++column) {
      const auto tile = static_cast<std::size_t>(row * buffers_->tile_columns + column);
      draw(image, {column * kTileSize_px, row * kTileSize_px}, buffers_->faces, buffers_->tiles[tile], view);
    }
  }
  return image;
}

}  // namespace stereo_slam::simulator
