// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "simulator/rendering/scene.hpp"

namespace stereo_slam::simulator {

/// Pinhole of one image: u = fx X/Z + cx, v = fy Y/Z + cy, with pixel centres at integer coordinates.
struct PinholeCamera {
  int width_px = 0;
  int height_px = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
};

/// The same view in an image of another size; pixel centres have integer coordinates.
[[nodiscard]] PinholeCamera scaled(const PinholeCamera& camera, double scale);

/// Throws std::invalid_argument for a camera without size or focal length.
void validate(const PinholeCamera& camera);

/// Quantity that is affine in the image: value(x, y) = dx x + dy y + origin.
struct ImagePlane {
  double dx = 0.0;
  double dy = 0.0;
  double origin = 0.0;
  [[nodiscard]] double operator()(double x, double y) const { return dx * x + dy * y + origin; }
};

/// The footprint in the texture of the pixel centred at (x, y): u = (u/Z) / (1/Z), v = (v/Z) / (1/Z) and
/// their derivatives.
[[nodiscard]] inline Footprint footprint_at(const ImagePlane& u_over_depth, const ImagePlane& v_over_depth,
                                            const ImagePlane& inverse_depth, double x, double y) {
  const double depth = 1.0 / inverse_depth(x, y);
  Footprint f;
  f.u = u_over_depth(x, y) * depth;
  f.v = v_over_depth(x, y) * depth;
  f.du_dx = (u_over_depth.dx - f.u * inverse_depth.dx) * depth;
  f.dv_dx = (v_over_depth.dx - f.v * inverse_depth.dx) * depth;
  f.du_dy = (u_over_depth.dy - f.u * inverse_depth.dy) * depth;
  f.dv_dy = (v_over_depth.dy - f.v * inverse_depth.dy) * depth;
  return f;
}

/// Coordinate that is affine in the world, axis . P + offset, as the camera sees it: its ray part and its
/// value at the camera, so that (axis . P + offset) / Z = ray(x, y) + at_eye / Z.
struct AffineCoordinate {
  ImagePlane ray;
  double at_eye = 0.0;
  [[nodiscard]] ImagePlane over_depth(const ImagePlane& inverse_depth) const {
    return {ray.dx + at_eye * inverse_depth.dx, ray.dy + at_eye * inverse_depth.dy,
            ray.origin + at_eye * inverse_depth.origin};
  }
};
[[nodiscard]] AffineCoordinate view_coordinate(const Eigen::Vector3d& axis, double offset,
                                               const Eigen::Isometry3d& T_camera_world,
                                               const PinholeCamera& camera);

/// Face seen by a camera: a convex polygon in the image and, affine in the image, 1/Z and the texture
/// coordinates over Z. On the plane n . P = d of the face, P = Z r with the ray r = ((x - cx)/fx, (y -
/// cy)/fy, 1), so that 1/Z = (n . r) / d and (u_axis . P + u_offset) / Z = u_axis . r + u_offset / Z are both
/// affine in (x, y).
struct ScreenFace {
  static constexpr int kMaxEdges = 5;       ///< a clipped quadrilateral
  std::array<ImagePlane, kMaxEdges> edges;  ///< signed distances in pixels, positive inside
  int edge_count = 0;
  int first_column = 0, last_column = 0;  ///< pixels that the polygon may touch
  int first_row = 0, last_row = 0;
  ImagePlane inverse_depth;
  ImagePlane u_over_depth;
  ImagePlane v_over_depth;
  float brightness = 1.0F;
  /// Order of the opacity thresholds; depends only on the face, so it is the same in every view.
  std::uint32_t sample_order = 0;
  const Material* material = nullptr;
};

/// Nearest depth that is drawn.
inline constexpr double kNearPlane_m = 0.1;

/// The face as the camera sees it; nothing when it is behind, outside, turned away or far too small to be
/// hit.
[[nodiscard]] std::optional<ScreenFace> project_face(const Face& face,
                                                     const Eigen::Isometry3d& T_camera_world,
                                                     const PinholeCamera& camera,
                                                     const std::vector<Material>& materials);

/// Whether any point of a box can be in front of the near plane and inside the image.
[[nodiscard]] bool may_be_visible(const Eigen::AlignedBox3f& box, const Eigen::Isometry3d& T_camera_world,
                                  const PinholeCamera& camera);

}  // namespace stereo_slam::simulator
