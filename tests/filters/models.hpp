// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include <antipode/detail/cholesky.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/noisy_measurement.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/quaternion.hpp>

#include "support/random.hpp"

/// Measurement models and scenes for the tests of the filters.
namespace antipode::test {

/// Any log-likelihood. One type for all of them: a filter compiles once and not for every lambda.
template <class Scalar>
using AnyLogLikelihood = std::function<Scalar(const DualQuaternion<Scalar>&)>;

/// Any measurement of a point, likewise.
template <class Scalar>
using AnyPairModel =
    std::function<std::optional<Vector3<Scalar>>(const DualQuaternion<Scalar>&, const Vector3<Scalar>&)>;

/// z = (fx X/Z + cx, fy Y/Z + cy, fx b/Z) of a point in the world, seen from T_world_camera; nothing for Z <
/// 0.1 m.
template <class Scalar>
struct StereoModel {
  Scalar fx = Scalar(718.856), fy = Scalar(718.856), cx = Scalar(607.1928), cy = Scalar(185.2157);
  Scalar baseline = Scalar(0.53715);

  [[nodiscard]] std::optional<Vector3<Scalar>> operator()(const DualQuaternion<Scalar>& T_world_camera,
                                                          const Vector3<Scalar>& p_world) const {
    const Vector3<Scalar> p = T_world_camera.inverse() * p_world;
    if (p[2] < Scalar(0.1)) return std::nullopt;
    return Vector3<Scalar>(fx * p[0] / p[2] + cx, fy * p[1] / p[2] + cy, fx * baseline / p[2]);
  }

  /// The point in the world that is measured as z.
  [[nodiscard]] Vector3<Scalar> back_project(const DualQuaternion<Scalar>& T_world_camera,
                                             const Vector3<Scalar>& z) const {
    const Scalar depth = fx * baseline / z[2];
    return T_world_camera * Vector3<Scalar>((z[0] - cx) * depth / fx, (z[1] - cy) * depth / fy, depth);
  }
};

/// StereoModel with its Jacobian under x exp(xi).
struct StereoWithJacobian {
  StereoModel<double> camera;
  std::vector<Vector3<double>> landmarks;

  std::optional<Vector3<double>> operator()(const DualQuaternion<double>& x, std::size_t i,
                                            Matrix<double, 3, 6>& J) const {
    const Vector3<double> p = x.inverse() * landmarks[i];
    if (p[2] < 0.1) return std::nullopt;
    Matrix3<double> of_point;
    of_point << camera.fx / p[2], 0, -camera.fx * p[0] / (p[2] * p[2]),  //
        0, camera.fy / p[2], -camera.fy * p[1] / (p[2] * p[2]),          //
        0, 0, -camera.fx * camera.baseline / (p[2] * p[2]);
    J << of_point * skew(p), -of_point;
    return camera(x, landmarks[i]);
  }
};

/// Known landmarks measured with independent Gaussian noise of the given standard deviations.
template <class Scalar>
struct StereoScene {
  StereoModel<Scalar> camera;
  std::vector<Vector3<Scalar>> landmarks;
  std::vector<Vector3<Scalar>> measurements;
  Vector3<Scalar> sigma = Vector3<Scalar>(Scalar(0.5), Scalar(0.5), Scalar(0.7));
  /// What a landmark behind the camera adds.
  Scalar behind = -std::numeric_limits<Scalar>::infinity();
  /// The most a landmark may cost, as a robust likelihood.
  Scalar cap = std::numeric_limits<Scalar>::infinity();

  [[nodiscard]] Scalar operator()(const DualQuaternion<Scalar>& T_world_camera) const {
    Scalar sum(0);
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      const auto z = camera(T_world_camera, landmarks[i]);
      sum += z ? -std::min(cap, Scalar(0.5) * (*z - measurements[i]).cwiseQuotient(sigma).squaredNorm())
               : behind;
    }
    return sum;
  }

  /// `count` points 3 to 40 m before the camera and in its 1241 x 376 image, measured with noise.
  [[nodiscard]] static StereoScene random(Rng& rng, const DualQuaternion<Scalar>& T_world_camera, int count) {
    std::normal_distribution<double> normal;
    StereoScene scene;
    for (int i = 0; i < count; ++i) {
      const Scalar disparity = scene.camera.fx * scene.camera.baseline / uniform<Scalar>(rng, 3.0, 40.0);
      const Scalar row = uniform<Scalar>(rng, 0.0, 376.0);
      const Vector3<Scalar> z(uniform<Scalar>(rng, 0.0, 1241.0), row, disparity);
      Vector3<Scalar> noise;
      for (const int axis : {2, 1, 0}) noise[axis] = static_cast<Scalar>(normal(rng));
      scene.landmarks.push_back(scene.camera.back_project(T_world_camera, z));
      scene.measurements.push_back(z + scene.sigma.cwiseProduct(noise));
    }
    return scene;
  }
};

/// The measurements of a scene with their covariances.
template <class Scalar>
[[nodiscard]] std::vector<NoisyMeasurement<Scalar, 3>> measurements_of(const StereoScene<Scalar>& scene) {
  const Matrix3<Scalar> covariance = scene.sigma.cwiseAbs2().asDiagonal();
  std::vector<NoisyMeasurement<Scalar, 3>> result;
  for (const auto& z : scene.measurements) result.push_back({z, covariance});
  return result;
}

/// Rotation and translation of standard deviations [rad, m], uncorrelated.
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> pose_covariance(double rotation_sigma_rad, double translation_sigma_m) {
  Matrix6<Scalar> P = Matrix6<Scalar>::Zero();
  for (int i = 0; i < 6; ++i) {
    const double sigma = i < 3 ? rotation_sigma_rad : translation_sigma_m;
    P(i, i) = static_cast<Scalar>(sigma * sigma);
  }
  return P;
}

/// A prior about a random pose.
[[nodiscard]] inline PoseGaussian<double> prior_at_random_pose(Rng& rng, double rotation_sigma_rad,
                                                               double translation_sigma_m) {
  return {random_pose<double>(rng), pose_covariance<double>(rotation_sigma_rad, translation_sigma_m)};
}

/// A pose, or a joint state, drawn from the density.
template <ConcentratedDensity Density>
[[nodiscard]] auto draw(Rng& rng, const Density& density) {
  using Scalar = typename Density::Scalar;
  std::normal_distribution<double> normal;
  Vector<Scalar, Density::Chart::kDim> g;
  for (Scalar& entry : g) entry = static_cast<Scalar>(normal(rng));
  const Vector<Scalar, Density::Chart::kDim> xi = detail::cholesky_factor(density.covariance).value() * g;
  const auto& [mean, covariance] = density;
  return Density::Chart::retract(mean, xi);
}

/// Normalised estimation error squared, chi^2 of the state's dimension if the density is consistent.
template <ConcentratedDensity Density>
[[nodiscard]] double nees(const Density& density, const typename Density::Chart::Point& truth) {
  using Scalar = typename Density::Scalar;
  constexpr int N = Density::Chart::kDim;
  const auto L = detail::cholesky_factor(density.covariance);
  const auto& [mean, covariance] = density;
  const Vector<Scalar, N> error = Density::Chart::local(mean, truth);
  return L ? static_cast<double>(detail::solve_lower<Scalar, N, 1>(*L, error).squaredNorm())
           : std::numeric_limits<double>::infinity();
}

/// The same density with q and -q exchanged in all that represents it.
template <class Scalar>
[[nodiscard]] BinghamGaussian<Scalar> antipode_of(const BinghamGaussian<Scalar>& density) {
  Matrix4<Scalar> axes = density.orientation().axes();
  axes.col(3) *= Scalar(-1);
  return {Bingham<Scalar, 4>::from_parameters(axes, density.orientation().concentrations()),
          density.mean_translation(), -density.coupling(), density.conditional_covariance()};
}
template <class Scalar>
[[nodiscard]] DualQuaternion<Scalar> antipode_of(const DualQuaternion<Scalar>& pose) {
  return DualQuaternion<Scalar>::unchecked(-pose.coeffs());
}

}  // namespace antipode::test
