// SPDX-License-Identifier: MIT
#include "stereo_slam/rig/right_image_monitor.hpp"

#include <cmath>
#include <optional>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

// So many points that their spread is exact.
constexpr RightImageFit kGood{.in_left = 20000, .in_right = 18000, .row_spread_px = 0.05};
constexpr RightImageFit kElsewhere{.in_left = 20000, .in_right = 2000, .row_spread_px = 0.05};
constexpr RightImageFit kScattered{.in_left = 20000, .in_right = 18000, .row_spread_px = 0.4};

RightImage judge(RightImageMonitor& monitor, const RightImageFit& fit) {
  monitor.begin_frame();
  monitor.add(fit);
  return monitor.judgement();
}

TEST_CASE("The fit counts the points, and measures how their row errors scatter", "[stereo_slam][slam]") {
  const RightImageFit nothing = fit_of({});
  CHECK(nothing.in_left == 0);
  CHECK(nothing.in_right == 0);
  CHECK(nothing.row_spread_px == 0.0);
  const RightImageFit fit =
      fit_of({{true, 0.7}, {true, std::nullopt}, {true, 0.4}, {false, std::nullopt}, {true, 0.5}});
  CHECK(fit.in_left == 4);
  CHECK(fit.in_right == 3);
  CHECK(std::abs(fit.row_spread_px - 0.1) < 1e-12);
}

TEST_CASE("Until points show something else, the right image fits", "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  CHECK(monitor.judgement() == RightImage::kFits);
  CHECK(judge(monitor, {}) == RightImage::kFits);
  CHECK(judge(monitor, {.in_left = 29, .in_right = 0, .row_spread_px = 0.0}) == RightImage::kFits);
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

TEST_CASE("After a turn of the right camera images that fit are doubtful, and others ignored",
          "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  CHECK(judge(monitor, kGood) == RightImage::kFits);
  monitor.distrust();
  CHECK(judge(monitor, kGood) == RightImage::kDoubtful);
  CHECK(judge(monitor, kElsewhere) == RightImage::kIgnored);
  for (int i = 0; i < 17; ++i) CHECK(judge(monitor, kGood) == RightImage::kDoubtful);
  CHECK(judge(monitor, kGood) == RightImage::kFits);
}

TEST_CASE("Row errors that scatter are judged by what is usual", "[stereo_slam][slam]") {
  const auto judge_after = [](double usual_px, double then_px) {
    RightImageMonitor monitor;
    RightImageFit fit = kGood;
    fit.row_spread_px = usual_px;
    for (int i = 0; i < 30; ++i) CHECK(judge(monitor, fit) == RightImage::kFits);
    fit.row_spread_px = then_px;
    return judge(monitor, fit);
  };
  CHECK(judge_after(0.05, 0.19) == RightImage::kFits);  // small
  CHECK(judge_after(0.05, 0.21) == RightImage::kIgnored);
  CHECK(judge_after(0.1, 0.29) == RightImage::kFits);  // usual
  CHECK(judge_after(0.1, 0.31) == RightImage::kIgnored);
  CHECK(judge_after(0.5, 1.01) == RightImage::kIgnored);  // never usual
}

TEST_CASE("The usual spread follows the online rectification", "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  RightImageFit fit = kGood;
  fit.row_spread_px = 0.9;
  for (int i = 0; i < 3; ++i) CHECK(judge(monitor, fit) == RightImage::kFits);
  for (int i = 0; i < 20; ++i) CHECK(judge(monitor, kGood) == RightImage::kFits);
  CHECK(judge(monitor, kScattered) == RightImage::kIgnored);
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
  for (int i = 0; i < 3; ++i) CHECK(judge(monitor, kScattered) == RightImage::kIgnored);
  CHECK(judge(monitor, {}) == RightImage::kDoubtful);
  for (int i = 0; i < 3; ++i) {
    CHECK(judge(monitor, kGood) == RightImage::kDoubtful);
    CHECK(monitor.fits());
  }
  CHECK(judge(monitor, kGood) == RightImage::kFits);
}

TEST_CASE("Frames without a right image raise no doubt about those that have one", "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  CHECK(judge(monitor, kGood) == RightImage::kFits);
  for (int i = 0; i < 50; ++i) {
    monitor.begin_frame(/*has_right=*/false);
    monitor.add(kElsewhere);
    CHECK(monitor.judgement() == RightImage::kIgnored);
    CHECK(monitor.fits());
  }
  CHECK(judge(monitor, kGood) == RightImage::kFits);
}

TEST_CASE("Right images in which the points are not found are ignored for as long", "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  CHECK(judge(monitor, kGood) == RightImage::kFits);
  for (int i = 0; i < 50; ++i) CHECK(judge(monitor, kElsewhere) == RightImage::kIgnored);
  CHECK(judge(monitor, kGood) == RightImage::kDoubtful);
}

TEST_CASE("Few row errors scatter by chance", "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  RightImageFit usual = kGood;
  usual.row_spread_px = 0.1;
  CHECK(judge(monitor, usual) == RightImage::kFits);
  const RightImageFit few{.in_left = 40, .in_right = 40, .row_spread_px = 0.33};
  CHECK(judge(monitor, few) == RightImage::kFits);
  const RightImageFit many{.in_left = 400, .in_right = 400, .row_spread_px = 0.36};
  CHECK(judge(monitor, many) == RightImage::kIgnored);
}

TEST_CASE("Right images whose rows scatter are measured in again after twenty frames",
          "[stereo_slam][slam]") {
  RightImageMonitor monitor;
  CHECK(judge(monitor, kGood) == RightImage::kFits);
  for (int i = 0; i < 20; ++i) CHECK(judge(monitor, kScattered) == RightImage::kIgnored);
  for (int i = 0; i < 5; ++i) {
    CHECK(judge(monitor, kScattered) == RightImage::kDoubtful);
    CHECK_FALSE(monitor.fits());
  }
  CHECK(judge(monitor, kGood) == RightImage::kDoubtful);
}

}  // namespace
}  // namespace stereo_slam
