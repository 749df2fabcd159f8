// SPDX-License-Identifier: MIT
// Images whose rows, or pixels, alternate between two pictures.
#include <random>

#include <opencv2/imgproc.hpp>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/images/grey_image.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

cv::Mat noise_image(double sigma, int smoothing_px) {
  cv::Mat image(120, 320, CV_8UC1);
  cv::RNG random(7);
  random.fill(image, cv::RNG::NORMAL, 128.0, sigma);
  if (smoothing_px > 0) cv::GaussianBlur(image, image, {}, smoothing_px);
  return image;
}

/// The even rows of one image and the odd ones of another.
cv::Mat interlaced(const cv::Mat& first, const cv::Mat& second) {
  cv::Mat image = first.clone();
  for (int y = 1; y < image.rows; y += 2) second.row(y).copyTo(image.row(y));
  return image;
}

cv::Mat moved(const cv::Mat& image, double columns) {
  cv::Mat result;
  cv::warpAffine(image, result, cv::Matx23d(1, 0, columns, 0, 1, 0), image.size(), cv::INTER_LINEAR,
                 cv::BORDER_REFLECT);
  return result;
}

/// What is said of the tiny recording whose images were changed so.
std::string problems_after(const std::function<cv::Mat(const cv::Mat&)>& change) {
  const TemporaryFolder folder;
  write_tiny_sequence(folder.path(), 4);
  for (int i = 0; i < 4; ++i) {
    for (const auto* camera : {"image_0", "image_1"}) {
      const std::string file = folder / camera / frame_name(i);
      cv::imwrite(file, change(cv::imread(file, cv::IMREAD_GRAYSCALE)));
    }
  }
  const auto sequence = open_sequence(folder.path(), "auto");
  std::vector<StereoFrame> frames{load_frame(sequence, 0), load_frame(sequence, 2)};
  std::string text;
  for (const auto& problem : problems_of(check_stereo_agreement(frames), sequence, frames))
    text += problem.text + "\n";
  return text;
}

}  // namespace

TEST_CASE("Rows of one moment do not alternate, and independent ones hardly", "[alternation]") {
  const auto smooth = alternation_of(noise_image(60.0, 2));
  CHECK(smooth.rows > 0.4);  // of a ramp it is a half
  CHECK(smooth.rows < 0.8);
  CHECK_FALSE(smooth.is_interlaced());
  // The mean of 38000 differences has a standard error of less than a hundredth.
  const auto noise = alternation_of(noise_image(40.0, 0));
  CHECK(noise.rows == Approx(1.0).margin(0.03));
  CHECK(noise.columns == Approx(1.0).margin(0.03));
  CHECK_FALSE((noise.is_interlaced() || noise.is_mosaic()));
  CHECK(alternation_of(cv::Mat(120, 320, CV_8UC1, cv::Scalar(7.0))).rows == 0.0);
  CHECK(alternation_of(cv::Mat(2, 320, CV_8UC1, cv::Scalar(7.0))).rows == 0.0);
}

TEST_CASE("Rows of two moments alternate if the camera moved, and not if it stood", "[alternation]") {
  const cv::Mat scene = noise_image(80.0, 2);
  CHECK(alternation_of(interlaced(scene, moved(scene, 6.0))).is_interlaced());
  CHECK_FALSE(alternation_of(interlaced(scene, scene)).is_interlaced());
}

TEST_CASE("A mosaic of colours alternates in rows and in columns", "[alternation]") {
  cv::Mat mosaic = noise_image(80.0, 2);
  for (int y = 0; y < mosaic.rows; ++y) {
    for (int x = (y + 1) % 2; x < mosaic.cols; x += 2)
      mosaic.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(mosaic.at<std::uint8_t>(y, x) / 2);
  }
  const auto found = alternation_of(mosaic);
  CHECK(found.is_mosaic());
  CHECK_FALSE(found.is_interlaced());
}

TEST_CASE("Interlaced images and mosaics are named before a run", "[alternation]") {
  CHECK_THAT(problems_after([](const cv::Mat& image) { return image; }),
             !Catch::Contains("rows next to each"));
  CHECK_THAT(problems_after([](const cv::Mat& image) { return interlaced(image, moved(image, 5.0)); }),
             Catch::Contains("in 2 of 2 compared images rows next to each other differ") &&
                 Catch::Contains("as in interlaced video"));
  CHECK_THAT(problems_after([](const cv::Mat& image) {
               cv::Mat result = image.clone();
               for (int y = 0; y < image.rows; ++y) {
                 for (int x = (y + 1) % 2; x < image.cols; x += 2)
                   result.at<std::uint8_t>(y, x) =
                       static_cast<std::uint8_t>(image.at<std::uint8_t>(y, x) / 3);
               }
               return result;
             }),
             Catch::Contains("as in the raw mosaic of a colour camera"));
}
