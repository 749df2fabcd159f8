// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/pose_by_flow.hpp"

#include <cstddef>

#include <opencv2/calib3d.hpp>

#include <antipode/opencv/pose.hpp>

namespace stereo_slam {

std::optional<FlowPose> pose_by_flow(const std::vector<PredictedLandmark>& predicted,
                                     const std::vector<std::optional<LandmarkFlow>>& flow, const MapView& map,
                                     const LensResidual& lens) {
  constexpr int kDraws = 100;               // with a half of them wrong, one in eight samples is right
  constexpr float kLargestError_px = 3.0F;  // of a static point, with that of its depth
  constexpr double kConfidence = 0.999;
  constexpr std::size_t kFewest = 12;  // as of the odometry
  constexpr std::size_t kShare = 3;    // one in so many agrees at least

  std::vector<std::size_t> indices;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    const Landmark& landmark = map.landmarks[predicted[i].index];
    const HomogeneousPoint point = to_point(landmark, landmark.mean, map.camera);
    if (!flow[i] || !(point.w > 0.0)) continue;
    const Vector3<double> position = point.x / point.w;
    const Vector2<double> px = lens.corrected(flow[i]->to_px);
    indices.push_back(i);
    points.emplace_back(position.x(), position.y(), position.z());
    pixels.emplace_back(px.x(), px.y());
  }
  if (points.size() < kFewest) return std::nullopt;
  const StereoCamera& camera = map.camera;
  const cv::Matx33d K(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
  cv::Mat rotation, translation;
  std::vector<int> inliers;
  const bool found = cv::solvePnPRansac(points, pixels, K, cv::noArray(), rotation, translation, false,
                                        kDraws, kLargestError_px, kConfidence, inliers, cv::SOLVEPNP_AP3P);
  if (!found || inliers.size() < std::max(kFewest, points.size() / kShare)) return std::nullopt;
  if (!cv::checkRange(rotation) || !cv::checkRange(translation)) return std::nullopt;
  FlowPose result{antipode::pose_from_cv<double>(rotation, translation).inverse(),
                  std::vector<std::uint8_t>(predicted.size(), 0)};
  for (const int i : inliers) result.agrees[indices[static_cast<std::size_t>(i)]] = 1;
  return result;
}

}  // namespace stereo_slam
