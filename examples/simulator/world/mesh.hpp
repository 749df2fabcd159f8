// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "simulator/rendering/scene.hpp"
#include "simulator/textures/random.hpp"
#include "simulator/world/route.hpp"

namespace stereo_slam::simulator {

/// How a part of an object is coloured.
struct Paint {
  MaterialId material{};
  double brightness = 1.0;
  bool stretched = false;  ///< one image over the whole part, instead of a texture in metres
  double u0 = 0.0;         ///< shift of the texture, periods
  double v0 = 0.0;
};

/// Paint of a random brightness between `low` and `high`, with the texture shifted at random.
[[nodiscard]] Paint varied_paint(Random& random, MaterialId material, double low, double high);

/// Upright prism or truncated cone around the y axis through `foot`.
struct Column {
  Eigen::Vector3d foot;
  double height_m;
  double bottom_radius_m;
  double top_radius_m;
  int sides;
};

/// Builds objects out of planar faces. Axes of the object, in metres: x to the right as seen by somebody who
/// looks at its front, y up, z out of the front. The light is that of a sun behind thin haze: the brightness
/// of a face depends only on its normal, see daylight().
class Mesh {
 public:
  using Vector3 = Eigen::Vector3d;

  Mesh(const std::vector<Material>& materials, std::vector<Face>& faces)
      : materials_(&materials), faces_(&faces) {}

  /// Puts all faces that are added from now on at T_world_object.
  void place(const Eigen::Isometry3d& T_world_object) { T_world_object_ = T_world_object; }
  [[nodiscard]] const Eigen::Isometry3d& placement() const noexcept { return T_world_object_; }

  /// Parallelogram with corners p, p + a, p + a + b, p + b, seen from the side a x b; u runs along a, v
  /// against b.
  void rectangle(const Vector3& p, const Vector3& a, const Vector3& b, const Paint& paint);

  /// The same with its centre at `centre`.
  void centred_rectangle(const Vector3& centre, const Vector3& a, const Vector3& b, const Paint& paint);

  /// Planar convex polygon, counter-clockwise from the front; u and v as for a rectangle with sides along a
  /// and b.
  void polygon(const std::vector<Vector3>& corners, const Vector3& a, const Vector3& b, const Paint& paint);

  /// Upright disc, seen from the left (side = -1) or the right (side = 1) of the object.
  void disc(const Vector3& centre, double radius_m, double side, const Paint& paint);

  /// Box without a bottom.
  void box(const Vector3& low, const Vector3& high, const Paint& paint);

  void column(const Column& column, const Paint& paint);

 private:
  const std::vector<Material>* materials_;
  std::vector<Face>* faces_;
  Eigen::Isometry3d T_world_object_ = Eigen::Isometry3d::Identity();
};

/// Placement of an object on the ground with its front turned to `front` (a unit direction).
[[nodiscard]] Eigen::Isometry3d stand(const GroundPoint& position, const GroundPoint& front, double ground_y);

/// Share of the light that a surface with this outward normal (world axes) receives; 1 is a sunlit wall.
[[nodiscard]] double daylight(const Eigen::Vector3d& normal);

}  // namespace stereo_slam::simulator
