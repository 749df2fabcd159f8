// SPDX-License-Identifier: MIT
#include "stereo_slam/images/blended_images.hpp"

#include <opencv2/imgproc.hpp>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr int kMotion_px = 14;  // from one frame to the next

/// A view of a wall that is passed, by frames after the first one.
cv::Mat view(const cv::Mat& wall, double frames, int disparity_px = 0) {
  const int column = static_cast<int>(std::lround(kMotion_px * frames)) + disparity_px;
  return wall(cv::Rect(column, 0, TinySequence::kWidth, TinySequence::kHeight)).clone();
}

/// The weighted mean of two images; `share` is that of the first.
cv::Mat mean_of(const cv::Mat& first, const cv::Mat& second, double share) {
  cv::Mat mean;
  cv::addWeighted(first, share, second, 1.0 - share, 0.0, mean);
  return mean;
}

Echo echo_with(const cv::Mat& wall, double share) {
  const auto image = [&](int i) { return mean_of(view(wall, i), view(wall, i + 1), share); };
  Echo echo;
  for (int i = 0; i < 3; ++i) echo.add(image(i), match_corners(image(i), image(i + 1)));
  return echo;
}

cv::Mat random_wall() { return tiny_texture(TinySequence::kWidth + 100); }

/// The problems of a recording whose images are means of two frames.
std::string problems_with(double share) {
  const TemporaryFolder folder;
  constexpr int kFrames = 5;
  write_tiny_sequence(folder.path(), kFrames);
  const cv::Mat wall = random_wall();
  for (int i = 0; i < kFrames; ++i) {
    for (const auto& [camera, disparity_px] :
         {std::pair("image_0", 0), {"image_1", TinySequence::kDisparity_px}})
      cv::imwrite((folder / camera / frame_name(i)).string(),
                  mean_of(view(wall, i, disparity_px), view(wall, i + 1, disparity_px), share));
  }
  const auto sequence = open_sequence(folder.path(), "auto");
  std::vector<StereoFrame> frames{load_frame(sequence, 0), load_frame(sequence, 1), load_frame(sequence, 4)};
  std::string text;
  for (const auto& problem : problems_of(check_stereo_agreement(frames), sequence, frames))
    text += problem.text + "\n";
  return text;
}

}  // namespace

TEST_CASE("Images of one moment have no echo at the displacement of their points, and means of two have one",
          "[blended]") {
  const cv::Mat wall = random_wall();
  const Echo plain = echo_with(wall, 1.0);
  CHECK(std::abs(plain.strength()) < 0.1);
  CHECK_FALSE(plain.is_of_two_moments());
  for (const double share : {0.5, 0.35, 0.65}) {
    CAPTURE(share);
    CHECK(echo_with(wall, share).is_of_two_moments());
  }
  // A point and its copy with half its contrast, and another one of half the contrast: a correlation of a
  // half.
  CHECK(echo_with(wall, 0.5).strength() == Approx(0.5).margin(0.1));
}

TEST_CASE("Images between which hardly anything moves, or few points are found, are not called blended",
          "[blended]") {
  const cv::Mat wall = random_wall();
  Echo still;
  const cv::Mat both = mean_of(view(wall, 0.0), view(wall, 0.5), 0.5);
  still.add(both, match_corners(both, mean_of(view(wall, 0.5), view(wall, 1.0), 0.5)));  // 7 px a frame
  CHECK(still.strength() == 0.0);
  CHECK_FALSE(still.is_of_two_moments());
  // In one part of the image, as a chessboard where points are mistaken for their neighbours.
  const auto image = [&](int i) { return mean_of(view(wall, i), view(wall, i + 1), 0.5); };
  auto pairs = match_corners(image(0), image(1));
  std::erase_if(pairs, [](const CornerPair& pair) {
    return pair.left_px.x > 0.45F * static_cast<float>(TinySequence::kWidth) ||
           pair.left_px.y > 0.45F * static_cast<float>(TinySequence::kHeight);
  });
  REQUIRE(pairs.size() > 20);
  Echo in_one_part;
  in_one_part.add(image(0), pairs);
  CHECK_FALSE(in_one_part.is_of_two_moments());
}

TEST_CASE("Blended images are named before a run, and others are not", "[blended]") {
  CHECK_THAT(problems_with(1.0), !Catch::Contains("blend"));
  CHECK_THAT(problems_with(0.5), Catch::Contains("the images of image_0 show points twice") &&
                                     Catch::Contains("as if each image were a blend of two moments"));
}
