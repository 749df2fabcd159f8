// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/repetition.hpp"

#include <opencv2/imgproc.hpp>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("A chessboard repeats itself, whatever the size and place of its squares",
          "[stereo_slam][features]") {
  for (const int side : {8, 16, 24, 40, 64}) {
    for (const double shift : {0.0, 3.0, 11.0}) {
      CAPTURE(side, shift);
      CHECK(repeats_itself(test::chessboard({640, 480}, side, shift)));
      CHECK(repeats_itself(test::chessboard({1241, 376}, side, shift)));
    }
  }
}

TEST_CASE("A noisy chessboard, and one in a scene's middle, repeat themselves", "[stereo_slam][features]") {
  cv::Mat board = test::chessboard({640, 480}, 32, 5.0, 20.0);
  CHECK(repeats_itself(board));
  cv::Mat scene = test::texture_image({1241, 376}, {});
  const cv::Rect middle(300, 0, 640, 376);
  board.rowRange(0, 376).copyTo(scene(middle));
  CHECK(repeats_itself(scene));
}

TEST_CASE("A texture that does not repeat, and an image without one, do not", "[stereo_slam][features]") {
  cv::Mat texture(480, 640, CV_8UC1);
  cv::RNG(1).fill(texture, cv::RNG::UNIFORM, 0, 255);
  CHECK_FALSE(repeats_itself(texture));
  for (const double coarseness_px : {2.0, 8.0, 20.0}) {
    cv::GaussianBlur(texture, texture, {0, 0}, coarseness_px);
    CHECK_FALSE(repeats_itself(texture));
  }
  for (const int grey : {0, 90, 255})
    CHECK_FALSE(repeats_itself(cv::Mat(480, 640, CV_8UC1, cv::Scalar(grey))));
  cv::Mat one_edge(480, 640, CV_8UC1, cv::Scalar(20));
  one_edge.colRange(300, 640).setTo(200);
  CHECK_FALSE(repeats_itself(one_edge));
}

TEST_CASE("Images that are too small to compare do not repeat themselves", "[stereo_slam][features]") {
  CHECK_FALSE(repeats_itself(cv::Mat()));
  for (const int side : {1, 3, 17, 63}) CHECK_FALSE(repeats_itself(test::chessboard({side, side}, 4, 0.0)));
  CHECK_FALSE(repeats_itself(test::chessboard({2000, 9}, 4, 0.0)));
}

TEST_CASE("Of the keyframes of a scene, one in five frames is compared", "[stereo_slam][features]") {
  const cv::Mat board = test::chessboard({640, 480}, 32, 0.0);
  cv::Mat street(480, 640, CV_8UC1);
  cv::RNG(1).fill(street, cv::RNG::UNIFORM, 0, 255);
  SceneRepetition scene;
  CHECK(scene.repeats_itself(board, 0, 1));
  CHECK(scene.repeats_itself(street, 2, 3));  // too soon
  CHECK(scene.repeats_itself(street, 2, 5));
  CHECK_FALSE(scene.repeats_itself(street, 2, 6));
  CHECK_FALSE(scene.repeats_itself(board, 10, 10));
  CHECK(scene.repeats_itself(board, 10, 11));
  CHECK(scene.repeats_itself(street, 10, 50));  // the keyframe was compared already
}

}  // namespace
}  // namespace stereo_slam
