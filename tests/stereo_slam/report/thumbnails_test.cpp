// SPDX-License-Identifier: MIT
#include "stereo_slam/report/thumbnails.hpp"

#include <opencv2/imgcodecs.hpp>

#include "support/catch.hpp"

using namespace stereo_slam;

namespace {

std::string encoded(std::string_view text) { return report::base64({text.begin(), text.end()}); }

}  // namespace

TEST_CASE("Images of a run of any length are few and spread evenly", "[report]") {
  for (const std::size_t frames : {1U, 5U, 239U, 241U, 5000U}) {
    CAPTURE(frames);
    report::Thumbnails thumbnails;
    for (std::size_t k = 0; k < frames; ++k)
      thumbnails.offer(
          {.index = k, .stamp_ns = 0, .left = cv::Mat(10, 20, CV_8UC1, cv::Scalar(128)), .right = {}});
    const auto& images = thumbnails.images();
    REQUIRE_FALSE(images.empty());
    CHECK(images.size() <= report::Thumbnails::kMost);
    CHECK(images.size() >= std::min<std::size_t>(frames / 4, 30));
    for (std::size_t i = 1; i < images.size(); ++i)
      CHECK(images[i].frame - images[i - 1].frame == images[1].frame - images[0].frame);
    CHECK(frames - images.back().frame <= frames / 30 + 4);
  }
}

TEST_CASE("A small image keeps its shape", "[report]") {
  const cv::Mat wide =
      cv::imdecode(report::small_jpeg(cv::Mat(376, 1241, CV_8UC1, cv::Scalar(90))), cv::IMREAD_GRAYSCALE);
  CHECK(wide.size() == cv::Size(200, 61));
  CHECK(std::abs(wide.at<std::uint8_t>(30, 100) - 90) <= 2);
  const cv::Mat small =
      cv::imdecode(report::small_jpeg(cv::Mat(30, 40, CV_8UC1, cv::Scalar(0))), cv::IMREAD_GRAYSCALE);
  CHECK(small.size() == cv::Size(40, 30));
  CHECK(report::small_jpeg(cv::Mat(1, 5000, CV_8UC1, cv::Scalar(0))).size() > 100);
}

TEST_CASE("base64 is that of RFC 4648", "[report]") {
  CHECK(encoded("").empty());
  CHECK(encoded("f") == "Zg==");
  CHECK(encoded("fo") == "Zm8=");
  CHECK(encoded("foo") == "Zm9v");
  CHECK(encoded("foobar") == "Zm9vYmFy");
  CHECK(encoded("\xff\xfe\xfd") == "//79");
}
