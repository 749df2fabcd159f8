// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include <Eigen/Cholesky>

#include <antipode/geometry/jacobians.hpp>

#include "stereo_slam/inertial/inertial_filter.hpp"
#include "stereo_slam/support/flight.hpp"

/// The filter of an IMU in use.
namespace stereo_slam::test {

/// Standard deviations of what the images measure.
constexpr double kOdometry_rad = 1e-3, kOdometry_m = 3e-3, kLandmarks_rad = 1e-3, kLandmarks_m = 4e-3;
constexpr int kFramesPerKeyframe = 15;

/// The camera in the axes of the IMU: another place, other axes.
[[nodiscard]] inline Pose T_camera_imu() {
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
  /// The pose of the last keyframe relative to the first one, with the tilt that gravity tells.
  [[nodiscard]] const LinkedPose& path() const { return path_; }
  /// The same without.
  [[nodiscard]] const LinkedPose& path_of_images() const { return path_of_images_; }
  /// The error of the vertical in the axes of the last keyframe on a path, and its covariance.
  struct TiltError {
    Vector2<double> rad;
    antipode::Matrix<double, 2> covariance;
  };
  [[nodiscard]] TiltError tilt_error(const LinkedPose& path) const {
    const auto [pose, P] = path.estimate;
    const Vector3<double> v = T_world_camera(0).rotation_matrix().transpose() * Vector3<double>::UnitZ();
    const Vector3<double> u = pose.rotation_matrix().transpose() * v;
    antipode::Matrix<double, 2, 3> across;
    across << u.unitOrthogonal().transpose(), u.cross(u.unitOrthogonal()).transpose();
    const antipode::Matrix<double, 2, 3> by_turn = across * antipode::skew(u);
    const Pose T_first_keyframe = T_world_camera(0).inverse() * T_world_camera(keyframe_);
    return {across * (T_first_keyframe.rotation_matrix().transpose() * v - u),
            by_turn * P.topLeftCorner<3, 3>() * by_turn.transpose()};
  }
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
    const LevelledLink link = filter_.change_keyframe(seen.T_keyframe_camera);
    path_ = add_link(path_, link.T_previous_keyframe, false, link.tilt);
    path_of_images_ = compose(path_of_images_, seen.T_keyframe_camera);
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
  LinkedPose path_, path_of_images_;
  std::vector<Pose> drifted_;  // of each frame: the pose of the IMU in the images, seen from the true one
  Vector6<double> prior_error_ = Vector6<double>::Constant(std::numeric_limits<double>::quiet_NaN());
  int frame_ = 0, keyframe_ = 0, seen_ = 0, contradictions_ = 0;
};

[[nodiscard]] inline InertialPhase phase(const Tracker& tracker) { return tracker.filter().summary().phase; }

/// e^T P^-1 e for a block of the estimate.
[[nodiscard]] inline double nees(const Tracker& tracker, int block) {
  const Vector3<double> e = tracker.error().segment<3>(block);
  const Matrix3<double> P = tracker.filter().estimate().covariance.block<3, 3>(block, block);
  return e.dot(P.ldlt().solve(e));
}

}  // namespace stereo_slam::test
