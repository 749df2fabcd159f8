// SPDX-License-Identifier: MIT
#include "stereo_slam/results/camera_warnings.hpp"

#include "support/catch.hpp"

using namespace stereo_slam;

namespace {

[[nodiscard]] RunSummary with_lens(double k1, double sigma) {
  RunSummary summary;
  summary.rig.lens_error = LensEstimate{.k = {k1, 0.02}, .sigma = {sigma, 0.001}};
  return summary;
}

}  // namespace

TEST_CASE("Cameras that fit their calibration give no warning", "[results][cameras]") {
  CHECK(camera_warnings({}).empty());
  CHECK(camera_warnings(with_lens(-0.029, 0.001)).empty());  // KITTI 00
  CHECK(camera_warnings(with_lens(0.021, 0.002)).empty());   // EuRoC MH_01
  CHECK(camera_warnings(with_lens(-0.2, 0.05)).empty());     // uncertain
}

TEST_CASE("A radial distortion that no good calibration leaves is told with its size and likely causes",
          "[results][cameras]") {
  for (const double k1 : {-0.21, 0.1}) {
    const auto texts = camera_warnings(with_lens(k1, 0.012));
    REQUIRE(texts.size() == 1);
    CHECK_THAT(texts[0], Catch::Contains(fmt::format("a radial distortion of about k1 = {:.2f}", k1)) &&
                             Catch::Contains("check the distortion model that the calibration names"));
  }
}

TEST_CASE("A delay, a displacement and a turn of the right camera are told if they are noticeable",
          "[results][cameras]") {
  RunSummary summary;
  summary.rig.right_delay = DelayEstimate{.seconds = 0.02, .sigma_s = 0.001};
  summary.rig.right_image_displacement_px = -0.3;
  const auto texts = camera_warnings(summary);
  REQUIRE(texts.size() == 2);
  CHECK_THAT(texts[0], Catch::Contains("were exposed 20.0 ms later than the left ones"));
  CHECK_THAT(texts[1], Catch::Contains("is 0.3 px farther left than the calibration says"));
  summary.right_camera_turns = {7, 9};
  CHECK_THAT(camera_warnings(summary).at(1),
             Catch::Contains("turned shortly before frame 7, and 1 more time"));
  summary.rig.right_delay->sigma_s = 0.02;
  CHECK(camera_warnings(summary).size() == 1);
}
