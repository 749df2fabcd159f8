// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

#include "simulator/textures/random.hpp"

/// Synthesis of every texture of the street world: square grey images of `size` pixels (a power of two) that
/// wrap around, values in [0, 1] with a mean near 0.5 unless said otherwise. The comment at a texture gives
/// the length of its side on the surface.
namespace stereo_slam::simulator {

// Ground.
[[nodiscard]] cv::Mat1f asphalt_texture(Random& random,
                                        int size);                 ///< 10.24 m: grain, cracks, mended patches
[[nodiscard]] cv::Mat1f paving_texture(Random& random, int size);  ///< 5.12 m: slabs in rows
[[nodiscard]] cv::Mat1f cobble_texture(Random& random, int size);  ///< 5.12 m: small stones in rows
[[nodiscard]] cv::Mat1f grass_texture(Random& random, int size);   ///< 5.12 m
[[nodiscard]] cv::Mat1f gravel_texture(Random& random, int size);  ///< 5.12 m
[[nodiscard]] cv::Mat1f paint_texture(Random& random, int size);   ///< 2.56 m: worn road paint

// Buildings.
[[nodiscard]] cv::Mat1f brick_texture(Random& random, int size, int courses,
                                      int bricks_a_course);         ///< 5.12 m
[[nodiscard]] cv::Mat1f plaster_texture(Random& random, int size);  ///< 5.12 m
[[nodiscard]] cv::Mat1f masonry_texture(Random& random, int size);  ///< 5.12 m: irregular stones
[[nodiscard]] cv::Mat1f boards_texture(Random& random, int size);   ///< 5.12 m: upright boards
[[nodiscard]] cv::Mat1f roof_texture(Random& random, int size);     ///< 5.12 m: tiles in rows
[[nodiscard]] cv::Mat1f window_texture(Random& random, int size);   ///< one window
[[nodiscard]] cv::Mat1f door_texture(Random& random, int size);     ///< one door
[[nodiscard]] cv::Mat1f shop_texture(Random& random, int size);     ///< one shop window with its name

// Street furniture, cars, plants, distance.
[[nodiscard]] cv::Mat1f sign_texture(Random& random, int size);    ///< one sign or poster
[[nodiscard]] cv::Mat1f metal_texture(Random& random, int size);   ///< 2.56 m: paint with scratches and seams
[[nodiscard]] cv::Mat1f glass_texture(Random& random, int size);   ///< dark, with reflections
[[nodiscard]] cv::Mat1f wheel_texture(Random& random, int size);   ///< one wheel
[[nodiscard]] cv::Mat1f bark_texture(Random& random, int size);    ///< 1.28 m
[[nodiscard]] cv::Mat1f leaf_texture(Random& random, int size);    ///< 2 m
[[nodiscard]] cv::Mat1f leaf_opacity(Random& random, int size);    ///< one branch: 1 where there is a leaf
[[nodiscard]] cv::Mat1f fence_opacity(Random& random, int size);   ///< 2.56 m: bars
[[nodiscard]] cv::Mat1f picket_opacity(int size);                  ///< 2.56 m: sixteen equal pickets
[[nodiscard]] cv::Mat1f forest_texture(Random& random, int size);  ///< 160 m: a hillside
[[nodiscard]] cv::Mat1f cloud_texture(Random& random, int size);   ///< 6 km: a sky
[[nodiscard]] cv::Mat1f stain_texture(Random& random, int size);   ///< macro variation of any surface

}  // namespace stereo_slam::simulator
