// SPDX-License-Identifier: MIT
#include "stereo_slam/visualization/debug_image.hpp"

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "stereo_slam/support/support.hpp"
#include "stereo_slam/visualization/debug_image_folder.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

const cv::Size kImage(620, 188);

StereoFrame grey_frame(std::size_t index = 0) {
  StereoFrame frame;
  frame.index = index;
  frame.left = frame.right = cv::Mat(kImage, CV_8UC1, cv::Scalar(100));
  return frame;
}

/// A landmark that should move right by 30 px; `moved` says where it went.
TracedLandmark landmark_at(const Vector2<double>& from_px, const Vector2<double>& moved, bool static_flow) {
  TracedLandmark landmark;
  landmark.predicted_px = from_px + Vector2<double>(30.0, 0.0);
  landmark.flow = {from_px, from_px + moved};
  landmark.static_flow = static_flow;
  landmark.search_covariance_px2 = Vector2<double>(9.0, 4.0).asDiagonal();
  return landmark;
}

/// Strongest lead of a colour channel (blue 0, green 1, red 2) over the other two near a position.
int lead_of(int channel, const cv::Mat& image, const Vector2<double>& px) {
  int lead = -255;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      const auto& colour = image.at<cv::Vec3b>(static_cast<int>(px.y()) + y, static_cast<int>(px.x()) + x);
      lead = std::max(lead, colour[channel] - std::max(colour[(channel + 1) % 3], colour[(channel + 2) % 3]));
    }
  }
  return lead;
}

TEST_CASE("A debug image shows refused flow in red and ellipses of searched landmarks",
          "[stereo_slam][debug_image]") {
  AssociationTrace trace;
  trace.landmarks = {landmark_at({100.0, 50.0}, {31.0, 0.0}, true),
                     landmark_at({300.0, 50.0}, {0.0, 40.0}, false)};
  trace.landmarks[0].matched_px = Vector2<double>(131.0, 50.0);
  const cv::Mat image = draw_debug_image(grey_frame(), FrameResult{}, trace);
  REQUIRE(image.type() == CV_8UC3);
  REQUIRE(image.cols == kImage.width);
  REQUIRE(image.rows > kImage.height);  // the legend is below the image

  constexpr int kRed = 2, kGreen = 1;
  CHECK(lead_of(kRed, image, {300.0, 75.0}) > 50);  // along the refused flow
  const double half_width_px = std::sqrt(kChi2_2_99 * 9.0);
  CHECK(lead_of(kGreen, image, {130.0 + half_width_px, 50.0}) > 50);  // the ellipse's vertex
  CHECK(lead_of(kGreen, image, {330.0 + half_width_px, 50.0}) <= 0);  // none for the refused one
  const auto match = image.at<cv::Vec3b>(50, 131);
  CHECK((match[0] < 80 && match[1] > 180 && match[2] > 180));     // yellow
  CHECK(image.at<cv::Vec3b>(120, 450) == cv::Vec3b(70, 70, 70));  // nothing elsewhere
}

TEST_CASE("Frames without landmarks and narrow frames have a debug image", "[stereo_slam][debug_image]") {
  CHECK(draw_debug_image(grey_frame(), FrameResult{}, {}).cols == kImage.width);
  StereoFrame narrow;
  narrow.left = cv::Mat(40, 64, CV_8UC1, cv::Scalar(100));
  CHECK(draw_debug_image(narrow, FrameResult{}, {}).cols == 64);
}

TEST_CASE("Debug images of an earlier run are replaced once a run has finished, other files stay",
          "[stereo_slam][debug_image]") {
  const test::TemporaryFolder folder;
  for (const auto* name : {"debug_000003.png", "debug_000007.png", "000000.png", "debug_notes.txt"}) {
    test::write_text(folder / name, "of the earlier run");
  }
  CHECK_THAT(test::message_of([&] { DebugImageFolder(folder.path(), false); }),
             Catch::Contains("--overwrite"));
  DebugImageFolder images(folder.path(), true);
  CHECK_THAT(test::message_of([&] { DebugImageFolder(folder.path(), true); }),
             Catch::Contains("another run is writing to it"));
  test::write_text(folder / "unfinished/debug_000000.png", "of a run that was killed");
  FrameResult result;
  result.index = 3;
  images.write(grey_frame(3), result, {});
  CHECK_FALSE(test::fs::exists(folder / "unfinished/debug_000000.png"));
  for (const auto* name : {"debug_000003.png", "debug_000007.png", "000000.png", "debug_notes.txt"}) {
    CHECK(test::read_text(folder / name) == "of the earlier run");
  }
  images.publish();
  CHECK(cv::imread((folder / "debug_000003.png").string()).cols == kImage.width);
  CHECK_FALSE(test::fs::exists(folder / "debug_000007.png"));
  CHECK_FALSE(test::fs::exists(folder / "unfinished"));
  CHECK(test::fs::exists(folder / "000000.png"));
  CHECK(test::fs::exists(folder / "debug_notes.txt"));
}

TEST_CASE("A folder that cannot take debug images is refused by name", "[stereo_slam][debug_image]") {
  const test::TemporaryFolder folder;
  test::write_text(folder / "file", "");
  CHECK_THAT(test::message_of([&] { DebugImageFolder(folder / "file/images", false); }),
             Catch::Contains("file/images") && Catch::Contains("choose another"));
  test::fs::create_directories(folder / "linked");
  test::write_text(folder / "linked/debug_000000.png", "");
  test::fs::create_directory_symlink(folder.path(), folder / "linked/unfinished");
  CHECK_THAT(test::message_of([&] { DebugImageFolder(folder / "linked", true); }),
             Catch::Contains("is a symbolic link"));
}

TEST_CASE("The trace contains the outcome of each landmark", "[stereo_slam][debug_image]") {
  const Vector3<double> z(100.0, 50.0, 10.0);
  const Matrix3<double> part = 4.0 * Matrix3<double>::Identity();
  Association association;
  association.predicted = {{4, z, part, part}, {9, z, part, part}};
  association.flow = {LandmarkFlow{{90.0, 50.0}, {101.0, 50.0}}, LandmarkFlow{{90.0, 50.0}, {90.0, 50.0}}};
  association.search_start_px = {association.flow[0]->to_px, std::nullopt};
  association.matches = {{4, {100.5, 50.0, 10.0}, {100.5, 50.0}, part, association.predicted[0]}};
  const AssociationSettings settings;
  const auto trace = trace_association(association, {{1.0, 2.0}}, settings);
  REQUIRE(trace.landmarks.size() == 2);
  CHECK(trace.landmarks[0].static_flow);
  CHECK(trace.landmarks[0].matched_px->x() == 100.5);
  CHECK(trace.landmarks[0].search_covariance_px2 ==
        innovation_covariance(association.predicted[0], settings).topLeftCorner<2, 2>());
  CHECK_FALSE(trace.landmarks[1].static_flow);
  CHECK_FALSE(trace.landmarks[1].matched_px);
  CHECK(trace.landmarks[1].flow->to_px.x() == 90.0);
  CHECK(trace.odometry_px.size() == 1);
}

}  // namespace
}  // namespace stereo_slam
