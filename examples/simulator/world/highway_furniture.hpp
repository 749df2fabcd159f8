// SPDX-License-Identifier: MIT
#pragma once

#include "simulator/textures/random.hpp"
#include "simulator/world/materials.hpp"
#include "simulator/world/mesh.hpp"

/// Things that belong to a highway. Each stands at the origin of the mesh's placement.
namespace stereo_slam::simulator {

/// Piece of guard rail along x, centred, on a slope: its right end is `rise_m` above the left one.
void add_guard_rail(Mesh& mesh, Random& random, const Palette& palette, double length_m, double rise_m);

/// White post with a dark band, at the edge of the road.
void add_delineator(Mesh& mesh, const Palette& palette);

/// Large board on two posts, facing the front.
void add_direction_board(Mesh& mesh, Random& random, const Palette& palette);

/// Beam over the carriageway that carries boards, facing the front; its legs stand `half_span_m` to the left
/// and to the right.
void add_gantry(Mesh& mesh, Random& random, const Palette& palette, double half_span_m);

/// Half the side of the square on the ground that is kept free for a leg of a gantry.
inline constexpr double kGantryFoot_m = 0.3;

}  // namespace stereo_slam::simulator
