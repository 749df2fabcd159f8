// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/right_image_monitor.hpp"

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr RightImageFit kGood{.in_left = 200, .in_right = 180, .row_error_px = 0.05};
constexpr RightImageFit kElsewhere{.in_left = 200, .in_right = 20, .row_error_px = 0.05};
constexpr RightImageFit kOffItsRows{.in_left = 200, .in_right = 180, .row_error_px = 0.4};

RightImage judge(RightImageMonitor& monitor, const RightImageFit& fit) {
  monitor.begin_frame();
  monitor.add(fit);
  return monitor.judgement();
}

TEST_CASE("Until points show something else, the right image fits", "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  CHECK(monitor.judgement() == RightImage::kFits);
  CHECK(judge(monitor, {}) == RightImage::kFits);
  CHECK(judge(monitor, {.in_left = 29, .in_right = 0, .row_error_px = 0.0}) == RightImage::kFits);
  CHECK(judge(monitor, kGood) == RightImage::kFits);
}

TEST_CASE("A right image in which hardly any point is found is ignored, also the first one",
          "[stereo_slam][slam]") {
  for (const int good_frames : {0, 1, 50}) {
    RightImageMonitor monitor;
    for (int i = 0; i < good_frames; ++i) CHECK(judge(monitor, kGood) == RightImage::kFits);
    CHECK(judge(monitor, kElsewhere) == RightImage::kIgnored);
    CHECK_FALSE(monitor.fits());
  }
}

TEST_CASE("Row errors are judged by what is usual", "[stereo_slam][slam]") {
  const auto judge_after = [](double usual_px, double then_px) {
    RightImageMonitor monitor;
    RightImageFit fit = kGood;
    fit.row_error_px = usual_px;
    for (int i = 0; i < 30; ++i) CHECK(judge(monitor, fit) == RightImage::kFits);
    fit.row_error_px = then_px;
    return judge(monitor, fit);
  };
  CHECK(judge_after(0.05, 0.29) == RightImage::kFits);  // small
  CHECK(judge_after(0.05, 0.31) == RightImage::kIgnored);
  CHECK(judge_after(0.2, 0.59) == RightImage::kFits);  // usual
  CHECK(judge_after(0.2, 0.61) == RightImage::kIgnored);
  CHECK(judge_after(0.5, 1.01) == RightImage::kIgnored);  // never usual
}

TEST_CASE("The usual row error follows the online rectification", "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  RightImageFit fit = kGood;
  fit.row_error_px = 0.9;
  for (int i = 0; i < 3; ++i) CHECK(judge(monitor, fit) == RightImage::kFits);
  for (int i = 0; i < 20; ++i) CHECK(judge(monitor, kGood) == RightImage::kFits);
  CHECK(judge(monitor, kOffItsRows) == RightImage::kIgnored);
}

TEST_CASE("Both kinds of points have to fit", "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  monitor.begin_frame();
  monitor.add(kElsewhere);
  monitor.add(kGood);
  CHECK(monitor.judgement() == RightImage::kIgnored);
  monitor.begin_frame();
  monitor.add(kGood);
  monitor.add(kElsewhere);
  CHECK(monitor.judgement() == RightImage::kIgnored);
}

TEST_CASE("After frames that did not fit as many are doubtful, not counting those without points",
          "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  CHECK(judge(monitor, kGood) == RightImage::kFits);
  for (int i = 0; i < 3; ++i) CHECK(judge(monitor, kOffItsRows) == RightImage::kIgnored);
  CHECK(judge(monitor, {}) == RightImage::kDoubtful);
  for (int i = 0; i < 3; ++i) {
    CHECK(judge(monitor, kGood) == RightImage::kDoubtful);
    CHECK(monitor.fits());
  }
  CHECK(judge(monitor, kGood) == RightImage::kFits);
}

TEST_CASE("Right images are measured in again if none has fitted for twenty frames", "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  CHECK(judge(monitor, kGood) == RightImage::kFits);
  for (int i = 0; i < 20; ++i) CHECK(judge(monitor, kOffItsRows) == RightImage::kIgnored);
  for (int i = 0; i < 5; ++i) {
    CHECK(judge(monitor, kOffItsRows) == RightImage::kDoubtful);
    CHECK_FALSE(monitor.fits());
  }
  CHECK(judge(monitor, kGood) == RightImage::kDoubtful);
}

}  // namespace
}  // namespace stereo_slam
