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
    const auto images = thumbnails.images();
    REQUIRE_FALSE(images.empty());
    CHECK(images.size() <= report::Thumbnails::kMost);
    CHECK(images.size() >= std::min<std::size_t>(frames / 4, 30));
    for (std::size_t i = 1; i < images.size(); ++i)
      CHECK(images[i].frame - images[i - 1].frame == images[1].frame - images[0].frame);
    CHECK(frames - images.back().frame <= frames / 30 + 4);
  }
}

TEST_CASE("A small image keeps its shape and its grey", "[report]") {
  const auto compressed = [](int rows, int cols) {
    const cv::Mat image(rows, cols, CV_8UC1, cv::Scalar(90));
    return cv::imdecode(report::to_jpeg(report::small_image(image)), cv::IMREAD_GRAYSCALE);
  };
  CHECK(compressed(376, 1241).size() == cv::Size(177, 53));
  CHECK(std::abs(compressed(376, 1241).at<std::uint8_t>(30, 100) - 90) <= 2);
  CHECK(compressed(30, 40).size() == cv::Size(40, 30));
  CHECK(compressed(1, 5000).size() == cv::Size(5000, 1));
}

TEST_CASE("base64 is that of RFC 4648", "[report]") {
  CHECK(encoded("").empty());
  CHECK(encoded("f") == "Zg==");
  CHECK(encoded("fo") == "Zm8=");
  CHECK(encoded("foo") == "Zm9v");
  CHECK(encoded("foobar") == "Zm9vYmFy");
  CHECK(encoded("\xff\xfe\xfd") == "//79");
}
