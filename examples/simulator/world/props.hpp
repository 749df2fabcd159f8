// SPDX-License-Identifier: MIT
#pragma once

#include "simulator/textures/random.hpp"
#include "simulator/world/materials.hpp"
#include "simulator/world/mesh.hpp"

/// Street furniture, plants and vehicles. Each stands at the origin of the mesh's placement.
namespace stereo_slam::simulator {

/// How finely a tree's crown is built.
enum class TreeDetail { kNear, kFar };

/// Trunk, boughs, and a crown of leafy branches.
void add_tree(Mesh& mesh, Random& random, const Palette& palette, double height_m, TreeDetail detail);

/// Ball of leaves on the ground.
void add_bush(Mesh& mesh, Random& random, const Palette& palette, double height_m);

/// Clipped hedge, wall or fence of `length_m` along x, centred.
void add_boundary(Mesh& mesh, Random& random, const Palette& palette, double length_m);

/// Street lamp; its arm reaches out to the front.
void add_lamp(Mesh& mesh, Random& random, const Palette& palette);

/// Traffic sign or poster on a post, facing the front.
void add_sign(Mesh& mesh, Random& random, const Palette& palette);

/// Bin, switch box, letter box or bollard.
void add_box(Mesh& mesh, Random& random, const Palette& palette);

/// Measures of every car.
struct CarSize {
  static constexpr double kLength_m = 4.3;
  static constexpr double kWidth_m = 1.75;
};

/// Car that faces the front.
void add_car(Mesh& mesh, Random& random, const Palette& palette);

/// Measures of every lorry.
struct LorrySize {
  static constexpr double kLength_m = 5.4;
  static constexpr double kWidth_m = 2.05;
  static constexpr double kHeight_m = 2.9;
};

/// Lorry with a closed body that faces the front.
void add_lorry(Mesh& mesh, Random& random, const Palette& palette);

/// Wheel of a vehicle.
struct Wheel {
  Eigen::Vector3d hub;
  double radius_m;
  double side;  ///< of the vehicle: -1 left, 1 right
  Paint rim;
};
void add_wheel(Mesh& mesh, const Palette& palette, const Wheel& wheel);

/// Rectangle in a side or an end of a vehicle: its centre and its size, metres.
struct Patch {
  double x_m;  ///< along the side or the end
  double y_m;  ///< height of the centre
  double width_m;
  double height_m;
};

/// Board of the given width and height (metres) that shows an image to the front and `back` to the rear.
struct Board {
  Eigen::Vector3d corner;  ///< lower left, seen from the front
  Eigen::Vector2d size_m;
  Paint image;
  Paint back;
};
void add_board(Mesh& mesh, const Board& board);

}  // namespace stereo_slam::simulator
