// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include <antipode/filters/angle_measurements.hpp>
#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/quadratic_update.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"

namespace antipode::test {
namespace {

constexpr double kPi = std::numbers::pi;
using Pose = DualQuaternion<double>;
using Belief = PoseGaussian<double>;
using Heading = NoisyMeasurement<double, 1>;

[[nodiscard]] double heading_of(const Pose& x) {
  const Matrix3<double> R = x.rotation_matrix();
  return std::atan2(R(1, 0), R(0, 0));
}

/// The heading as atan2 gives it, with its Jacobian for a body that turns about the vertical only.
struct HeadingModel {
  Vector<double, 1> operator()(const Pose& x, std::size_t) const { return Vector<double, 1>(heading_of(x)); }
  Vector<double, 1> operator()(const Pose& x, std::size_t i, Matrix<double, 1, 6>& J) const {
    J << 0, 0, 1, 0, 0, 0;
    return (*this)(x, i);
  }
};

[[nodiscard]] Pose turned(double yaw) {
  Vector6<double> xi = Vector6<double>::Zero();
  xi[2] = yaw;
  return Pose::exp(xi);
}

constexpr double kPriorSigma = 0.1, kSigma = 0.05;

/// A body that turns about the vertical only: the heading is linear, and the posterior Kalman's.
[[nodiscard]] Belief prior_at(double yaw) {
  Vector6<double> sigma = Vector6<double>::Zero();
  sigma[2] = kPriorSigma;
  return {turned(yaw), sigma.cwiseAbs2().asDiagonal()};
}

void check_heading(const UpdateResult<Belief>& result, double prior_yaw, double measured) {
  const double variance = 1 / (1 / (kPriorSigma * kPriorSigma) + 1 / (kSigma * kSigma));
  const double innovation = wrap_angle(measured - prior_yaw);
  const double expected = prior_yaw + variance / (kSigma * kSigma) * innovation;
  CAPTURE(prior_yaw, measured, static_cast<int>(result.status));
  CHECK(result.status == UpdateStatus::kConverged);
  CHECK(std::abs(wrap_angle(heading_of(result.posterior.pose) - expected)) < 1e-3 * std::sqrt(variance));
  CHECK(std::abs(result.posterior.covariance(2, 2) / variance - 1) < 1e-3);
  CHECK(std::abs(result.nis - innovation * innovation / (kPriorSigma * kPriorSigma + kSigma * kSigma)) <
        1e-3);
}

TEST_CASE("A heading near pi is updated as anywhere else", "[filters][angles]") {
  for (const double prior_yaw : {-kPi + 0.02, kPi - 0.02, kPi, 0.0}) {
    for (const double offset : {-0.15, -0.03, 0.0, 0.06, 0.14}) {
      const double measured = wrap_angle(prior_yaw + offset);
      const std::vector<Heading> z = {{Vector<double, 1>(measured), Matrix<double, 1>(kSigma * kSigma)}};
      const auto h = with_angles<0>(z, HeadingModel{});
      const Belief prior = prior_at(prior_yaw);
      check_heading(quadratic_update(prior, GaussianMeasurements(z, h)), prior_yaw, measured);
      check_heading(linearized_update(prior, z, h), prior_yaw, measured);
      check_heading(gauss_newton_update(prior, z, h), prior_yaw, measured);
    }
  }
}

TEST_CASE("A measured angle that counts several turns is as good as a wrapped one", "[filters][angles]") {
  const std::vector<Heading> z = {{Vector<double, 1>(6 * kPi + 0.1), Matrix<double, 1>(kSigma * kSigma)}};
  check_heading(linearized_update(prior_at(0), z, with_angles<0>(z, HeadingModel{})), 0, 0.1);
}

TEST_CASE("Only the named rows are angles", "[filters][angles]") {
  // Range, azimuth and elevation.
  const std::vector<NoisyMeasurement<double, 3>> z = {
      {Vector3<double>(100, 3, 0.1), Matrix3<double>::Identity()}};
  const auto h = with_angles<1, 2>(z, [](const Pose&, std::size_t) { return Vector3<double>(90, -3, 0.2); });
  const auto predicted = h(Pose::identity(), 0);
  REQUIRE(predicted);
  CHECK((*predicted)[0] == 90);
  CHECK(std::abs((*predicted)[1] - (2 * kPi - 3)) < 1e-14);
  CHECK(std::abs((*predicted)[2] - 0.2) < 1e-15);
}

TEST_CASE("What cannot be predicted or is not finite stays so with angles", "[filters][angles]") {
  const std::vector<Heading> z = {{Vector<double, 1>(3), Matrix<double, 1>(1)}};
  const auto nothing = [](const Pose&, std::size_t) { return std::optional<Vector<double, 1>>(); };
  CHECK_FALSE(with_angles<0>(z, nothing)(Pose::identity(), 0));
  const auto nan = [](const Pose&, std::size_t) { return Vector<double, 1>(std::nan("")); };
  CHECK(std::isnan((*with_angles<0>(z, nan)(Pose::identity(), 0))[0]));
  CHECK(linearized_update(prior_at(0), z, with_angles<0>(z, nan)).status == UpdateStatus::kNotFinite);
}

TEST_CASE("A list with a measurement that is too short for an angle is refused", "[filters][angles]") {
  using AnyRows = NoisyMeasurement<double, Eigen::Dynamic>;
  const std::vector<AnyRows> z = {{Vector<double, Eigen::Dynamic>::Zero(2), Matrix2<double>::Identity()},
                                  {Vector<double, Eigen::Dynamic>::Constant(1, 7.5), Matrix<double, 1>(1)}};
  const auto h = [](const Pose&, std::size_t) { return Vector<double, Eigen::Dynamic>::Zero(2).eval(); };
  CHECK_NOTHROW(with_angles<0>(z, h));
  CHECK(contains(error_message([&] { (void)with_angles<1>(z, h); }), "[7.5]"));
}

}  // namespace
}  // namespace antipode::test
