// SPDX-License-Identifier: MIT
#include "simulator/world/shadows.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace stereo_slam::simulator {
namespace {

constexpr double kPixel_m = 0.15;
constexpr int kLargestMap_px = 4096;
constexpr double kMargin_m = 40.0;
/// Share of a face with leaves that they fill, in each direction.
constexpr double kLeafShare = 0.7;

/// Where the shadow of a point falls.
[[nodiscard]] GroundPoint shadow_of(const Eigen::Vector3d& point, const Terrain& terrain) {
  const Eigen::Vector3d to_sun = direction_to_sun();
  GroundPoint landing(point.x(), point.z());
  for (int i = 0; i < 2; ++i) {  // the ground is nearly level: two steps are enough
    const double t = std::max(0.0, (terrain.height(landing) - point.y()) / -to_sun.y());
    landing = {point.x() - t * to_sun.x(), point.z() - t * to_sun.z()};
  }
  return landing;
}

}  // namespace

Eigen::Vector3d direction_to_sun() { return Eigen::Vector3d(-0.55, -0.72, -0.42).normalized(); }

Sunlight cast_shadows(const std::vector<Face>& faces, const std::vector<Material>& materials,
                      const Terrain& terrain, const GroundPoint& low, const GroundPoint& high) {
  Sunlight sunlight;
  sunlight.side_m = (high - low).maxCoeff() + 2.0 * kMargin_m;
  sunlight.corner = 0.5 * (low + high) - GroundPoint::Constant(0.5 * sunlight.side_m);
  const auto wanted_px = static_cast<unsigned>(std::min<double>(sunlight.side_m / kPixel_m, kLargestMap_px));
  const int size_px = static_cast<int>(std::bit_ceil(wanted_px));
  const double px_per_m = size_px / sunlight.side_m;

  cv::Mat1b map(size_px, size_px, std::uint8_t{255});
  constexpr int kShift = 4;  // fractional bits of the polygon's corners
  for (const Face& face : faces) {
    const auto count = static_cast<std::size_t>(face.corner_count);
    const bool leafy = materials[face.material].opacity != nullptr;
    std::array<GroundPoint, 4> corners;
    GroundPoint centre = GroundPoint::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      corners[i] = shadow_of(face.corners[i].cast<double>(), terrain);
      centre += corners[i] / static_cast<double>(count);
    }
    std::array<cv::Point, 4> polygon;
    for (std::size_t i = 0; i < count; ++i) {
      const GroundPoint point = leafy ? GroundPoint(centre + kLeafShare * (corners[i] - centre)) : corners[i];
      const GroundPoint px =
          ((point - sunlight.corner) * px_per_m - GroundPoint::Constant(0.5)) * (1 << kShift);
      polygon[i] = {cvRound(px.x()), cvRound(px.y())};
    }
    cv::fillConvexPoly(map, polygon.data(), face.corner_count, cv::Scalar(0), cv::LINE_AA, kShift);
  }
  cv::GaussianBlur(map, map, {}, 0.7, 0.7);
  sunlight.map = std::make_shared<const Texture>(map);
  return sunlight;
}

}  // namespace stereo_slam::simulator
