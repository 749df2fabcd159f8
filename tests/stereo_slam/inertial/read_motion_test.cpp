// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/read_motion.hpp"

#include <span>

#include "stereo_slam/inertial/motion_fusion.hpp"
#include "stereo_slam/inertial/reading_means.hpp"
#include "stereo_slam/support/flight.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr ImuNoise kNoise{2e-4, 4e-3, 1e-5, 1e-3};
constexpr ImuNoise kSilent{1e-6, 1e-5, 1e-7, 1e-6};
constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// Samples from a second before to a second after the time zero, whose stamps are later by `later_ns`.
[[nodiscard]] std::vector<ImuSample> samples_of(const Flight& flight, std::int64_t later_ns = 0,
                                                const Vector3<double>& offset = Vector3<double>::Zero()) {
  std::vector<ImuSample> samples;
  for (std::int64_t stamp_ns = -kSecond_ns; stamp_ns <= kSecond_ns; stamp_ns += kSample_ns) {
    samples.push_back(flight.reading(stamp_ns, offset));
    samples.back().stamp_ns += later_ns;
  }
  return samples;
}

[[nodiscard]] InertialState state_with_delay(double delay_s) {
  InertialState state = unknown_state();
  auto& x = std::get<0>(state.state);
  x.velocity << 3.0, -2.0, 1.0;
  x.vectors.col(0) << 0.0, 2.0, -9.6;
  std::get<3>(state.state)[0] = delay_s;
  return state;
}

/// The state after the first frame.
[[nodiscard]] InertialChart::Point moved(const std::vector<ImuSample>& samples, const InertialState& state) {
  return step(state, read_motion(samples, {0, kFrame_ns}, state, kNoise)).state.state;
}

}  // namespace

TEST_CASE("Samples that are late by the delay of the state give the same motion", "[inertial]") {
  const Flight flight;
  for (const std::int64_t later_ns : {-20'000'000, 3'000'000, 40'000'000}) {
    const auto late =
        moved(samples_of(flight, later_ns), state_with_delay(1e-9 * static_cast<double>(later_ns)));
    const auto punctual = moved(samples_of(flight), state_with_delay(0.0));
    CHECK((InertialChart::local(punctual, late).head<12>()).norm() < 1e-12);
  }
}

TEST_CASE("A longer delay changes the motion as later samples do, to first order", "[inertial]") {
  const Flight flight;
  const auto samples = samples_of(flight);
  for (const double delay_s : {-0.1, 0.0, 0.2}) {
    constexpr double kStep_s = 1e-3;
    const auto earlier = moved(samples, state_with_delay(delay_s - kStep_s));
    const auto later = moved(samples, state_with_delay(delay_s + kStep_s));
    const antipode::Vector<double, 12> expected =
        InertialChart::local(earlier, later).head<12>() / (2.0 * kStep_s);
    const InertialState state = state_with_delay(delay_s);
    const auto by_delay = read_motion(samples, {0, kFrame_ns}, state, kSilent).by_delay;
    // The readings at the ends are means over 20 ms of rates that change at up to 2 rad/s: sinc(.02) there.
    CHECK((by_delay - expected).norm() < 0.02 * expected.norm());
    CHECK(expected.norm() > 0.1);
  }
}

TEST_CASE("A sensor that is not where the calibration has it moves the state as one that is", "[inertial]") {
  const Flight flight;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3<double> offset = 0.1 * Vector3<double>::Unit(axis);
    InertialState known = state_with_delay(0.0);
    std::get<4>(known.state) = offset;
    const auto expected = moved(samples_of(flight), state_with_delay(0.0));
    const auto corrected = moved(samples_of(flight, 0, offset), known);
    const auto uncorrected = moved(samples_of(flight, 0, offset), state_with_delay(0.0));
    const auto error = [&](const InertialChart::Point& x) {
      return InertialChart::local(expected, x).head<12>().norm();
    };
    // The rates at the ends are means over 20 ms, whose curvature is 1.5 rad/s^3: a part in ten thousand.
    CHECK(error(corrected) < 0.01 * error(uncorrected));
    CHECK(error(uncorrected) > 1e-3);
  }
}

TEST_CASE("At rest the noise of the readings tells nothing of the delay", "[inertial]") {
  std::mt19937_64 random(4);
  const double per_sample = 1.0 / std::sqrt(1e-9 * static_cast<double>(kSample_ns));
  double information = 0.0, as_read = 0.0;
  constexpr int kFrames = 200;
  for (int i = 0; i < kFrames; ++i) {
    auto samples = samples_of(Flight{.shake = 0.0, .travel = 0.0});
    for (auto& sample : samples) {
      sample.angular_velocity += normal3(random, kNoise.gyroscope * per_sample);
      sample.specific_force += normal3(random, kNoise.accelerometer * per_sample);
    }
    const auto read = read_motion(samples, {0, kFrame_ns}, state_with_delay(0.0), kNoise);
    information += read.by_delay.head<3>().squaredNorm() / kFrames;
    as_read += 3.0 * 2.0 * kNoise.gyroscope * kNoise.gyroscope / 0.02 / kFrames;  // of means over 20 ms
  }
  // The usual change is the mean of twenty squares of three axes: the share that exceeds the noise is
  // 0 +- sqrt(2 / 60), of which half is positive. Its square is a hundredth or two.
  CHECK(information < 0.05 * as_read * kFrames);
}

TEST_CASE("Means of readings are those of the lines between samples, held before and after", "[inertial]") {
  const Vector3<double> x = Vector3<double>::UnitX(), z = Vector3<double>::UnitZ();
  const std::vector<ImuSample> samples = {
      {0, 0.0 * x, z}, {10'000'000, 2.0 * x, z}, {20'000'000, 2.0 * x, z}};
  const ReadingMeans means(samples);
  CHECK(means.between(0, 10'000'000)[0] == Approx(1.0));
  CHECK(means.between(0, 20'000'000)[0] == Approx(1.5));
  CHECK(means.between(20'000'000, 50'000'000)[0] == Approx(2.0));
  CHECK(means.between(-30'000'000, -10'000'000)[0] == Approx(0.0).margin(1e-12));
  CHECK(means.between(-10'000'000, 10'000'000)[0] == Approx(0.5));
  CHECK(means.between(-10'000'000, 30'000'000)[5] == Approx(1.0));
  const std::span<const ImuSample> all = samples;
  const ReadingMeans one(all.first(1));
  CHECK(one.between(5, 6)[5] == Approx(1.0));
}

TEST_CASE("Without samples near there is no motion", "[inertial][faults]") {
  const auto samples = samples_of(Flight{});
  const antipode::TimeInterval frame{0, kFrame_ns};
  CHECK(read_motion({}, frame, state_with_delay(0.0), kNoise).motion.status ==
        antipode::InertialStatus::kNoSamples);
  CHECK(read_motion(samples, frame, state_with_delay(2.0), kNoise).motion.status ==
        antipode::InertialStatus::kGap);
  const auto nothing = read_motion(samples, {0, 0}, state_with_delay(0.0), kNoise);
  CHECK(nothing.motion.status == antipode::InertialStatus::kComplete);
  CHECK(nothing.by_delay.isZero(0.0));
}
