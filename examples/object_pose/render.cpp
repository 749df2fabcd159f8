// SPDX-License-Identifier: MIT
#include "render.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "artwork.hpp"

namespace object_pose {
namespace {

constexpr int kSupersampling = 3;
constexpr double kWallDistance_m = 2.6;

/// A textured rectangle that a camera sees.
struct Panel {
  cv::Mat texture;
  Eigen::Vector2d size_m;
  Pose T_camera_panel;
};

/// The homography from texture pixels to pixels of the supersampled image; pixel centres are integers in
/// both.
Eigen::Matrix3d homography(const Panel& panel, const StereoCamera& camera) {
  Eigen::Matrix3d panel_texture;
  const double dx = panel.size_m.x() / panel.texture.cols, dy = panel.size_m.y() / panel.texture.rows;
  panel_texture << dx, 0, 0.5 * (dx - panel.size_m.x()),  //
      0, dy, 0.5 * (dy - panel.size_m.y()),               //
      0, 0, 1;
  Eigen::Matrix3d camera_panel;
  camera_panel << panel.T_camera_panel.rotation_matrix().leftCols<2>(), panel.T_camera_panel.translation();
  Eigen::Matrix3d K;
  K << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  const double s = kSupersampling, shift = 0.5 * (s - 1.0);
  Eigen::Matrix3d finer;
  finer << s, 0, shift, 0, s, shift, 0, 0, 1;
  return finer * K * camera_panel * panel_texture;
}

/// The bounding box of the texture in the image.
cv::Rect covered(const Eigen::Matrix3d& H, cv::Size texture, cv::Size image) {
  Eigen::Matrix<double, 3, 4> outline;
  outline << 0, texture.width, 0, texture.width,  //
      0, 0, texture.height, texture.height,       //
      1, 1, 1, 1;
  const Eigen::Matrix<double, 2, 4> seen = (H * outline).colwise().hnormalized();
  const Eigen::Vector2d lower = seen.rowwise().minCoeff(), upper = seen.rowwise().maxCoeff();
  const cv::Rect box(cv::Point(cvFloor(lower.x()) - 1, cvFloor(lower.y()) - 1),
                     cv::Point(cvCeil(upper.x()) + 2, cvCeil(upper.y()) + 2));
  return box & cv::Rect({0, 0}, image);
}

void paint(const Panel& panel, const StereoCamera& camera, cv::Mat1b& image) {
  Eigen::Matrix3d H = homography(panel, camera);
  const cv::Rect part = covered(H, panel.texture.size(), image.size());
  if (part.empty()) return;
  H.row(0) -= part.x * H.row(2);
  H.row(1) -= part.y * H.row(2);
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = H;
  const cv::Matx33d warp(rows.data());
  cv::Mat1b target = image(part);
  cv::warpPerspective(panel.texture, target, warp, part.size(), cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
}

/// The faces turned towards the camera, with their shading. A box is convex: none of them hides another.
std::vector<Panel> visible_faces(const BoxModel& box, const Pose& T_camera_object) {
  const Eigen::Vector3d to_light = Eigen::Vector3d(-0.4, -0.7, -1.0).normalized();
  std::vector<Panel> panels;
  for (const auto& face : box.faces) {
    const Pose T_camera_face = T_camera_object * face.T_object_face;
    const Eigen::Vector3d inward = T_camera_face.rotation_matrix().col(2);
    if (inward.dot(T_camera_face.translation()) <= 0.0) continue;
    const double brightness = 0.6 + 0.4 * std::max(0.0, -inward.dot(to_light));
    panels.push_back({face.texture * brightness, face.size_m, T_camera_face});
  }
  return panels;
}

cv::Mat1b photograph(const std::vector<Panel>& panels, const StereoCamera& camera, double gain, double noise,
                     std::mt19937_64& rng) {
  cv::Mat1b fine(camera.height_px * kSupersampling, camera.width_px * kSupersampling, std::uint8_t{0});
  for (const auto& panel : panels) paint(panel, camera, fine);
  cv::Mat1b image;
  cv::resize(fine, image, {camera.width_px, camera.height_px}, 0, 0, cv::INTER_AREA);
  cv::RNG sensor(rng());
  cv::Mat1f grain(image.size());
  sensor.fill(grain, cv::RNG::NORMAL, 0.0, noise);
  cv::Mat1f exposed;
  image.convertTo(exposed, CV_32F, gain);
  exposed += grain;
  exposed.convertTo(image, CV_8U);
  return image;
}

}  // namespace

Pose random_pose(const SceneSettings& settings, std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Eigen::Vector4d q;
  for (double& value : q) value = normal(rng);
  const double share = 0.5 * (1.0 + uniform(rng));
  const double distance_m =
      settings.min_distance_m + share * (settings.max_distance_m - settings.min_distance_m);
  const double x = 0.1 * uniform(rng), y = 0.07 * uniform(rng);
  const Eigen::Vector3d between_cameras(0.5 * settings.camera.baseline_m, 0.0, 0.0);
  const Eigen::Vector3d direction = Eigen::Vector3d(x, y, 1.0).normalized();
  return Pose::from_rotation_translation(q.normalized(), between_cameras + distance_m * direction);
}

StereoImages render_stereo(const BoxModel& box, const Pose& T_camera_object, const SceneSettings& settings,
                           std::mt19937_64& rng) {
  constexpr double kRightGain = 0.96;  // two cameras are never equally bright
  const cv::Mat1b wall = paint_wall({1600, 1200}, rng);
  std::vector<Panel> left = {
      {wall,
       {3.4, 2.55},
       Pose::from_matrix(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, kWallDistance_m))}};
  for (auto& panel : visible_faces(box, T_camera_object)) left.push_back(std::move(panel));

  const Pose T_right_left =
      Pose::from_matrix(Eigen::Matrix3d::Identity(), Eigen::Vector3d(-settings.camera.baseline_m, 0, 0));
  std::vector<Panel> right = {left.front()};
  right.front().T_camera_panel = T_right_left * left.front().T_camera_panel;
  // A face may be visible to one camera only. Its brightness is the same for both.
  for (auto& panel : visible_faces(box, T_right_left * T_camera_object)) right.push_back(std::move(panel));
  StereoImages images;
  images.left = photograph(left, settings.camera, 1.0, settings.noise_grey_levels, rng);
  images.right = photograph(right, settings.camera, kRightGain, settings.noise_grey_levels, rng);
  return images;
}

Scene render_scene(const SceneSettings& settings, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  Scene scene{print_box(BoxSize::Constant(0.2), rng), settings.camera, random_pose(settings, rng), {}};
  scene.images = render_stereo(scene.box, scene.T_camera_object, settings, rng);
  return scene;
}

}  // namespace object_pose
