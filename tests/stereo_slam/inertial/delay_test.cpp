// SPDX-License-Identifier: MIT
// The delay between camera and IMU, as a state of the filter.
#include <algorithm>
#include <cmath>
#include <vector>

#include "stereo_slam/inertial/inertial_filter.hpp"
#include "stereo_slam/support/inertial_tracker.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("The standard deviation of the delay is half a millisecond after ten seconds, and right",
          "[inertial]") {
  double nees = 0.0;
  const std::vector<std::int64_t> delays_ms = {-20, -10, 0, 10, 20};
  for (const std::int64_t later_ms : delays_ms) {
    Tracker tracker(Flight{}, static_cast<std::uint64_t>(31 + later_ms));
    tracker.distort = [&](ImuSample& sample) { sample.stamp_ns += later_ms * 1'000'000; };
    tracker.ahead = 30'000'000 / kSample_ns;
    tracker.run(200);
    const InertialSummary& summary = tracker.filter().summary();
    const double error_s = summary.delay_s - 1e-3 * static_cast<double>(later_ms);
    CAPTURE(later_ms, summary.delay_s, summary.delay_sigma_s);
    CHECK(phase(tracker) == InertialPhase::kRunning);
    CHECK(summary.restarts == 0);
    CHECK(std::abs(error_s) < 4.0 * summary.delay_sigma_s);
    CHECK(summary.delay_sigma_s < 5e-4);
    CHECK(tracker.error().head<3>().norm() < 0.05);
    nees += std::pow(error_s / summary.delay_sigma_s, 2) / static_cast<double>(delays_ms.size());
  }
  CHECK(nees < 1.0 + 4.0 * std::sqrt(2.0 / 5.0));  // the mean of five chi-squares
}

TEST_CASE("A delay that the start finds is right within its standard deviation, large as it may be",
          "[inertial]") {
  double nees = 0.0;
  constexpr int kFlights = 20;
  for (int i = 0; i < kFlights; ++i) {
    const std::int64_t later_ms = i % 2 == 0 ? -25 : 25;
    Tracker tracker(Flight{.shake = 2.0, .travel = 2.0}, static_cast<std::uint64_t>(60 + i));
    tracker.distort = [&](ImuSample& sample) { sample.stamp_ns += later_ms * 1'000'000; };
    tracker.ahead = 40'000'000 / kSample_ns;
    while (phase(tracker) != InertialPhase::kRunning && tracker.frames() < 100)
      tracker.run(tracker.frames() + 1);
    const InertialSummary& summary = tracker.filter().summary();
    REQUIRE(summary.phase == InertialPhase::kRunning);
    const double error_s = summary.delay_s - 1e-3 * static_cast<double>(later_ms);
    nees += std::pow(error_s / summary.delay_sigma_s, 2) / kFlights;
  }
  CHECK(nees < 1.0 + 4.0 * std::sqrt(2.0 / kFlights));  // the mean of chi-squares
}

TEST_CASE("Without samples after the frame, late stamps seem later, and nothing else is wrong",
          "[inertial]") {
  for (const std::int64_t later_ms : {-20, 10, 20}) {
    CAPTURE(later_ms);
    Tracker tracker(Flight{}, 51);
    tracker.distort = [&](ImuSample& sample) { sample.stamp_ns += later_ms * 1'000'000; };
    tracker.ahead = -later_ms * 1'000'000 / kSample_ns;  // up to the stamp of the frame
    tracker.run(300);
    const InertialSummary& summary = tracker.filter().summary();
    CHECK(summary.phase == InertialPhase::kRunning);
    CHECK(summary.restarts == 0);
    CHECK(tracker.error().head<3>().norm() < 0.05);
    CHECK(nees(tracker, 0) < 11.3);  // 99 % of a chi-square of three
    // A rate that is held for the time u misses slope u^2 / 2, as a delay of u^2 / (2 T) does over a frame.
    const double held_s = std::max(summary.delay_s, 0.0);
    const double as_delay_s = held_s * held_s / (2e-9 * static_cast<double>(kFrame_ns));
    const double error_s = summary.delay_s - 1e-3 * static_cast<double>(later_ms) - as_delay_s;
    CHECK(std::abs(error_s) < 4.0 * summary.delay_sigma_s);
  }
}

TEST_CASE("At rest the delay stays as uncertain as it was", "[inertial]") {
  Tracker tracker(Flight{.shake = 0.0, .travel = 0.0}, 37);
  tracker.distort = [](ImuSample& sample) { sample.stamp_ns += 20'000'000; };
  tracker.ahead = 30'000'000 / kSample_ns;
  tracker.run(400);
  REQUIRE(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.filter().summary().delay_sigma_s > 0.5 * kUnknownDelaySigma_s);
}

TEST_CASE("A delay too large for a first-order correction is found by the rotations", "[inertial]") {
  for (const std::int64_t later_ms : {-80, 80}) {
    Tracker tracker(Flight{}, 17);
    tracker.distort = [&](ImuSample& sample) { sample.stamp_ns += later_ms * 1'000'000; };
    tracker.ahead = 100'000'000 / kSample_ns;
    tracker.run(300);
    const InertialSummary& summary = tracker.filter().summary();
    CAPTURE(later_ms, summary.delay_s);
    CHECK(phase(tracker) == InertialPhase::kRunning);
    CHECK(std::abs(summary.delay_s - 1e-3 * static_cast<double>(later_ms)) < 1e-3);
    CHECK(tracker.error().head<3>().norm() < 0.1);
  }
}
