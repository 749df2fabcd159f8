// SPDX-License-Identifier: MIT
// Bags that other programs wrote: those in the folder witness, by the scripts there.
#include <algorithm>

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/support/support.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr int kWidth = 32;
constexpr int kHeight = 16;
constexpr int kWitnessFrames = 4;
constexpr std::int64_t kFirstWitness_ns = 1'700'000'000'000'000'000;

[[nodiscard]] cv::Mat witness_image(int side, int frame) {
  cv::Mat image(kHeight, kWidth, CV_8UC1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      image.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>((3 * x + 5 * y + 17 * frame + 101 * side) % 256);
  }
  return image;
}

[[nodiscard]] bool same_image(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() &&
         std::equal(a.begin<std::uint8_t>(), a.end<std::uint8_t>(), b.begin<std::uint8_t>());
}

}  // namespace

TEST_CASE("Bags of other programs have the frames, the calibration and the topics that these wrote",
          "[bags]") {
  std::vector<fs::path> bags;
  for (const auto& entry : fs::directory_iterator(WITNESS_BAGS)) {
    if (is_bag_recording(entry.path())) bags.push_back(entry.path());
  }
  CHECK(bags.size() == 15);
  for (const auto& bag : bags) {
    CAPTURE(bag.string());
    const auto scan = scan_bag(bag, {});
    for (const auto& problem : scan.problems) FAIL(problem.text);
    CHECK(scan.sequence.camera.fx == 40.0);
    CHECK(scan.sequence.camera.baseline_m == 0.25);
    REQUIRE(scan.sequence.frames.size() == kWitnessFrames);
    for (int i = 0; i < kWitnessFrames; ++i) {
      const auto frame = load_frame(scan.sequence, static_cast<std::size_t>(i));
      CHECK(frame.stamp_ns == kFirstWitness_ns + 100'000'000LL * i);
      CHECK(same_image(frame.left, witness_image(0, i)));
      CHECK(same_image(frame.right, witness_image(1, i)));
    }
    const auto topics = list_topics(bag);
    REQUIRE(topics.size() == 5);
    CHECK(topics[0].name == "/imu");
    CHECK_THAT(topics[0].type, Catch::StartsWith("sensor_msgs/") && Catch::EndsWith("Imu"));
    CHECK(topics[2].rate_hz == Approx(3 / 0.3302));  // from the first /imu to the last right image
    CHECK(std::ranges::all_of(topics, [](const auto& topic) { return topic.messages == kWitnessFrames; }));
  }
}
