// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <tuple>
#include <type_traits>

#include <antipode/detail/check.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/extended_pose.hpp>
#include <antipode/geometry/jacobians.hpp>
#include <antipode/geometry/quaternion.hpp>
#include <antipode/geometry/rotation_integrals.hpp>
#include <antipode/sensors/inertial_measurement_unit.hpp>

/// @file
/// The motion of a body between two times, by the samples of its IMU: how it moves a state of pose, velocity,
/// gravity and biases, the Jacobian of that, and the covariance of its noise. With these three, StateFilter
/// predicts:
///
///     const auto motion = integrate_imu(samples, {begin_ns, end_ns}, biases, noise);
///     if (motion.status == InertialStatus::kComplete) filter.predict(motion, motion.jacobian, motion.noise);
namespace antipode {

/// The chart of a state that an IMU moves: ({pose, velocity, gravity}, biases), and parts that stay as they
/// are, a time offset say.
///
/// R, p of the pose T_reference_body, the velocity v [m/s] and gravity g [m/s^2] (9.81 downwards) are in the
/// axes of the reference, which may have any attitude: the world, or a keyframe. The biases are those of the
/// gyroscope [rad/s] and of the accelerometer [m/s^2], which the samples contain and the body does not
/// feel. Vectors of the chart are (phi, nu, rho, gamma, b_g, b_a, ...).
template <std::floating_point Scalar, Chart... Others>
using InertialChart = ProductChart<ExtendedPoseChart<Scalar, 3>, VectorChart<Scalar, 6>, Others...>;

/// How integrate_imu() ended.
enum class InertialStatus {
  kComplete,   ///< the motion is that from the beginning to the end
  kGap,        ///< no sample for longer than max_gap_s: the motion ends where the gap begins, at until_ns
  kNoSamples,  ///< no sample is usable: there is no motion
  kBackwards,  ///< the end is before the beginning: there is no motion
  kNotFinite,  ///< a bias is not finite, or numbers are too large to compute with: there is no motion
};

/// The motion of a body by the samples of its IMU, up to the time until_ns: a callable, which moves a state
/// in the InertialChart. The Jacobian is the same for all states with the biases of the motion.
template <std::floating_point Scalar_>
struct InertialMotion {
  using Scalar = Scalar_;                                   ///< of all numbers
  using Navigation = ExtendedPose<Scalar, 3>;               ///< pose, velocity and gravity
  static constexpr int kDim = InertialChart<Scalar>::kDim;  ///< 18: (phi, nu, rho, gamma, b_g, b_a)
  using Square = Matrix<Scalar, kDim>;                      ///< covariances and Jacobians

  Vector4<Scalar> rotation = Vector4<Scalar>(1, 0, 0, 0);  ///< quaternion of R_begin_until
  Vector3<Scalar> velocity = Vector3<Scalar>::Zero();      ///< that the specific force adds, in the axes of
                                                           ///< the body at the beginning, m/s
  Vector3<Scalar> position = Vector3<Scalar>::Zero();      ///< that the specific force adds, likewise, m
  Vector6<Scalar> biases = Vector6<Scalar>::Zero();        ///< that the readings were freed of
  Scalar duration_s = 0;                                   ///< from the beginning to until_ns
  Square jacobian = Square::Identity();                    ///< of the call operator, in the InertialChart
  Square noise = Square::Zero();  ///< covariance that the noise adds to that of the moved state

  InertialStatus status = InertialStatus::kComplete;  ///< whether until_ns is the end
  std::int64_t until_ns = 0;                          ///< the time of the moved state
  int repeated = 0;                                   ///< samples left out, with the stamp of the one before
  int unsorted = 0;                                   ///< samples left out, with an earlier stamp than that
  int not_finite = 0;                                 ///< samples left out, with NaN or infinity

  /// Pose, velocity and gravity at until_ns, for those at the beginning. Throws unless they are finite.
  [[nodiscard]] Navigation operator()(const Navigation& x) const {
    const Scalar T = duration_s;
    const Vector4<Scalar> q = x.pose.rotation();
    const Vector3<Scalar> g = x.vectors.col(0);
    const Vector3<Scalar> v = x.velocity + rotate(q, velocity) + T * g;
    const Vector3<Scalar> p =
        x.pose.translation() + T * x.velocity + rotate(q, position) + Scalar(0.5) * T * T * g;
    return {DualQuaternion<Scalar>::from_rotation_translation(hamilton_product(q, rotation), p), v, g};
  }
  /// The same for a state in an InertialChart, of which only pose and velocity change. Other biases than
  /// those of the motion are corrected to first order.
  template <class... Others>
  [[nodiscard]] std::tuple<Navigation, Vector6<Scalar>, Others...> operator()(
      std::tuple<Navigation, Vector6<Scalar>, Others...> state) const {
    std::get<0>(state) = (*this)(std::get<0>(state));
    const Vector6<Scalar> correction = std::get<1>(state) - biases;
    if (!correction.isZero(Scalar(0))) {
      const typename Navigation::Tangent xi = jacobian.template topRightCorner<12, 6>() * correction;
      std::get<0>(state) = std::get<0>(state).boxplus(xi);
    }
    return state;
  }

  /// The derivative of the moved state, the first twelve coordinates of the InertialChart, with respect to a
  /// shift of both ends of the interval, per second: what a delay between the stamps of the samples and those
  /// of the state does. `begin` and `end` are the readings there, rate and specific force, less the biases.
  ///
  /// Either end moves with the motion that it has, Exp(dt (w, R^T v', R^T v, 0)). What velocity and gravity
  /// contribute at the beginning moves on to the end, where it is taken away: the derivative does not depend
  /// on the state.
  [[nodiscard]] Vector<Scalar, 12> derivative_by_shift(const Vector6<Scalar>& begin,
                                                       const Vector6<Scalar>& end) const {
    Vector<Scalar, 12> derivative = -jacobian.template topLeftCorner<12, 6>() * begin;
    derivative.template head<6>() += end;
    derivative.template segment<3>(6) += rotate(conjugate(rotation), velocity);
    return derivative;
  }

  /// The Jacobian for a state with further parts, in the InertialChart C.
  template <Chart C>
  [[nodiscard]] Matrix<Scalar, C::kDim> jacobian_in() const {
    Matrix<Scalar, C::kDim> F = Matrix<Scalar, C::kDim>::Identity();
    F.template topLeftCorner<kDim, kDim>() = jacobian;
    return F;
  }
  /// The noise for a state with further parts, which have none.
  template <Chart C>
  [[nodiscard]] Matrix<Scalar, C::kDim> noise_in() const {
    Matrix<Scalar, C::kDim> Q = Matrix<Scalar, C::kDim>::Zero();
    Q.template topLeftCorner<kDim, kDim>() = noise;
    return Q;
  }
};

/// From one time to another.
struct TimeInterval {
  std::int64_t begin_ns = 0;  ///< its beginning
  std::int64_t end_ns = 0;    ///< its end, not before the beginning
};

/// When integrate_imu() stops.
template <std::floating_point Scalar>
struct InertialOptions {
  /// Longest time without a sample, also before the first and after the last one. In between, the readings
  /// are interpolated, and nothing in the covariance says how wrong that is: on a drone (EuRoC MH_05) .6 mrad
  /// and 15 mm/s after 30 ms, 3.8 mrad and 51 mm/s after 100 ms.
  Scalar max_gap_s = Scalar(0.03);
};

namespace detail {

/// The Jacobian of the motion over dt [s] at the angular velocity w and the specific force a, both less their
/// biases. Pose, velocity and gravity obey xi' = A xi exactly (A. Barrau, S. Bonnabel, 2017), with
///
///     A = [-[w] 0 0 0; -[a] -[w] 0 I; 0 I -[w] 0; 0 0 0 -[w]],
///
/// the biases to first order. The blocks are those of exp(A dt) and of its integral, in the axes of the body
/// at the end.
template <class Scalar>
[[nodiscard]] typename InertialMotion<Scalar>::Square inertial_jacobian(const Vector3<Scalar>& w,
                                                                        const Vector3<Scalar>& a, Scalar dt) {
  constexpr int kPhi = 0, kNu = 3, kRho = 6, kGamma = 9, kGyro = 12, kAccel = 15;
  using Square = typename InertialMotion<Scalar>::Square;
  const Vector3<Scalar> phi = dt * w;
  const Matrix3<Scalar> back = rotation_matrix(quaternion_exp(phi)).transpose();
  const auto [first, second] = rotation_integrals(phi);
  const auto [first_slope, second_slope] = rotation_integrals_along(phi, a);
  const Scalar dt2 = dt * dt;
  Square F = Square::Identity();
  const auto set = [&F, &back](int row, int column, const Matrix3<Scalar>& block) {
    F.template block<3, 3>(row, column) = back.lazyProduct(block);
  };
  const Matrix3<Scalar> I = Matrix3<Scalar>::Identity();
  for (const int part : {kPhi, kNu, kRho, kGamma}) set(part, part, I);
  set(kPhi, kGyro, -dt * first);
  set(kNu, kPhi, -dt * skew(first * a));
  set(kNu, kGamma, dt * I);
  set(kNu, kGyro, -dt2 * first_slope);
  set(kNu, kAccel, -dt * first);
  set(kRho, kPhi, -dt2 * skew(second * a));
  set(kRho, kNu, dt * I);
  set(kRho, kGamma, Scalar(0.5) * dt2 * I);
  set(kRho, kGyro, -dt2 * dt * second_slope);
  set(kRho, kAccel, -dt2 * second);
  return F;
}

/// The covariance of the noise over dt: the integral of F B S B^T F^T over the time that is left after the
/// noise came in, with F = inertial_jacobian, B the four columns of F where noise comes in, and S its
/// densities. By the rule of Gauss and Legendre with three points: positive semidefinite, and exact up to
/// dt^6 of the series.
template <class Scalar>
[[nodiscard]] typename InertialMotion<Scalar>::Square inertial_noise(const Vector3<Scalar>& w,
                                                                     const Vector3<Scalar>& a, Scalar dt,
                                                                     const ImuNoise<Scalar>& noise) {
  using Square = typename InertialMotion<Scalar>::Square;
  constexpr double kNodes[] = {0.11270166537925831, 0.5, 0.88729833462074169};  // (1 -+ sqrt(3/5)) / 2
  constexpr double kWeights[] = {5. / 18, 8. / 18, 5. / 18};
  Vector<Scalar, 12> densities;
  densities << Vector3<Scalar>::Constant(noise.gyroscope), Vector3<Scalar>::Constant(noise.accelerometer),
      Vector3<Scalar>::Constant(noise.gyroscope_bias_walk),
      Vector3<Scalar>::Constant(noise.accelerometer_bias_walk);
  Square Q = Square::Zero();
  for (int k = 0; k < 3; ++k) {
    const Square F = inertial_jacobian(w, a, Scalar(kNodes[k]) * dt);
    Matrix<Scalar, 18, 12> FB;
    FB << F.template leftCols<6>(), F.template rightCols<6>();
    Q += scaled_square<Scalar, 18, 12>(FB, Scalar(kWeights[k]) * dt * densities.cwiseAbs2());
  }
  return Q;
}

/// Adds intervals of constant rate and specific force to a motion, from sample to sample.
template <class Scalar>
class InertialIntegrator {
 public:
  InertialIntegrator(const TimeInterval& interval, const Vector6<Scalar>& biases,
                     const ImuNoise<Scalar>& noise, const InertialOptions<Scalar>& options)
      : begin_ns_(interval.begin_ns), end_ns_(interval.end_ns), noise_(noise), max_gap_s_(options.max_gap_s) {
    motion_.until_ns = begin_ns_;
    motion_.biases = biases;
  }

  /// Moves on to the sample, or to the end if that is earlier. Returns whether more samples are needed.
  [[nodiscard]] bool add(const ImuSample<Scalar>& sample) {
    if (!is_usable(sample)) return true;
    const ImuSample<Scalar> before = last_.value_or(sample);  // the first one is held back to the beginning
    last_ = sample;
    if (sample.stamp_ns <= begin_ns_) return true;
    const std::int64_t covered_ns = before.stamp_ns < sample.stamp_ns ? before.stamp_ns : begin_ns_;
    if (is_gap(covered_ns, sample.stamp_ns)) return end(InertialStatus::kGap);
    move(std::min(sample.stamp_ns, end_ns_), before, sample);
    return sample.stamp_ns < end_ns_ || end(InertialStatus::kComplete);
  }

  /// The motion, with the last sample held to the end.
  [[nodiscard]] InertialMotion<Scalar> finish() {
    if (ended_) return checked();
    if (!last_) return without_motion(InertialStatus::kNoSamples);
    if (is_gap(last_->stamp_ns, end_ns_)) {
      motion_.status = InertialStatus::kGap;
    } else {
      move(end_ns_, *last_, *last_);
    }
    return checked();
  }
  /// No motion, with the counts so far.
  [[nodiscard]] InertialMotion<Scalar> without_motion(InertialStatus status) const {
    InertialMotion<Scalar> none;
    none.status = status;
    none.until_ns = begin_ns_;
    none.biases = motion_.biases;
    none.repeated = motion_.repeated;
    none.unsorted = motion_.unsorted;
    none.not_finite = motion_.not_finite;
    return none;
  }

 private:
  /// Stamps have more digits than a double; their unsigned difference does not overflow.
  [[nodiscard]] static Scalar seconds(std::int64_t from_ns, std::int64_t to_ns) {
    const auto ns = static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(from_ns);
    return static_cast<Scalar>(1e-9 * static_cast<double>(ns));
  }
  [[nodiscard]] bool is_gap(std::int64_t from_ns, std::int64_t to_ns) const {
    return from_ns < to_ns && !(seconds(from_ns, to_ns) <= max_gap_s_);
  }
  [[nodiscard]] bool is_usable(const ImuSample<Scalar>& sample) {
    const bool finite = sample.finite();
    const bool repeated = finite && last_ && sample.stamp_ns == last_->stamp_ns;
    const bool unsorted = finite && last_ && sample.stamp_ns < last_->stamp_ns;
    motion_.not_finite += finite ? 0 : 1;
    motion_.repeated += repeated ? 1 : 0;
    motion_.unsorted += unsorted ? 1 : 0;
    return finite && !repeated && !unsorted;
  }
  [[nodiscard]] bool end(InertialStatus status) {
    motion_.status = status;
    ended_ = true;
    return false;
  }

  /// Moves on to `to_ns` with the readings at the middle of the interval, interpolated between two samples.
  void move(std::int64_t to_ns, const ImuSample<Scalar>& before, const ImuSample<Scalar>& after) {
    const Scalar dt = seconds(motion_.until_ns, to_ns);
    if (!(dt > Scalar(0))) return;
    Scalar share(1);
    if (before.stamp_ns < after.stamp_ns) {
      share = (seconds(before.stamp_ns, motion_.until_ns) + Scalar(0.5) * dt) /
              seconds(before.stamp_ns, after.stamp_ns);
    }
    Vector6<Scalar> readings;
    readings << before.angular_velocity + share * (after.angular_velocity - before.angular_velocity),
        before.specific_force + share * (after.specific_force - before.specific_force);
    readings -= motion_.biases;
    motion_.until_ns = to_ns;
    motion_.duration_s = seconds(begin_ns_, to_ns);
    finite_ = finite_ && is_finite(readings.squaredNorm());
    if (finite_) append(readings.template head<3>(), readings.template tail<3>(), dt);
  }
  void append(const Vector3<Scalar>& w, const Vector3<Scalar>& a, Scalar dt) {
    const Vector3<Scalar> phi = dt * w;
    const auto [first, second] = rotation_integrals(phi);
    const Vector3<Scalar> dv = dt * (first * a), dp = dt * dt * (second * a);
    motion_.position += dt * motion_.velocity + rotate(motion_.rotation, dp);
    motion_.velocity += rotate(motion_.rotation, dv);
    motion_.rotation = hamilton_product(motion_.rotation, quaternion_exp(phi));
    const Square F = inertial_jacobian(w, a, dt);
    motion_.jacobian = F * motion_.jacobian;
    motion_.noise =
        congruence<Scalar, Square::RowsAtCompileTime, Square::RowsAtCompileTime>(F, motion_.noise) +
        inertial_noise(w, a, dt, noise_);
  }
  [[nodiscard]] InertialMotion<Scalar> checked() const {
    const bool finite = finite_ && all_finite(motion_.jacobian) && all_finite(motion_.noise) &&
                        all_finite(motion_.position) && all_finite(motion_.velocity);
    return finite ? motion_ : without_motion(InertialStatus::kNotFinite);
  }

  using Square = typename InertialMotion<Scalar>::Square;
  std::int64_t begin_ns_, end_ns_;
  ImuNoise<Scalar> noise_;
  Scalar max_gap_s_;
  std::optional<ImuSample<Scalar>> last_;
  bool ended_ = false;
  bool finite_ = true;
  InertialMotion<Scalar> motion_;
};

}  // namespace detail

/// The motion over the interval by the samples of an IMU, which are in the order of their stamps. They should
/// reach from the last one before the beginning to the first one after the end; if they do not, the first or
/// last one is held for up to max_gap_s.
///
/// Between two samples, rate and specific force are constant and their mean. Biases [rad/s, m/s^2] are those
/// of the state that the motion is to move. Bad samples do not throw: those with repeated or earlier stamps
/// and those that are not finite are left out and counted, and the status tells of gaps.
///
/// Throws unless the densities of the noise are finite and not negative, and max_gap_s is positive.
template <std::floating_point Scalar>
[[nodiscard]] InertialMotion<Scalar> integrate_imu(
    std::type_identity_t<std::span<const ImuSample<Scalar>>> samples, const TimeInterval& interval,
    const std::type_identity_t<Vector6<Scalar>>& biases, const ImuNoise<Scalar>& noise,
    const std::type_identity_t<InertialOptions<Scalar>>& options = {}) {
  noise.check();
  if (!(options.max_gap_s > Scalar(0))) [[unlikely]] {
    detail::throw_invalid("max_gap_s is not positive", options.max_gap_s);
  }
  detail::InertialIntegrator<Scalar> integrator(interval, biases, noise, options);
  if (interval.end_ns < interval.begin_ns) return integrator.without_motion(InertialStatus::kBackwards);
  if (!detail::all_finite(biases)) return integrator.without_motion(InertialStatus::kNotFinite);
  for (const ImuSample<Scalar>& sample : samples) {
    if (!integrator.add(sample)) break;
  }
  return integrator.finish();
}

}  // namespace antipode
