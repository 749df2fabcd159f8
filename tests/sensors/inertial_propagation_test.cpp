// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <vector>

#include <antipode/detail/cholesky.hpp>
#include <antipode/sensors/inertial_propagation.hpp>
#include <antipode/testing/check_jacobian.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/matrix_exponential.hpp"
#include "support/no_allocation.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

using Sample = ImuSample<double>;
using Samples = std::vector<Sample>;
using Motion = InertialMotion<double>;
using Navigation = Motion::Navigation;
using Square = Motion::Square;
using Biases = Vector6<double>;
using FlightState = InertialChart<double>::Point;

constexpr std::int64_t kMillisecond = 1'000'000;
const ImuNoise<double> kNoise{1e-3, 2e-2, 3e-4, 4e-3};

[[nodiscard]] Navigation random_navigation(Rng& rng) {
  Navigation x;
  x.pose = random_pose<double>(rng);
  x.velocity = random_matrix<double, 3, 1>(rng, 5.0);
  x.vectors = 9.81 * random_unit<double, 3>(rng);
  return x;
}

/// Samples of constant readings from begin to end.
[[nodiscard]] Samples constant_readings(const Vector3<double>& w, const Vector3<double>& a,
                                        std::int64_t begin_ns, std::int64_t end_ns, std::int64_t step_ns) {
  Samples samples;
  for (std::int64_t t = begin_ns; t <= end_ns; t += step_ns) samples.push_back({t, w, a});
  return samples;
}

/// (R, v, p, g) after dt by the exponential of its linear equation: [R v p g]' = [R v p g] B.
[[nodiscard]] Matrix<double, 3, 6> exactly_moved(const Navigation& x, const Vector3<double>& w,
                                                 const Vector3<double>& a, double dt) {
  Matrix<double, 6> B = Matrix<double, 6>::Zero();
  B.topLeftCorner<3, 3>() = skew(w);
  B.block<3, 1>(0, 3) = a;
  B(5, 3) = B(3, 4) = 1.0;
  Matrix<double, 3, 6> X;
  X << x.pose.rotation_matrix(), x.columns();
  return X * matrix_exponential<6>(dt * B);
}

/// The matrix A of the error's linear equation with biases, xi' = A xi.
[[nodiscard]] Square error_equation(const Vector3<double>& w, const Vector3<double>& a) {
  Square A = Square::Zero();
  for (const int part : {0, 3, 6, 9}) A.block<3, 3>(part, part) = -skew(w);
  A.block<3, 3>(3, 0) = -skew(a);
  A.block<3, 3>(3, 9).setIdentity();
  A.block<3, 3>(6, 3).setIdentity();
  A.block<3, 3>(0, 12).diagonal().setConstant(-1.0);
  A.block<3, 3>(3, 15).diagonal().setConstant(-1.0);
  return A;
}

/// Van Loan: the covariance of the noise over dt by one exponential of twice the size.
[[nodiscard]] Square exact_noise(const Square& A, const ImuNoise<double>& noise, double dt) {
  Vector<double, 18> densities = Vector<double, 18>::Zero();
  densities.segment<3>(0).setConstant(noise.gyroscope);
  densities.segment<3>(3).setConstant(noise.accelerometer);
  densities.segment<3>(12).setConstant(noise.gyroscope_bias_walk);
  densities.segment<3>(15).setConstant(noise.accelerometer_bias_walk);
  Matrix<double, 36> M = Matrix<double, 36>::Zero();
  M.topLeftCorner<18, 18>() = -dt * A;
  M.topRightCorner<18, 18>() = dt * Square(densities.cwiseAbs2().asDiagonal());
  M.bottomRightCorner<18, 18>() = dt * A.transpose();
  const Matrix<double, 36> E = matrix_exponential<36>(M);
  const Square F = E.bottomRightCorner<18, 18>().transpose();
  return F * E.topRightCorner<18, 18>();
}

/// Largest error of an entry in units of the standard deviations of its row and column.
[[nodiscard]] double relative_difference(const Square& Q, const Square& expected) {
  double largest = 0.0;
  for (int j = 0; j < 18; ++j) {
    for (int i = 0; i < 18; ++i) {
      const double unit = std::sqrt(expected(i, i) * expected(j, j));
      const double error = std::abs(Q(i, j) - expected(i, j));
      largest = std::max(largest, unit > 0.0 ? error / unit : error);
    }
  }
  return largest;
}

/// A turning, shaken body: smooth readings.
[[nodiscard]] Sample smooth_reading(std::int64_t stamp_ns) {
  const double t = 1e-9 * static_cast<double>(stamp_ns);
  return {stamp_ns,
          {0.8 * std::sin(3 * t), 0.5 * std::cos(2 * t), 0.4 + 0.3 * std::sin(5 * t)},
          {2 * std::sin(4 * t), 1 + std::cos(6 * t), 9.81 + std::sin(3 * t)}};
}
[[nodiscard]] Samples smooth_readings(std::int64_t begin_ns, std::int64_t end_ns, std::int64_t step_ns) {
  Samples samples;
  for (std::int64_t t = begin_ns; t <= end_ns; t += step_ns) samples.push_back(smooth_reading(t));
  return samples;
}

[[nodiscard]] double distance(const Navigation& a, const Navigation& b) { return a.boxminus(b).norm(); }

}  // namespace

TEST_CASE("Constant readings move a state as the exponential of its equation", "[inertial]") {
  for (const double rate : {0.0, 1e-6, 0.3, 5.0, 40.0}) {
    for (const std::int64_t dt_ms : {1, 5, 50}) {
      CAPTURE(rate, dt_ms);
      Rng rng(1);
      const Vector3<double> w = rate * random_unit<double, 3>(rng),
                            a = random_matrix<double, 3, 1>(rng, 15.0);
      const Navigation x = random_navigation(rng);
      const double dt = 1e-3 * static_cast<double>(dt_ms);
      const Biases biases = random_matrix<double, 6, 1>(rng, 0.1);
      const auto samples = constant_readings(w + biases.head<3>(), a + biases.tail<3>(), 0,
                                             dt_ms * kMillisecond, dt_ms * kMillisecond);
      const Motion motion =
          integrate_imu(samples, {0, dt_ms * kMillisecond}, biases, kNoise, {.max_gap_s = 0.05});
      REQUIRE(motion.status == InertialStatus::kComplete);
      const Navigation moved = motion(x);
      Matrix<double, 3, 6> X;
      X << moved.pose.rotation_matrix(), moved.columns();
      CHECK(max_difference(X, exactly_moved(x, w, a, dt)) <= 1e-13);
      const Square A = error_equation(w, a);
      CHECK(max_difference(motion.jacobian, matrix_exponential<18>(dt * A)) <= 1e-13);
      // Three points of Gauss leave out what is of the order of (|w| dt)^6 / 2e6, and the gyroscope's walk
      // beyond dt^6.
      const double turn = rate * dt;
      CHECK(relative_difference(motion.noise, exact_noise(A, kNoise, dt)) <=
            2e-3 * 0.05 + std::pow(turn, 6) / 1e4);
    }
  }
}

TEST_CASE("The motion moves errors of any size linearly", "[inertial]") {
  Rng rng(2);
  const auto samples = smooth_readings(0, 500 * kMillisecond, 5 * kMillisecond);
  const Motion motion = integrate_imu(samples, {0, 500 * kMillisecond}, Biases::Zero(), kNoise);
  const Matrix<double, 12> F = motion.jacobian.topLeftCorner<12, 12>();
  for (int trial = 0; trial < 20; ++trial) {
    const Navigation x = random_navigation(rng);
    Vector<double, 12> xi = random_matrix<double, 12, 1>(rng, 2.0);
    xi.head<3>() = random_twist<double>(rng, 0.5).head<3>();
    CHECK(distance(motion(x.boxplus(xi)), motion(x).boxplus(F * xi)) <= 1e-12);
  }
}

TEST_CASE("The Jacobian of the biases is that of integrating again", "[inertial]") {
  Rng rng(3);
  const auto samples = smooth_readings(0, 200 * kMillisecond, 5 * kMillisecond);
  const Navigation x = random_navigation(rng);
  const Biases biases = random_matrix<double, 6, 1>(rng, 0.1);
  const auto moved_with = [&](const Biases& b) {
    return integrate_imu(samples, {3 * kMillisecond, 198 * kMillisecond}, b, kNoise)(x);
  };
  const Motion motion = integrate_imu(samples, {3 * kMillisecond, 198 * kMillisecond}, biases, kNoise);
  CHECK(testing::check_jacobian(moved_with, biases, motion.jacobian.topRightCorner<12, 6>()));
}

TEST_CASE("Motions over parts make up that over the whole", "[inertial]") {
  Rng rng(4);
  const Biases biases = random_matrix<double, 6, 1>(rng, 0.1);
  // Stamps of today have more digits than a double.
  constexpr std::int64_t kNow = 1'700'000'000'123'456'789;
  Samples samples = smooth_readings(0, 100 * kMillisecond, 5 * kMillisecond);
  for (Sample& sample : samples) sample.stamp_ns += kNow;
  const auto motion_over = [&](std::int64_t from_ms, std::int64_t to_ms) {
    return integrate_imu(samples, {kNow + from_ms * kMillisecond, kNow + to_ms * kMillisecond}, biases,
                         kNoise);
  };
  const Motion whole = motion_over(0, 100), first = motion_over(0, 35), second = motion_over(35, 100);
  const Navigation x = random_navigation(rng);
  CHECK(distance(second(first(x)), whole(x)) <= 1e-13);
  CHECK(max_difference(second.jacobian * first.jacobian, whole.jacobian) <= 1e-14);
  const Square noise = second.jacobian * first.noise * second.jacobian.transpose() + second.noise;
  CHECK(relative_difference(noise, whole.noise) <= 1e-12);
  CHECK(whole.duration_s == Approx(0.1).epsilon(1e-15));
}

TEST_CASE("Sampled readings approximate smooth ones to second order in their distance", "[inertial]") {
  const Navigation x{DualQuaternion<double>::identity(), {1, 2, 3}, Vector3<double>(0, 0, -9.81)};
  const auto moved_by = [&](std::int64_t step_ns) {
    return integrate_imu(smooth_readings(0, 1000 * kMillisecond, step_ns), {0, 1000 * kMillisecond},
                         Biases::Zero(), kNoise)(x);
  };
  const Navigation fine = moved_by(kMillisecond / 20);
  const double coarse_error = distance(moved_by(10 * kMillisecond), fine);
  const double error = distance(moved_by(5 * kMillisecond), fine);
  CHECK(error <= 2e-4);  // of 1 m and 10 m/s
  CHECK(coarse_error / error == Approx(4.0).epsilon(0.05));
}

TEST_CASE("The covariance is as large as what noisy samples do", "[inertial][random]") {
  constexpr int kTrials = 400;
  constexpr double kSampleRate_Hz = 200.0;
  const auto exact = smooth_readings(0, 250 * kMillisecond, 5 * kMillisecond);
  const Navigation x{DualQuaternion<double>::identity(), {1, 2, 3}, Vector3<double>(0, 0, -9.81)};
  const ImuNoise<double> white{1e-3, 2e-2, 0.0, 0.0};
  const Motion truth = integrate_imu(exact, {0, 250 * kMillisecond}, Biases::Zero(), white);
  const Matrix<double, 9> Q = truth.noise.topLeftCorner<9, 9>();
  const auto L = detail::cholesky_factor<double, 9>(Q);
  REQUIRE(L);
  Rng rng(5);
  std::normal_distribution<double> normal;
  double sum = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Samples noisy = exact;
    for (Sample& sample : noisy) {
      for (double& w : sample.angular_velocity)
        w += white.gyroscope * std::sqrt(kSampleRate_Hz) * normal(rng);
      for (double& a : sample.specific_force)
        a += white.accelerometer * std::sqrt(kSampleRate_Hz) * normal(rng);
    }
    const Motion motion = integrate_imu(noisy, {0, 250 * kMillisecond}, Biases::Zero(), white);
    const Vector<double, 9> error = truth(x).boxminus(motion(x)).head<9>();
    sum += detail::solve_lower<double, 9, 1>(*L, error).squaredNorm();
  }
  // The first and the last of 51 samples count half: 50 intervals have the noise of 49.5.
  CHECK(std::abs(sum / kTrials - 9.0 * 49.5 / 50) <= 3.0 * std::sqrt(18.0 / kTrials));
}

TEST_CASE("Further parts of a state stay as they are", "[inertial]") {
  using WithOffset = InertialChart<double, VectorChart<double, 1>, ScrewChart<double>>;
  Rng rng(6);
  const auto samples = smooth_readings(0, 50 * kMillisecond, 5 * kMillisecond);
  const Motion motion = integrate_imu(samples, {0, 50 * kMillisecond}, Biases::Zero(), kNoise);
  const WithOffset::Point state{random_navigation(rng), Biases::Zero(), Vector<double, 1>(0.01),
                                random_pose<double>(rng)};
  CHECK(
      testing::check_jacobian_over<WithOffset, WithOffset>(motion, state, motion.jacobian_in<WithOffset>()));
  const auto Q = motion.noise_in<WithOffset>();
  CHECK(max_difference(Q.topLeftCorner<18, 18>(), motion.noise) == 0.0);
  CHECK(Q.rightCols<7>().norm() + Q.bottomRows<7>().norm() == 0.0);
}

TEST_CASE("Bad samples are left out, counted, and change nothing else", "[inertial][error]") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const Samples good = smooth_readings(0, 50 * kMillisecond, 5 * kMillisecond);
  Samples bad = good;
  bad.insert(bad.begin() + 3, good[2]);  // twice
  bad.insert(bad.begin() + 5, good[1]);  // late
  bad.insert(bad.begin() + 7, Sample{12 * kMillisecond, {kNan, 0, 0}, {0, 0, 9.81}});
  bad.insert(bad.begin() + 8,
             Sample{13 * kMillisecond, {0, 0, 0}, {0, 0, std::numeric_limits<double>::infinity()}});
  const Motion expected = integrate_imu(good, {2 * kMillisecond, 48 * kMillisecond}, Biases::Zero(), kNoise);
  const Motion motion = integrate_imu(bad, {2 * kMillisecond, 48 * kMillisecond}, Biases::Zero(), kNoise);
  CHECK(motion.status == InertialStatus::kComplete);
  CHECK(motion.repeated == 1);
  CHECK(motion.unsorted == 1);
  CHECK(motion.not_finite == 2);
  CHECK(motion.position == expected.position);
  CHECK(max_difference(motion.noise, expected.noise) == 0.0);
}

TEST_CASE("A motion ends where a gap begins", "[inertial][error]") {
  Samples samples = smooth_readings(0, 200 * kMillisecond, 5 * kMillisecond);
  samples.erase(samples.begin() + 5, samples.begin() + 20);  // nothing from 20 to 100 ms
  const auto over = [&](std::int64_t from_ms, std::int64_t to_ms) {
    return integrate_imu(samples, {from_ms * kMillisecond, to_ms * kMillisecond}, Biases::Zero(), kNoise);
  };
  const Motion motion = over(2, 150), until_gap = over(2, 20);
  CHECK(motion.status == InertialStatus::kGap);
  CHECK(motion.until_ns == 20 * kMillisecond);
  CHECK(motion.duration_s == Approx(0.018));
  CHECK(motion.position == until_gap.position);
  CHECK(over(50, 150).status == InertialStatus::kGap);
  CHECK(over(50, 150).until_ns == 50 * kMillisecond);
  CHECK(over(50, 150).duration_s == 0.0);
  CHECK(over(110, 220).status == InertialStatus::kComplete);  // the last sample is held for 20 ms
  CHECK(over(110, 240).status == InertialStatus::kGap);       // but not for 40 ms
  CHECK(over(110, 240).until_ns == 200 * kMillisecond);
  CHECK(over(-20, 10).status == InertialStatus::kComplete);  // the first one is held back likewise
  CHECK(over(-40, 10).status == InertialStatus::kGap);
  CHECK(over(-40, 10).until_ns == -40 * kMillisecond);
  CHECK(over(210, 220).status == InertialStatus::kComplete);
  CHECK(over(210, 220).duration_s == Approx(0.01));
  CHECK(over(300, 320).status == InertialStatus::kGap);
  CHECK(over(300, 320).until_ns == 300 * kMillisecond);
}

TEST_CASE("What cannot be integrated has a status and no motion", "[inertial][error]") {
  const Samples samples = smooth_readings(0, 50 * kMillisecond, 5 * kMillisecond);
  const auto status_of = [](const Samples& s, std::int64_t begin_ns, std::int64_t end_ns,
                            const Biases& biases) {
    const Motion motion = integrate_imu(s, {begin_ns, end_ns}, biases, kNoise);
    if (motion.status != InertialStatus::kComplete) {
      CHECK(motion.jacobian == Square::Identity());
      CHECK(motion.noise == Square::Zero());
      CHECK(motion.until_ns == begin_ns);
    }
    return motion.status;
  };
  CHECK(status_of({}, 0, kMillisecond, Biases::Zero()) == InertialStatus::kNoSamples);
  CHECK(status_of(samples, kMillisecond, 0, Biases::Zero()) == InertialStatus::kBackwards);
  CHECK(status_of(samples, 0, 0, Biases::Zero()) == InertialStatus::kComplete);
  CHECK(status_of(samples, 7, 7, Biases::Zero()) == InertialStatus::kComplete);
  CHECK(status_of(samples, 0, 10 * kMillisecond, Biases::Constant(std::nan(""))) ==
        InertialStatus::kNotFinite);
  for (const double huge : {1e200, 1e308}) {
    Samples too_large = samples;
    too_large[1].angular_velocity.setConstant(huge);
    too_large[2].specific_force.setConstant(-huge);
    CHECK(status_of(too_large, 0, 50 * kMillisecond, Biases::Zero()) == InertialStatus::kNotFinite);
  }
  constexpr auto kFirst = std::numeric_limits<std::int64_t>::min(),
                 kLast = std::numeric_limits<std::int64_t>::max();
  CHECK(status_of(samples, kFirst, kLast, Biases::Zero()) == InertialStatus::kGap);
}

TEST_CASE("Noise and gaps that make no sense are refused", "[inertial][error]") {
  const Samples samples = smooth_readings(0, 50 * kMillisecond, 5 * kMillisecond);
  const auto with = [&](const ImuNoise<double>& noise, double max_gap_s) {
    return error_message([&] {
      (void)integrate_imu(samples, {0, kMillisecond}, Biases::Zero(), noise, {.max_gap_s = max_gap_s});
    });
  };
  CHECK(contains(with({1e-3, -1e-2, 0, 0}, 0.05),
                 "density of an IMU is negative or not finite: [0.001; -0.01; 0; 0]"));
  CHECK(contains(with({1e-3, 1e-2, std::nan(""), 0}, 0.05), "nan"));
  CHECK(contains(with({1e-3, 1e-2, 0, 0}, 0.0), "max_gap_s is not positive: 0"));
  CHECK(contains(with({1e-3, 1e-2, 0, 0}, std::nan("")), "max_gap_s is not positive: nan"));
}

TEST_CASE("A shift of the interval moves every state as the derivative says", "[inertial]") {
  Rng rng(71);
  // Linear rates and forces, which samples show exactly.
  const Biases slope = random_matrix<double, 6, 1>(rng, 3.0), start = random_matrix<double, 6, 1>(rng, 2.0);
  const auto readings = [&](std::int64_t stamp_ns) -> Biases {
    return start + 1e-9 * static_cast<double>(stamp_ns) * slope;
  };
  Samples samples;
  for (std::int64_t t = 0; t <= 300 * kMillisecond; t += kMillisecond)
    samples.push_back({t, readings(t).head<3>(), readings(t).tail<3>()});
  const Biases biases = random_matrix<double, 6, 1>(rng, 0.1);
  const TimeInterval interval{100 * kMillisecond, 150 * kMillisecond};
  const auto shifted = [&](std::int64_t shift_ns) {
    return integrate_imu(samples, {interval.begin_ns + shift_ns, interval.end_ns + shift_ns}, biases, kNoise);
  };
  const auto derivative = shifted(0).derivative_by_shift(readings(interval.begin_ns) - biases,
                                                         readings(interval.end_ns) - biases);
  for (int i = 0; i < 10; ++i) {
    const Navigation x = random_navigation(rng);
    constexpr std::int64_t kShift_ns = 100'000;
    const Navigation before = shifted(-kShift_ns)(x), after = shifted(kShift_ns)(x);
    const Vector<double, 12> difference = after.boxminus(before) / (2e-9 * static_cast<double>(kShift_ns));
    // Steps of a millisecond have an error of slope dt^2, 3e-6, over 50 ms; differences one of 1e-8.
    CHECK((difference - derivative).norm() < 1e-4 * derivative.norm());
  }
  CHECK(derivative.norm() > 0.1);
}

TEMPLATE_TEST_CASE("Integrating samples allocates nothing", "[inertial][allocation]", float, double) {
  using Scalar = TestType;
  std::vector<ImuSample<Scalar>> samples;
  for (int i = 0; i <= 10; ++i) {
    samples.push_back({i * 5 * kMillisecond,
                       {Scalar(0.1), Scalar(-0.2), Scalar(0.3)},
                       {Scalar(1), Scalar(0), Scalar(9.81)}});
  }
  const ImuNoise<Scalar> noise{Scalar(1e-3), Scalar(1e-2), Scalar(1e-5), Scalar(1e-4)};
  const auto motion = without_allocation([&] {
    return integrate_imu(samples, {0, 50 * kMillisecond}, Vector6<Scalar>::Zero(), noise);
  });
  CHECK(motion.status == InertialStatus::kComplete);
  CHECK(std::abs(static_cast<double>(motion.velocity[2]) - 0.05 * 9.81) <= 0.01);
}

}  // namespace antipode::test
