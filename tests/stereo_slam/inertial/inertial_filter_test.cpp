// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/inertial_filter.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include "stereo_slam/support/flight.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr double kOdometry_rad = 1e-3, kOdometry_m = 3e-3, kLandmarks_rad = 1e-3, kLandmarks_m = 4e-3;
constexpr int kFramesPerKeyframe = 15;

/// The camera in the axes of the IMU: another place, other axes.
[[nodiscard]] Pose T_camera_imu() {
  Vector6<double> xi;
  xi << 1.2, -1.2, 1.2, 0.05, -0.02, 0.1;
  return Pose::exp(xi);
}

/// The filter in use: a camera measures its motion and the keyframe's landmarks in every frame.
class Tracker {
 public:
  explicit Tracker(const Flight& flight, std::uint64_t seed = 1) : flight_(flight), random_(seed) {
    biases_ << normal3(random_, 0.02), normal3(random_, 0.1);
  }

  std::function<void(ImuSample&)> distort = [](ImuSample&) {};  ///< what is wrong with the IMU
  std::function<bool(int)> sees = [](int) { return true; };     ///< whether there is an image in a frame
  std::function<bool(int)> reads = [](int) { return true; };    ///< whether there are samples

  /// What each motion in the images has wrong, in the axes of the IMU.
  Vector6<double> drift = Vector6<double>::Zero();
  std::int64_t ahead = 0;  ///< samples after the frame that it gets
  std::function<bool(int)> follows_vehicle = [](int) { return false; };  ///< 30 m/s past the camera

  /// Processes frames until the number of frames is `end`.
  void run(int end) {
    for (; frame_ < end; ++frame_) process();
  }

  [[nodiscard]] const InertialFilter& filter() const { return filter_; }
  [[nodiscard]] int frames() const { return frame_; }
  [[nodiscard]] double time() const { return 1e-9 * static_cast<double>((frame_ - 1) * kFrame_ns); }
  [[nodiscard]] const antipode::Vector6<double>& biases() const { return biases_; }
  /// (velocity, gravity, biases) less the truth.
  [[nodiscard]] antipode::Vector<double, 12> error() const {
    const InertialEstimate estimate = filter_.estimate();
    antipode::Vector<double, 12> e;
    e << estimate.velocity - flight_.velocity(time()), estimate.gravity - flight_.gravity(time()),
        estimate.biases - biases_;
    return e;
  }
  /// The error of the last pose relative to the keyframe, if the filter predicted it.
  [[nodiscard]] const Vector6<double>& prior_error() const { return prior_error_; }
  /// Frames whose measured motion was not used.
  [[nodiscard]] int contradictions() const { return contradictions_; }

 private:
  [[nodiscard]] Pose T_world_camera(int frame) const {
    return flight_.T_world_imu(1e-9 * static_cast<double>(frame * kFrame_ns)) * T_camera_imu().inverse();
  }
  /// The pose as the images show it.
  [[nodiscard]] Pose shown(int frame) const {
    return T_world_camera(frame) * T_camera_imu() * drifted_[static_cast<std::size_t>(frame)] *
           T_camera_imu().inverse();
  }
  void drift_to(int frame) {
    if (frame == 0) return drifted_.push_back(Pose::identity());
    const Pose motion = T_camera_imu().inverse() * T_world_camera(frame - 1).inverse() *
                        T_world_camera(frame) * T_camera_imu();
    drifted_.push_back(motion.inverse() * drifted_.back() * motion * Pose::exp(drift));
  }
  [[nodiscard]] ImuReadings readings() {
    ImuReadings imu{.sensor = {.T_camera_imu = T_camera_imu(), .noise = {2e-4, 4e-3, 1e-5, 1e-3}},
                    .samples = {}};
    for (std::int64_t i = frame_ == 0 ? -40 : 1 + ahead; i <= 10 + ahead; ++i) {
      ImuSample sample = flight_.reading((frame_ - 1) * kFrame_ns + i * kSample_ns);
      const double per_sample = 1.0 / std::sqrt(1e-9 * static_cast<double>(kSample_ns));
      sample.angular_velocity += biases_.head<3>() + normal3(random_, 2e-4 * per_sample);
      sample.specific_force += biases_.tail<3>() + normal3(random_, 4e-3 * per_sample);
      distort(sample);
      if (reads(frame_)) imu.samples.push_back(sample);
    }
    return imu;
  }
  void process() {
    const std::int64_t stamp_ns = frame_ * kFrame_ns;
    drift_to(frame_);
    filter_.begin_frame(stamp_ns, readings());
    if (frame_ == 0) {
      filter_.begin_map(0);
      return;
    }
    if (!sees(frame_)) {
      if (filter_.predicted()) note(filter_.prior(std::nullopt));
      return;  // the next frame is predicted from the last one that was seen
    }
    const Pose T_previous_current = shown(seen_).inverse() * shown(frame_);
    SeenFrame seen{.stamp_ns = stamp_ns, .T_keyframe_camera = {}, .by_landmarks = true};
    PoseGaussian odometry = measured(T_previous_current, kOdometry_rad, kOdometry_m, random_);
    if (follows_vehicle(frame_)) odometry.pose = odometry.pose.boxplus(Vector6<double>::Unit(5) * 1.5);
    std::optional<InertialPrior> prior;
    if (filter_.predicted()) prior = filter_.prior(odometry);
    if (prior) note(*prior);
    contradictions_ += prior && prior->contradicts ? 1 : 0;
    const Pose T_keyframe_camera = shown(keyframe_).inverse() * shown(frame_);
    const PoseGaussian z = measured(T_keyframe_camera, kLandmarks_rad, kLandmarks_m, random_);
    seen.T_keyframe_camera = prior ? fused(prior->T_keyframe_camera, z) : z;
    if (!prior || !prior->contradicts) seen.T_previous_current = odometry;
    filter_.end_frame(seen, prior);
    seen_ = frame_;
    if (frame_ - keyframe_ < kFramesPerKeyframe) return;
    keyframe_ = frame_;
    filter_.change_keyframe();
  }
  void note(const InertialPrior& prior) {
    prior_error_ = prior.T_keyframe_camera.pose.boxminus(shown(keyframe_).inverse() * shown(frame_));
  }
  [[nodiscard]] static PoseGaussian fused(const PoseGaussian& prior, const PoseGaussian& z) {
    const Matrix6<double> S = prior.covariance + z.covariance;
    const Matrix6<double> gain = prior.covariance * S.inverse();
    const Matrix6<double> P = prior.covariance - gain * prior.covariance;
    return {prior.pose.boxplus(gain * z.pose.boxminus(prior.pose)), 0.5 * (P + P.transpose())};
  }

  Flight flight_;
  std::mt19937_64 random_;
  antipode::Vector6<double> biases_;
  InertialFilter filter_;
  std::vector<Pose> drifted_;  // of each frame: the pose of the IMU in the images, seen from the true one
  Vector6<double> prior_error_ = Vector6<double>::Constant(std::numeric_limits<double>::quiet_NaN());
  int frame_ = 0, keyframe_ = 0, seen_ = 0, contradictions_ = 0;
};

[[nodiscard]] InertialPhase phase(const Tracker& tracker) { return tracker.filter().summary().phase; }

/// e^T P^-1 e for a block of the estimate.
[[nodiscard]] double nees(const Tracker& tracker, int block) {
  const Vector3<double> e = tracker.error().segment<3>(block);
  const Matrix3<double> P = tracker.filter().estimate().covariance.block<3, 3>(block, block);
  return e.dot(P.ldlt().solve(e));
}

}  // namespace

TEST_CASE("Velocity, gravity and biases are found in motion within a second or two", "[inertial]") {
  Tracker tracker(Flight{}, 3);
  tracker.run(40);
  REQUIRE(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.error().head<3>().norm() < 0.1);                  // m/s
  CHECK(tracker.error().segment<3>(3).norm() / kGravity < 0.03);  // rad
  tracker.run(400);
  CHECK(tracker.error().head<3>().norm() < 0.05);
  CHECK(tracker.error().segment<3>(3).norm() / kGravity < 0.01);
  CHECK(tracker.error().segment<3>(6).norm() < 2e-3);
  CHECK(tracker.filter().summary().starts == 1);
  CHECK(tracker.filter().summary().restarts == 0);
}

TEST_CASE("They are found at rest, too", "[inertial]") {
  Tracker tracker(Flight{.shake = 0.0, .travel = 0.0}, 5);
  tracker.run(60);
  REQUIRE(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.error().head<3>().norm() < 0.05);
  CHECK(tracker.error().segment<3>(3).norm() / kGravity < 0.05);  // the bias of the accelerometer tilts it
}

TEST_CASE("The covariance is as large as the error", "[inertial]") {
  constexpr int kFlights = 60;
  double velocity = 0.0, gyroscope = 0.0, accelerometer = 0.0;
  for (int seed = 0; seed < kFlights; ++seed) {
    Tracker tracker(Flight{}, static_cast<std::uint64_t>(100 + seed));
    tracker.run(200);
    REQUIRE(phase(tracker) == InertialPhase::kRunning);
    velocity += nees(tracker, 0) / kFlights;
    gyroscope += nees(tracker, 6) / kFlights;
    accelerometer += nees(tracker, 9) / kFlights;
  }
  // Means of 60 chi-squares of three degrees of freedom: 3 +- 3.3 * sqrt(6 / 60). The filter doubles the
  // noise of the IMU, as it is no white noise in real motion, and so errors may be smaller.
  constexpr double kMost = 3.0 + 1.04;
  CHECK(velocity < kMost);
  CHECK(velocity > 0.5);
  CHECK(gyroscope < kMost);
  CHECK(accelerometer < kMost);
}

TEST_CASE("An error that the motions of all images have in common does not pass for a bias", "[inertial]") {
  constexpr int kFlights = 60;
  constexpr double kShare = 0.1;  // of the noise of a motion, as ImageDrift has it
  double velocity = 0.0, gyroscope = 0.0, accelerometer = 0.0, largest_rad_s = 0.0;
  for (int seed = 0; seed < kFlights; ++seed) {
    Tracker tracker(Flight{}, static_cast<std::uint64_t>(300 + seed));
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    tracker.drift << normal3(random, kShare * kOdometry_rad), normal3(random, kShare * kOdometry_m);
    tracker.run(200);
    REQUIRE(phase(tracker) == InertialPhase::kRunning);
    velocity += nees(tracker, 0) / kFlights;
    gyroscope += nees(tracker, 6) / kFlights;
    accelerometer += nees(tracker, 9) / kFlights;
    largest_rad_s = std::max(largest_rad_s, tracker.error().segment<3>(6).norm());
  }
  constexpr double kMost = 3.0 + 1.04;  // as without such errors
  CHECK(velocity < kMost);
  CHECK(gyroscope < kMost);
  CHECK(accelerometer < kMost);
  CHECK(largest_rad_s > kShare * kOdometry_rad / (1e-9 * kFrame_ns));  // the error is there
}

TEST_CASE("A second without images is bridged to two centimetres", "[inertial]") {
  Tracker tracker(Flight{}, 7);
  tracker.sees = [](int frame) { return frame < 300 || frame >= 320; };
  tracker.run(320);
  CHECK(tracker.prior_error().tail<3>().norm() < 0.02);
  tracker.run(330);
  CHECK(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.filter().summary().starts == 1);
}

TEST_CASE("Missing samples cost the velocity until it is found again, and nothing else", "[inertial]") {
  Tracker tracker(Flight{}, 9);
  tracker.reads = [](int frame) { return frame < 200 || frame >= 204; };
  tracker.run(205);
  CHECK(phase(tracker) == InertialPhase::kStarting);
  tracker.run(260);
  CHECK(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.filter().summary().starts == 2);
  CHECK(tracker.filter().summary().restarts == 0);
  CHECK(tracker.error().head<3>().norm() < 0.1);
}

TEST_CASE("Readings that contradict the images are switched off, and their fault is named", "[inertial]") {
  struct Case {
    std::string fault;
    std::function<void(ImuSample&)> distort;
  };
  const Matrix3<double> quarter = (Matrix3<double>() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished();
  const Flight flight;
  const std::vector<Case> cases = {
      {"in degrees", [](ImuSample& s) { s.angular_velocity *= 57.29578; }},
      {"in multiples of gravity", [](ImuSample& s) { s.specific_force /= 9.80665; }},
      {"turned by 90 degrees",
       [&](ImuSample& s) {
         s.angular_velocity = quarter * s.angular_velocity;
         s.specific_force = quarter * s.specific_force;
       }},
      {"turned by 180 degrees",
       [&](ImuSample& s) {
         s.angular_velocity = quarter * quarter * s.angular_velocity;
         s.specific_force = quarter * quarter * s.specific_force;
       }},
  };
  for (const auto& [fault, distort] : cases) {
    Tracker tracker(flight, 11);
    tracker.distort = distort;
    tracker.run(400);
    INFO(fault << ": " << tracker.filter().summary().fault);
    CHECK(phase(tracker) == InertialPhase::kOff);
    CHECK(tracker.filter().summary().fault.find(fault) != std::string::npos);
    CHECK_FALSE(tracker.filter().predicted());
  }
}

TEST_CASE("Axes that are turned by some degrees are found, and cost nothing", "[inertial]") {
  constexpr double kDegree = 0.0174533;
  for (const double degrees : {0.0, 2.0, 10.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      CAPTURE(degrees, axis);
      const Vector3<double> turn = degrees * kDegree * Vector3<double>::Unit(axis);
      Vector6<double> xi = Vector6<double>::Zero();
      xi.head<3>() = turn;
      const Matrix3<double> R = Pose::exp(xi).rotation_matrix();
      Tracker tracker(Flight{}, static_cast<std::uint64_t>(21 + axis));
      tracker.distort = [&](ImuSample& sample) {  // the sensor reads in axes that are turned
        sample.angular_velocity = (R.transpose() * sample.angular_velocity).eval();
        sample.specific_force = (R.transpose() * sample.specific_force).eval();
      };
      tracker.run(300);
      const InertialSummary& summary = tracker.filter().summary();
      CHECK(summary.phase == InertialPhase::kRunning);
      CHECK(summary.restarts == 0);
      // Three numbers: 4 sigma. Fifteen seconds tell them to a quarter of a degree.
      CHECK(((summary.turn_rad - turn).cwiseAbs() - 4.0 * summary.turn_sigma_rad).maxCoeff() < 0.0);
      CHECK(summary.turn_sigma_rad.maxCoeff() < 0.25 * kDegree);
      CHECK(tracker.error().head<3>().norm() < 0.05);
    }
  }
}

TEST_CASE("An IMU that is some centimetres off its place is found by its turns", "[inertial]") {
  const Flight flight;
  for (int axis = 0; axis < 3; ++axis) {
    CAPTURE(axis);
    const Vector3<double> offset = 0.03 * Vector3<double>::Unit(axis);
    Tracker tracker(flight, static_cast<std::uint64_t>(41 + axis));
    tracker.distort = [&](ImuSample& sample) {
      sample.specific_force += flight.reading(sample.stamp_ns, offset).specific_force -
                               flight.reading(sample.stamp_ns).specific_force;
    };
    tracker.run(600);
    const InertialSummary& summary = tracker.filter().summary();
    CHECK(summary.restarts == 0);
    CHECK(((summary.offset_m - offset).cwiseAbs() - 4.0 * summary.offset_sigma_m).maxCoeff() < 0.0);
    CHECK(summary.offset_sigma_m.maxCoeff() < 0.01);  // half of the prior's
    CHECK(tracker.error().head<3>().norm() < 0.05);
  }
}

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

TEST_CASE("A motion that is not the camera's is not used where landmarks agree with the IMU", "[inertial]") {
  Tracker tracker(Flight{}, 13);
  tracker.follows_vehicle = [](int frame) { return frame >= 200 && frame < 220; };
  tracker.run(220);
  CHECK(tracker.contradictions() == 20);
  CHECK(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.filter().summary().restarts == 0);
  CHECK(tracker.error().head<3>().norm() < 0.05);
}

TEST_CASE("Bad samples do not reach the state", "[inertial]") {
  Tracker tracker(Flight{}, 15);
  int count = 0;
  tracker.distort = [&](ImuSample& sample) {
    if (++count % 7 == 0) sample.specific_force.x() = std::numeric_limits<double>::quiet_NaN();
    if (count % 11 == 0) sample.stamp_ns -= 20'000'000;
  };
  tracker.run(200);
  CHECK(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.error().allFinite());
  CHECK(tracker.error().head<3>().norm() < 0.2);
}

TEST_CASE("Without readings there is nothing to predict with", "[inertial]") {
  InertialFilter filter;
  filter.begin_frame(0, std::nullopt);
  filter.begin_map(0);
  filter.begin_frame(kFrame_ns, std::nullopt);
  CHECK_FALSE(filter.predicted());
  filter.end_frame({.stamp_ns = kFrame_ns, .T_keyframe_camera = {}}, std::nullopt);
  CHECK(filter.summary().phase == InertialPhase::kNone);
  CHECK(filter.estimate().phase == InertialPhase::kNone);
}
