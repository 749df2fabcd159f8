// SPDX-License-Identifier: MIT
//
// How is a body turned? A camera has given many noisy orientations, of either sign: q and -q are one
// rotation. An accelerometer knows which way is up, and nothing of the heading. What do both say together?
//
//   q                turns body coordinates into world coordinates, world z up
//   up_body          the world's z axis as the accelerometer feels it
//   E[q q^T]         the scatter of a density: what can be averaged although the sign of q means nothing
//   omega_i          the mean square of q along an axis of the density; four times it is an angle squared
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <numbers>
#include <random>

#include <antipode/antipode.hpp>

using Quaternion = antipode::Vector4<double>;
using Vector3 = antipode::Vector3<double>;
using Matrix4 = antipode::Matrix4<double>;
using Bingham = antipode::Bingham<double, 4>;

namespace {

void expect(bool holds, const char* what) {
  if (!holds) {
    std::cerr << "unexpected: " << what << '\n';
    std::exit(EXIT_FAILURE);
  }
}

double degrees(double rad) { return rad * 180.0 / std::numbers::pi; }

/// The angle between two orientations; q and -q are the same.
double angle_deg(const Quaternion& a, const Quaternion& b) {
  return degrees(antipode::quaternion_log(antipode::hamilton_product(antipode::conjugate(a), b)).norm());
}

/// The standard deviation of rotations about `axis` of the world, to first order.
double spread_deg(const Bingham& density, const Vector3& axis) {
  const Quaternion turned =
      antipode::hamilton_product(Quaternion(0, axis[0], axis[1], axis[2]), density.mode());
  return degrees(2.0 * std::sqrt(turned.dot(density.scatter() * turned)));
}

/// Up is known within `sigma` [rad] of the world's z axis, the heading not at all: two of the four
/// concentrations are zero. q0 is any orientation that maps up_body to z; with it, all turns of it about z
/// do.
Bingham from_gravity(const Vector3& up_body, double sigma) {
  const Eigen::Quaterniond to_z = Eigen::Quaterniond::FromTwoVectors(up_body, Vector3::UnitZ());
  const Matrix4 R = antipode::right_matrix(antipode::from_eigen(to_z));  // columns q0, i q0, j q0, k q0
  const double concentration = -2.0 / (sigma * sigma);                   // omega = sigma^2 / 4
  return Bingham::from_parameters(R, Quaternion(0.0, concentration, concentration, 0.0));
}

}  // namespace

int main() {
  std::mt19937_64 rng(1);
  std::normal_distribution<double> noise(0.0, 5.0 * std::numbers::pi / 180.0);
  const Quaternion truth = antipode::quaternion_exp(Vector3(0.2, -0.3, 2.0));

  // Fit: the maximum-likelihood density of the camera's measurements, from their scatter. Signs do not
  // matter.
  constexpr int kMeasurements = 4000;
  Matrix4 scatter = Matrix4::Zero();
  for (int k = 0; k < kMeasurements; ++k) {
    const Quaternion error = antipode::quaternion_exp(Vector3(noise(rng), noise(rng), noise(rng)));
    const Quaternion q = (k % 2 ? -1.0 : 1.0) * antipode::hamilton_product(truth, error);
    scatter += q * q.transpose() / kMeasurements;
  }
  const Bingham camera = Bingham::fit(scatter);
  std::cout << "camera : " << angle_deg(camera.mode(), truth) << " deg off, known to "
            << spread_deg(camera, Vector3::UnitX()) << " deg\n";
  expect(angle_deg(camera.mode(), truth) < 0.5, "the mode is the mean orientation");
  expect(std::abs(spread_deg(camera, Vector3::UnitX()) - 5.0) < 0.3, "the spread of the measurements");

  // Product: Bayes' rule, exactly. Gravity sharpens roll and pitch and leaves the heading alone.
  const Vector3 up_body = antipode::rotate(antipode::conjugate(truth), Vector3::UnitZ());
  const Bingham both = camera.product(from_gravity(up_body, 0.5 * std::numbers::pi / 180.0));
  std::cout << "both   : " << angle_deg(both.mode(), truth) << " deg off, known to "
            << spread_deg(both, Vector3::UnitX()) << " deg in tilt and " << spread_deg(both, Vector3::UnitZ())
            << " deg in heading\n";
  expect(spread_deg(both, Vector3::UnitX()) < 0.51, "the tilt from gravity");
  expect(std::abs(spread_deg(both, Vector3::UnitZ()) - spread_deg(camera, Vector3::UnitZ())) < 0.1,
         "the heading from the camera");
  expect(both.entropy() < camera.entropy(), "there is more to know than from the camera alone");
  expect(both.kl_divergence(camera) > 0.0, "and it is something else");

  // Sample: at random, or at 15 points that carry the same scatter and hence the same density.
  Matrix4 random_scatter = Matrix4::Zero();
  constexpr int kDraws = 20000;
  for (int k = 0; k < kDraws; ++k) {
    const Quaternion q = both.sample(rng);
    random_scatter += q * q.transpose() / kDraws;
  }
  const auto points = antipode::sample(antipode::BinghamGnomonicRule{}, both);
  Matrix4 point_scatter = Matrix4::Zero();
  for (int k = 0; k < points.size(); ++k) {
    point_scatter += points.weights[k] * points.points.col(k) * points.points.col(k).transpose();
  }
  std::cout << "scatter: " << (random_scatter - both.scatter()).norm() << " off with " << kDraws << " draws, "
            << (point_scatter - both.scatter()).norm() << " with " << points.size() << " points\n";
  expect((random_scatter - both.scatter()).norm() < 3e-3, "the scatter of random draws");
  expect((point_scatter - both.scatter()).norm() < 1e-13, "the scatter of the points");
}
