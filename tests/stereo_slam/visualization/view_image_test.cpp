// SPDX-License-Identifier: MIT
#include "stereo_slam/visualization/view_image.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/support/support.hpp"
#include "stereo_slam/visualization/drawing.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr int kSide_px = 400;

/// A camera that drove 40 m ahead, and what belongs to it.
struct Drive {
  StereoCamera camera = test::kitti_camera();
  StereoFrame frame{40, 0, cv::Mat(376, 1241, CV_8UC1, cv::Scalar(60)), {}};
  FrameResult result;
  std::vector<LandmarkTrack> tracks;
  std::vector<PoseGaussian> path;
  std::vector<PathMark> marks;
  std::vector<MapPoint> map;
  std::vector<LoopEvent> loops;

  Drive() {
    for (int k = 0; k <= 40; ++k) {
      path.push_back({at(0.0, k), 1e-4 * Matrix6<double>::Identity()});
      marks.push_back({TrackingStatus::kOk, false});
    }
    result.index = 40;
    result.status = TrackingStatus::kOk;
    result.T_world_camera = path.back();
  }
  [[nodiscard]] static Pose at(double x, double z) {
    return Pose::from_rotation_translation(antipode::Vector4<double>(1, 0, 0, 0), Vector3<double>(x, 0, z));
  }
  [[nodiscard]] ViewScene scene() const { return {camera, frame, result, tracks, path, marks, map, loops}; }
};

[[nodiscard]] int pixels_of(const cv::Mat& image, const cv::Scalar& colour) {
  cv::Mat mask;
  cv::inRange(image, colour, colour, mask);
  return cv::countNonZero(mask);
}

[[nodiscard]] cv::Mat without_legend(const cv::Mat& top_view) { return top_view.rowRange(30, kSide_px); }

TEST_CASE("The view has the image with the tracks, and the map beside it", "[stereo_slam][view]") {
  Drive drive;
  drive.tracks = {{1, {300.0, 100.0}, 4.0, 20, true}, {2, {700.0, 100.0}, 50.0, 20, false}};
  const cv::Mat view = draw_view(drive.scene());
  REQUIRE(view.type() == CV_8UC3);
  CHECK(view.cols == 1241 + view.rows);
  const int top = (view.rows - (376 + 24 + 24)) / 2;  // the image is in the middle
  const auto at = [&](int x, int y) { return cv::Scalar(view.at<cv::Vec3b>(top + y, x)); };
  CHECK(at(300, 100) == depth_colour(4.0, drive.camera.baseline_m));
  CHECK(at(700, 100) == cv::Scalar(60, 60, 60, 0));  // hollow
  CHECK(pixels_of(view.colRange(600, 800), depth_colour(50.0, drive.camera.baseline_m)) > 4);
}

TEST_CASE("Small images are shown larger and large ones smaller", "[stereo_slam][view]") {
  Drive drive;
  drive.frame.left = cv::Mat(132, 434, CV_8UC1, cv::Scalar(60));
  drive.tracks = {{1, {217.0, 66.0}, 4.0, 20, true}};
  const cv::Mat small = draw_view(drive.scene());
  CHECK(small.cols - small.rows == 900);
  CHECK(cv::Scalar(small.at<cv::Vec3b>((small.rows - 48) / 2, 450)) ==
        depth_colour(4.0, drive.camera.baseline_m));
  drive.frame.left = cv::Mat(2000, 4000, CV_8UC1, cv::Scalar(60));
  const cv::Mat large = draw_view(drive.scene());
  CHECK(large.cols - large.rows == 1280);
}

TEST_CASE("Near tracks are red, far ones blue", "[stereo_slam][view]") {
  const cv::Scalar near = depth_colour(1.0, 0.5), far = depth_colour(200.0, 0.5);
  CHECK(near[2] > 150.0);
  CHECK(near[0] < 50.0);
  CHECK(far[0] > far[2]);
  CHECK(depth_colour(0.0, 0.5) == near);
  CHECK(depth_colour(std::numeric_limits<double>::infinity(), 0.5) == far);
}

TEST_CASE("The path has the colours of the statuses", "[stereo_slam][view]") {
  Drive drive;
  const int green = pixels_of(without_legend(draw_top_view(drive.scene(), kSide_px)), kGreen);
  CHECK(green > 100);
  CHECK(pixels_of(without_legend(draw_top_view(drive.scene(), kSide_px)), kRed) == 0);
  for (std::size_t k = 10; k < 20; ++k) drive.marks[k].status = TrackingStatus::kLost;
  const cv::Mat view = without_legend(draw_top_view(drive.scene(), kSide_px));
  CHECK(pixels_of(view, kRed) > green / 6);
  CHECK(pixels_of(view, kGreen) < green);
}

TEST_CASE("Accepted loops of this run are links, others are not", "[stereo_slam][view]") {
  Drive drive;
  for (std::size_t k = 20; k <= 40; ++k) drive.path[k].pose = Drive::at(20.0, 40.0 - static_cast<double>(k));
  LoopEvent loop;
  loop.frame = 39;
  loop.old_frame = 1;
  drive.loops = {loop};
  CHECK(pixels_of(without_legend(draw_top_view(drive.scene(), kSide_px)), kMagenta) == 0);  // refused
  drive.loops[0].accepted = true;
  CHECK(pixels_of(without_legend(draw_top_view(drive.scene(), kSide_px)), kMagenta) > 20);
  drive.loops[0].in_loaded_map = true;
  CHECK(pixels_of(without_legend(draw_top_view(drive.scene(), kSide_px)), kMagenta) == 0);
  drive.loops[0].in_loaded_map = false;
  drive.loops[0].frame = 1000;  // of no frame so far
  CHECK(pixels_of(without_legend(draw_top_view(drive.scene(), kSide_px)), kMagenta) == 0);
}

TEST_CASE("The ellipse of the position grows with the covariance along its axis", "[stereo_slam][view]") {
  Drive drive;
  const auto yellow_box = [&] {
    cv::Mat mask;
    cv::inRange(without_legend(draw_top_view(drive.scene(), kSide_px)), cv::Scalar(0, 150, 160),
                cv::Scalar(40, 255, 255), mask);
    return cv::boundingRect(mask);
  };
  drive.result.T_world_camera.covariance.diagonal() << 0, 0, 0, 4.0, 0.01, 0.25;
  const cv::Rect wide = yellow_box();
  CHECK(wide.width > 2 * wide.height);  // x is to the right
  drive.result.T_world_camera.covariance.diagonal() << 0, 0, 0, 0.25, 0.01, 4.0;
  const cv::Rect high = yellow_box();
  CHECK(high.height > 2 * high.width);
  drive.result.T_world_camera.covariance.setZero();
  CHECK(yellow_box().empty());
  drive.result.T_world_camera.covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
  CHECK(yellow_box().empty());
}

TEST_CASE("Points at the edges of the map and beyond it are drawn or left out", "[stereo_slam][view]") {
  Drive drive;
  MapPoint point;
  for (int i = -3000; i <= 3000; ++i) {
    point.position_world = {0.01 * i, 0.0, 20.0};
    drive.map.push_back(point);
  }
  for (const double far : {-1e300, 1e12, std::numeric_limits<double>::quiet_NaN()}) {
    point.position_world = {far, 0.0, far};
    drive.map.push_back(point);
  }
  const cv::Mat view = draw_top_view(drive.scene(), kSide_px);
  CHECK(pixels_of(view.row(kSide_px / 2), cv::Scalar(110, 110, 110)) > kSide_px - 20);
}

TEST_CASE("A first frame without a path has a view", "[stereo_slam][view]") {
  Drive drive;
  drive.path.clear();
  drive.marks.clear();
  drive.result = {};
  CHECK_FALSE(draw_view(drive.scene()).empty());
}

}  // namespace
}  // namespace stereo_slam
