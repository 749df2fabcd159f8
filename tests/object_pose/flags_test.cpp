// SPDX-License-Identifier: MIT
#include "object_pose/flags.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "object_pose/belief.hpp"
#include "object_pose/render.hpp"
#include "support/catch.hpp"

namespace {

using namespace object_pose;

/// A stage whose beliefs are all one component at a pose.
Stage stage_at(const Pose& pose) {
  const antipode::Matrix6<double> covariance = 1e-6 * antipode::Matrix6<double>::Identity();
  const Belief belief(Component(pose, covariance));
  return {.match = 0, .verdict = Verdict::kFused, .before = belief, .feature = belief, .after = belief};
}

TEST_CASE("The picture of a stage shows the box and the flags on it", "[object_pose]") {
  const Scene scene = render_scene({}, 2);
  const auto match = match_features(scene.images, scene.camera, learn_features(scene.box)).front();
  const std::optional<Pose> unknown;
  // Black, except where the box is.
  cv::Mat1b left(scene.images.left.size(), 0);
  const auto corners = corners_of(scene.box.size_m);
  std::vector<cv::Point> pixels;
  for (Eigen::Index k = 0; k < corners.cols(); ++k) {
    const Eigen::Vector3d z =
        scene.camera.project_unchecked(scene.T_camera_object * Eigen::Vector3d(corners.col(k)));
    pixels.emplace_back(static_cast<int>(z.x()), static_cast<int>(z.y()));
  }
  left(cv::boundingRect(pixels) & cv::Rect({0, 0}, left.size())).setTo(255);
  const FlagSettings settings;
  const cv::Mat3b picture =
      draw_stage(stage_at(scene.T_camera_object), match,
                 {left, scene.camera, scene.box.size_m, unknown, scene.T_camera_object});
  REQUIRE(picture.size() == cv::Size(2 * settings.panel_px, settings.panel_px));
  // The larger side of the box takes 1 / 1.4 of the panel, and the box is in its middle.
  const auto is_white = [&](int x, int y) { return picture(y, x)[0] > 200 && picture(y, x)[1] > 200; };
  int white = 0, white_in_margin = 0, red = 0;
  for (int y = 30; y < picture.rows; ++y) {
    for (int x = settings.panel_px; x < picture.cols; ++x) {
      const int from_side = std::min({x - settings.panel_px, picture.cols - 1 - x, y, picture.rows - 1 - y});
      const auto& bgr = picture(y, x);
      white += is_white(x, y) ? 1 : 0;
      white_in_margin += is_white(x, y) && from_side < settings.panel_px / 10 ? 1 : 0;
      red += bgr[2] > bgr[0] + 60 && bgr[2] > bgr[1] + 60 ? 1 : 0;
    }
  }
  const double area = settings.panel_px * settings.panel_px;
  CHECK(white / area > 0.2);
  CHECK(white_in_margin == 0);
  CHECK(red > 100);
}

}  // namespace
