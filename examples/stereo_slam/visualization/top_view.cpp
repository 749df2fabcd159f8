// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/visualization/drawing.hpp"
#include "stereo_slam/visualization/view_image.hpp"

namespace stereo_slam {
namespace {

constexpr double kChi2_2_95 = 5.991;

/// Maps the world's x and z, in metres, to pixels of a square image with z up.
class GroundPlane {
 public:
  GroundPlane(std::span<const PoseGaussian> path, double least_m, int side_px) : side_px_(side_px) {
    constexpr double kMargin = 1.3;
    Vector2<double> low = Vector2<double>::Constant(std::numeric_limits<double>::infinity());
    Vector2<double> high = -low;
    for (const auto& pose : path) {
      const Vector2<double> at = ground(pose.pose.translation());
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    if (path.empty()) low = high = Vector2<double>::Zero();
    centre_m_ = 0.5 * (low + high);
    px_per_m_ = side_px / std::max(least_m, kMargin * (high - low).maxCoeff());
  }

  [[nodiscard]] static Vector2<double> ground(const Vector3<double>& p_world) {
    return {p_world.x(), p_world.z()};
  }
  [[nodiscard]] double px_per_m() const { return px_per_m_; }
  [[nodiscard]] Vector2<double> px(const Vector3<double>& p_world) const {
    const Vector2<double> d = px_per_m_ * (ground(p_world) - centre_m_);
    return {0.5 * side_px_ + d.x(), 0.5 * side_px_ - d.y()};
  }
  [[nodiscard]] bool contains(const Vector2<double>& px) const {
    return px.x() >= 0.0 && px.x() < side_px_ && px.y() >= 0.0 && px.y() < side_px_;
  }

 private:
  int side_px_;
  Vector2<double> centre_m_;
  double px_per_m_ = 1.0;
};

void draw_map(cv::Mat& canvas, const ViewScene& scene, const GroundPlane& plane) {
  constexpr std::size_t kMost = 20'000;
  const cv::Vec3b grey(110, 110, 110);
  const std::size_t step = 1 + scene.map.size() / kMost;
  for (std::size_t i = 0; i < scene.map.size(); i += step) {
    const Vector2<double> at_px = plane.px(scene.map[i].position_world);
    if (plane.contains(at_px))
      canvas.at<cv::Vec3b>(static_cast<int>(at_px.y()), static_cast<int>(at_px.x())) = grey;
  }
  const auto& camera = scene.camera;
  for (const auto& track : scene.tracks) {
    const double disparity_px = camera.fx * camera.baseline_m / track.depth_m;
    const Vector3<double> p_camera =
        camera.back_project({track.left_px.x(), track.left_px.y(), disparity_px});
    const Vector2<double> at_px = plane.px(scene.result.T_world_camera.pose * p_camera);
    if (plane.contains(at_px)) draw_dot(canvas, at_px, 1.5, depth_colour(track.depth_m, camera.baseline_m));
  }
}

void draw_path(cv::Mat& canvas, const ViewScene& scene, const GroundPlane& plane) {
  const std::size_t frames = std::min(scene.path.size(), scene.marks.size());
  const auto at = [&](std::size_t k) { return plane.px(scene.path[k].pose.translation()); };
  for (std::size_t k = 1; k < frames; ++k) {
    cv::line(canvas, subpixel(at(k - 1)), subpixel(at(k)), colour_of(scene.marks[k].status), 2, cv::LINE_8,
             kSubpixelBits);
  }
  for (std::size_t k = 0; k < frames; ++k) {
    if (scene.marks[k].is_keyframe) draw_dot(canvas, at(k), 1.5, kWhite);
  }
  for (const auto& loop : scene.loops) {
    if (!loop.accepted || loop.in_loaded_map || loop.frame >= frames || loop.old_frame >= frames) continue;
    cv::line(canvas, subpixel(at(loop.frame)), subpixel(at(loop.old_frame)), kMagenta, 1, cv::LINE_AA,
             kSubpixelBits);
    draw_dot(canvas, at(loop.frame), 3.0, kMagenta);
  }
}

/// Draws the camera as a triangle, and the ellipse of its position. Returns the factor by which the ellipse
/// is enlarged.
double draw_camera(cv::Mat& canvas, const PoseGaussian& T_world_camera, const GroundPlane& plane) {
  constexpr double kSize_px = 9.0;
  constexpr double kSmallest_px = 8.0;
  constexpr double kMost = 1e6;
  const Matrix3<double> R = T_world_camera.pose.rotation_matrix();
  const Vector2<double> at_px = plane.px(T_world_camera.pose.translation());
  std::vector<cv::Point> corners;
  for (const auto& [x, z] : {std::pair(0.0, 1.0), std::pair(-0.6, -0.7), std::pair(0.6, -0.7)}) {
    const Vector3<double> d = R * Vector3<double>(x, 0.0, z);
    corners.push_back(subpixel(at_px + kSize_px * Vector2<double>(d.x(), -d.z())));
  }
  cv::fillConvexPoly(canvas, corners, kWhite, cv::LINE_AA, kSubpixelBits);

  const Matrix3<double> P = R * T_world_camera.covariance.bottomRightCorner<3, 3>() * R.transpose();
  Matrix2<double> ground;
  ground << P(0, 0), -P(0, 2), -P(2, 0), P(2, 2);  // the sign of z changes: z points up, image rows down
  ground *= plane.px_per_m() * plane.px_per_m();
  const double largest_px = std::sqrt(kChi2_2_95 * ground.trace());
  if (!(largest_px > 0.0) || !std::isfinite(largest_px)) return 1.0;
  double enlarged = 1.0;
  for (int step = 0; enlarged * largest_px < kSmallest_px && enlarged < kMost; ++step) {
    enlarged *= step % 3 == 1 ? 2.5 : 2.0;  // 2, 5, 10, 20, ...
  }
  if (largest_px * enlarged < canvas.cols) {
    draw_ellipse(canvas, at_px, enlarged * enlarged * ground, kChi2_2_95, kYellow);
  }
  return enlarged;
}

/// Draws a scale bar of 1, 2 or 5 times a power of ten metres.
void draw_scale(cv::Mat& canvas, const GroundPlane& plane) {
  const double longest_m = canvas.cols / 4.0 / plane.px_per_m();
  const double power_m = std::pow(10.0, std::floor(std::log10(longest_m)));
  const double factor = longest_m >= 5.0 * power_m ? 5.0 : longest_m >= 2.0 * power_m ? 2.0 : 1.0;
  const int length_px = static_cast<int>(std::lround(factor * power_m * plane.px_per_m()));
  const cv::Point from(12, canvas.rows - 14);
  cv::line(canvas, from, from + cv::Point(length_px, 0), kWhite, 2);
  cv::putText(canvas, fmt::format("{:g} m", factor * power_m), from + cv::Point(0, -6),
              cv::FONT_HERSHEY_SIMPLEX, 0.4, kWhite, 1, cv::LINE_AA);
}

}  // namespace

cv::Mat draw_top_view(const ViewScene& scene, int side_px) {
  constexpr double kLeast_baselines = 40.0;
  cv::Mat canvas(side_px, side_px, CV_8UC3, kBackground);
  const GroundPlane plane(scene.path, kLeast_baselines * scene.camera.baseline_m, side_px);
  draw_map(canvas, scene, plane);
  draw_path(canvas, scene, plane);
  const double enlarged = draw_camera(canvas, scene.result.T_world_camera, plane);
  draw_scale(canvas, plane);
  const auto ellipse = enlarged > 1.0 ? fmt::format("95 % ellipse x {:g}", enlarged) : "95 % ellipse";
  const cv::Mat legend = draw_legend({{"from above", kWhite},
                                      {"OK", kGreen},
                                      {"WEAK", kYellow},
                                      {"LOST", kRed},
                                      {"loop", kMagenta},
                                      {ellipse, kYellow}},
                                     side_px);
  legend.copyTo(canvas(cv::Rect(0, 0, legend.cols, legend.rows)));
  return canvas;
}

}  // namespace stereo_slam
