// SPDX-License-Identifier: MIT
#include "simulator/rendering/scene.hpp"

#include <cmath>
#include <map>
#include <utility>

namespace stereo_slam::simulator {
namespace {

[[nodiscard]] Eigen::AlignedBox3f bounding_box(const Face& face) {
  Eigen::AlignedBox3f box;
  for (int i = 0; i < face.corner_count; ++i) box.extend(face.corners[static_cast<std::size_t>(i)]);
  return box;
}

}  // namespace

Eigen::AlignedBox3f bounding_box(const std::vector<Face>& faces) {
  Eigen::AlignedBox3f box;
  for (const Face& face : faces) box.extend(bounding_box(face));
  return box;
}

std::vector<Chunk> make_chunks(const std::vector<Face>& faces, double size_m) {
  std::map<std::pair<int, int>, std::vector<Face>> cells;
  std::vector<Face> large;
  for (const Face& face : faces) {
    const auto box = bounding_box(face);
    if (box.sizes().maxCoeff() > static_cast<float>(size_m)) {
      large.push_back(face);
      continue;
    }
    const Eigen::Vector3d centre = box.center().cast<double>();
    cells[{static_cast<int>(std::floor(centre.x() / size_m)),
           static_cast<int>(std::floor(centre.z() / size_m))}]
        .push_back(face);
  }
  std::vector<Chunk> chunks;
  for (auto& [cell, members] : cells) {
    const auto bounds = bounding_box(members);
    chunks.push_back({bounds, std::move(members)});
  }
  if (!large.empty()) {
    const auto bounds = bounding_box(large);
    chunks.push_back({bounds, std::move(large)});
  }
  return chunks;
}

}  // namespace stereo_slam::simulator
