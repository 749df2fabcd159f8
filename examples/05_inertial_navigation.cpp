// SPDX-License-Identifier: MIT
//
// A joint state: pose, velocity, gravity and the biases of an inertial measurement unit (IMU), by gyroscope
// and accelerometer at 100 Hz and a stereo camera at 5 Hz. The camera measures landmarks of the last
// keyframe; all is relative to that, so heading and position in the world are not in the state. A hundred
// simulated flights of a minute each tell whether the covariance is as large as the error.
//
//   state           navigation = {T_keyframe_body, velocity, gravity}, both in the axes of the keyframe: an
//                   element of SE_3(3); and the biases (gyroscope [rad/s], accelerometer [m/s^2])
//   vector          xi = (phi, nu, rho, gamma, b_g, b_a): of navigation exp(xi), and the difference of the
//   biases
//
// The program takes the number of flights as its argument.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <antipode/distributions/keyframe_change.hpp>
#include <antipode/filters/marginal_update.hpp>
#include <antipode/filters/pose_filter.hpp>
#include <antipode/sensors/inertial_propagation.hpp>
#include <antipode/sensors/inverse_depth_landmark.hpp>
#include <antipode/sensors/stereo_camera.hpp>

using namespace antipode;
using Pose = DualQuaternion<double>;
using Vec = Vector3<double>;
using Chart18 = InertialChart<double>;
using State = Chart18::Point;
using Density = StateGaussian<Chart18>;
using Filter = PoseFilter<Density, MysovskikhRule<6>, PoseMarginalUpdate<PosteriorLinearization<double>>>;
using Landmark = InverseDepthLandmark<double>;

namespace {

constexpr double kGravity = 9.81;  // m/s^2
const ImuNoise<double> kImuNoise{
    .gyroscope = 1e-3, .accelerometer = 1e-2, .gyroscope_bias_walk = 1e-5, .accelerometer_bias_walk = 1e-4};
constexpr double kImuStep_s = 0.01;
constexpr int kStepsPerFrame = 20, kFramesPerKeyframe = 5, kLandmarksPerFrame = 12;
const StereoCamera<double> kCamera{450, 450, 376, 240, 0.11};  // 752 x 480 pixels
constexpr double kPixelSigma = 0.5;
const Pose kBodyCamera =  // the body looks ahead along its x axis, the camera along z
    Pose::from_rotation_translation(Vector4<double>(0.5, -0.5, 0.5, -0.5), Vec(0.1, 0.05, 0));

class Noise {
 public:
  explicit Noise(unsigned seed) : rng_(seed) {}
  [[nodiscard]] double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(rng_);
  }
  template <int N>
  [[nodiscard]] Vector<double, N> normal() {
    Vector<double, N> g;
    for (double& entry : g) entry = normal_(rng_);
    return g;
  }

 private:
  std::mt19937 rng_;
  std::normal_distribution<double> normal_;
};

// The flight: position and attitude in the world, z up. The rest follows by differences.
Pose path(double t_s) {
  const Vec position(8 * std::sin(0.3 * t_s), 5 * std::sin(0.4 * t_s), 2 * std::sin(0.5 * t_s));
  const auto turn = [](const Vec& phi) {
    Vector6<double> xi;
    xi << phi, Vec::Zero();
    return Pose::exp(xi);
  };
  const Pose attitude = turn({0, 0, 0.2 * t_s}) * turn({0, 0.2 * std::sin(0.7 * t_s), 0}) *
                        turn({0.3 * std::sin(0.5 * t_s), 0, 0});
  return Pose::from_rotation_translation(attitude.rotation(), position);
}
constexpr double kDifference_s = 1e-3;
Vec velocity(double t_s) {
  return (path(t_s + kDifference_s).translation() - path(t_s - kDifference_s).translation()) /
         (2 * kDifference_s);
}
// What an IMU without noise reads.
ImuSample<double> exact_reading(int step) {
  const double t_s = step * kImuStep_s, h = kDifference_s;
  const Pose now = path(t_s);
  const Vec rate = path(t_s + h).boxminus(path(t_s - h)).head<3>() / (2 * h);
  const Vec acceleration = (velocity(t_s + h) - velocity(t_s - h)) / (2 * h);
  const Vec force = now.rotation_matrix().transpose() * (acceleration + Vec(0, 0, kGravity));
  return {static_cast<std::int64_t>(step) * 10'000'000, rate, force};
}

// The true state relative to the body at `keyframe_s`.
State true_state(double t_s, double keyframe_s, const Vector6<double>& biases) {
  const Pose keyframe = path(keyframe_s);
  const Matrix3<double> back = keyframe.rotation_matrix().transpose();
  return {{keyframe.inverse() * path(t_s), back * velocity(t_s), back * Vec(0, 0, -kGravity)}, biases};
}

// A landmark as it is, and as the keyframe's noisy pixels show it.
struct SeenLandmark {
  Landmark exact, measured;
};
std::vector<SeenLandmark> landmarks_of_keyframe(Noise& noise) {
  const Matrix3<double> R = stereo_pixel_covariance(kPixelSigma);
  const Matrix3<double> root = detail::cholesky_factor<double, 3>(R).value();
  std::vector<SeenLandmark> landmarks;
  for (int i = 0; i < kLandmarksPerFrame * kFramesPerKeyframe; ++i) {
    const double depth_m = noise.uniform(2, 6), u = noise.uniform(0, 752), v = noise.uniform(0, 480);
    const Vec uvd(u, v, kCamera.fx * kCamera.baseline_m / depth_m);
    landmarks.push_back({{kBodyCamera, uvd, R}, {kBodyCamera, uvd + root * noise.normal<3>(), R}});
  }
  return landmarks;
}

// Updates the pose by landmarks [begin, end) of the keyframe. Each landmark is measured in one frame only, so
// that its error counts once.
void update_by_landmarks(Filter& filter, const Pose& T_keyframe_body,
                         const std::vector<SeenLandmark>& landmarks, std::size_t begin, Noise& noise) {
  const Matrix3<double> R = stereo_pixel_covariance(kPixelSigma);
  const Matrix3<double> root = detail::cholesky_factor<double, 3>(R).value();
  const Pose predicted = std::get<0>(filter.density().state).pose * kBodyCamera;
  std::vector<NoisyMeasurement<double, 3>> measurements;
  std::vector<const Landmark*> measured;
  for (std::size_t i = begin; i < begin + kLandmarksPerFrame; ++i) {
    const auto& [exact, seen] = landmarks[i];
    const auto z = exact.project(kCamera, T_keyframe_body * kBodyCamera, exact.mean);
    const auto expected = seen.seen_from(kCamera, predicted);
    if (!z || !expected) continue;
    measurements.push_back({*z + root * noise.normal<3>(), R + expected->covariance});
    measured.push_back(&seen);
  }
  filter.update(GaussianMeasurements(std::move(measurements), [&](const Pose& x, std::size_t i) {
    return measured[i]->project(kCamera, x * kBodyCamera, measured[i]->mean);
  }));
}

// NEES of the parts of the state. Gravity has two degrees of freedom, its length is known.
constexpr std::array kParts{"pose", "velocity", "gravity", "biases", "all but the pose", "all"};
constexpr std::array kBegins{0, 6, 9, 11, 6, 0}, kDims{6, 3, 2, 6, 11, 17};
using PartNees = std::array<double, kParts.size()>;

PartNees nees_of_parts(const Density& belief, const State& truth) {
  const auto& x = std::get<0>(belief.state);
  const Vec down = (x.pose.rotation_matrix().transpose() * x.vectors.col(0)).normalized();
  const Vec across = down.cross(Vec::Unit(std::abs(down[0]) < 0.5 ? 0 : 1)).normalized();
  Matrix<double, 17, 18> parts = Matrix<double, 17, 18>::Zero();  // picks pose, velocity, gravity, biases
  parts.block<3, 3>(0, 0).setIdentity();
  parts.block<3, 3>(3, 6).setIdentity();
  parts.block<3, 3>(6, 3).setIdentity();
  parts.block<1, 3>(9, 9) = across.transpose();
  parts.block<1, 3>(10, 9) = down.cross(across).transpose();
  parts.block<6, 6>(11, 12).setIdentity();
  const Vector<double, 17> e = parts * Chart18::local(belief.state, truth);
  const Matrix<double, 17> P = parts * belief.covariance * parts.transpose();
  PartNees nees{};
  for (std::size_t k = 0; k < kParts.size(); ++k) {
    const auto n = kDims[k], b = kBegins[k];
    using Dynamic = Eigen::MatrixXd;
    const auto L = detail::cholesky_factor<double, Eigen::Dynamic>(Dynamic(P.block(b, b, n, n)));
    nees[k] =
        L ? detail::solve_lower<double, Eigen::Dynamic, 1>(*L, Eigen::VectorXd(e.segment(b, n))).squaredNorm()
          : 0.0;
  }
  return nees;
}

// The state at the start, in motion: gravity is known to two degrees, the velocity to .3 m/s.
Density start_density(const State& truth, Noise& noise) {
  constexpr double kTilt = 0.035, kVelocitySigma = 0.3;
  Density start{truth, {}};
  auto& [navigation, biases] = start.state;
  const Vec tilt = kTilt * noise.normal<3>();
  navigation.vectors = rotate(quaternion_exp(tilt), Vec(navigation.vectors.col(0)));
  navigation.velocity += kVelocitySigma * noise.normal<3>();
  biases.setZero();
  Vector<double, 18> sigma = Vector<double, 18>::Zero();
  sigma.segment<3>(3).setConstant(kVelocitySigma);
  sigma.segment<3>(12).setConstant(2e-3);  // rad/s
  sigma.segment<3>(15).setConstant(0.05);  // m/s^2
  start.covariance = sigma.cwiseAbs2().asDiagonal();
  const Matrix3<double> about = skew(Vec(navigation.vectors.col(0)));
  start.covariance.block<3, 3>(9, 9) = kTilt * kTilt * about * about.transpose();
  return start;
}

struct Flight {
  PartNees nees{};          // at the end
  PartNees after_change{};  // after the last change of keyframe, of which the pose is known exactly
  double velocity_error_m_s = 0.0, tilt_error_rad = 0.0;
};

// One minute.
Flight fly(unsigned seed, int frames) {
  Noise noise(seed);
  Vector6<double> biases;
  biases << 2e-3 * noise.normal<3>(), 0.05 * noise.normal<3>();
  const auto read = [&](int step) {
    auto sample = exact_reading(step);
    const double per_sample = 1.0 / std::sqrt(kImuStep_s);
    sample.angular_velocity += biases.head<3>() + kImuNoise.gyroscope * per_sample * noise.normal<3>();
    sample.specific_force += biases.tail<3>() + kImuNoise.accelerometer * per_sample * noise.normal<3>();
    biases.head<3>() += kImuNoise.gyroscope_bias_walk * std::sqrt(kImuStep_s) * noise.normal<3>();
    biases.tail<3>() += kImuNoise.accelerometer_bias_walk * std::sqrt(kImuStep_s) * noise.normal<3>();
    return sample;
  };
  double keyframe_s = 0.0;
  Filter filter(start_density(true_state(0, 0, biases), noise));
  auto landmarks = landmarks_of_keyframe(noise);
  std::vector<ImuSample<double>> samples{read(0)};
  Flight flight;
  for (int frame = 1; frame <= frames; ++frame) {
    const std::int64_t begin_ns = samples.back().stamp_ns;
    samples.erase(samples.begin(), samples.end() - 1);
    for (int i = 1; i <= kStepsPerFrame; ++i) samples.push_back(read((frame - 1) * kStepsPerFrame + i));
    const auto motion = integrate_imu(samples, {begin_ns, samples.back().stamp_ns},
                                      std::get<1>(filter.density().state), kImuNoise);
    filter.predict(motion, motion.jacobian, motion.noise);

    const double t_s = frame * kStepsPerFrame * kImuStep_s;
    const State truth = true_state(t_s, keyframe_s, biases);
    const auto since_keyframe = static_cast<std::size_t>((frame - 1) % kFramesPerKeyframe);
    update_by_landmarks(filter, std::get<0>(truth).pose, landmarks, since_keyframe * kLandmarksPerFrame,
                        noise);
    filter = Filter(with_gravity_length(filter.density(), kGravity));
    flight.nees = nees_of_parts(filter.density(), truth);

    if (frame % kFramesPerKeyframe != 0) continue;
    filter = Filter(change_keyframe(filter.density()).state);
    keyframe_s = t_s;
    landmarks = landmarks_of_keyframe(noise);
    flight.after_change = nees_of_parts(filter.density(), true_state(t_s, t_s, biases));
  }
  const State truth = true_state(keyframe_s, keyframe_s, biases);
  const auto &estimated = std::get<0>(filter.density().state), &exact = std::get<0>(truth);
  flight.velocity_error_m_s = (estimated.velocity - exact.velocity).norm();
  flight.tilt_error_rad = (estimated.vectors - exact.vectors).norm() / kGravity;
  return flight;
}

void expect(bool holds, const char* what) {
  if (!holds) {
    std::cerr << "unexpected: " << what << '\n';
    std::exit(EXIT_FAILURE);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int flights = argc > 1 ? std::max(1, std::atoi(argv[1])) : 100;
  constexpr int kFrames = 300;
  PartNees sum{}, sum_after{};
  double velocity = 0.0, tilt = 0.0;
  for (int seed = 0; seed < flights; ++seed) {
    const Flight flight = fly(static_cast<unsigned>(seed), kFrames);
    for (std::size_t k = 0; k < kParts.size(); ++k) {
      sum[k] += flight.nees[k] / flights;
      sum_after[k] += flight.after_change[k] / flights;
    }
    velocity += flight.velocity_error_m_s * flight.velocity_error_m_s / flights;
    tilt += flight.tilt_error_rad * flight.tilt_error_rad / flights;
  }
  std::cout << "ANEES of " << flights << " flights at their end; after the last change of keyframe:\n";
  for (std::size_t k = 0; k < kParts.size(); ++k) {
    const double band = 1.96 * std::sqrt(2.0 * kDims[k] / flights);  // of the mean of so many chi-squares
    const bool has_pose = kBegins[k] == 0;                           // known exactly after the change
    std::cout << "  " << kParts[k] << ": " << sum[k] << "; "
              << (has_pose ? "-" : std::to_string(sum_after[k])) << " (" << kDims[k] << " +- " << band
              << " if the covariance is right)\n";
    expect(std::abs(sum[k] - kDims[k]) < band, "the covariance matches the error");
    expect(has_pose || std::abs(sum_after[k] - kDims[k]) < band, "it does after a change of keyframe");
  }
  std::cout << "velocity known to " << std::sqrt(velocity) << " m/s, the vertical to " << std::sqrt(tilt)
            << " rad\n";
  expect(std::sqrt(velocity) < 0.05, "the velocity is known to a few centimetres a second");
  expect(std::sqrt(tilt) < 0.003, "the vertical is known to a tenth of a degree");
}
