// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/noisy_measurement.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/robust_likelihood.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using AnyRows = NoisyMeasurement<double, Eigen::Dynamic>;
using AnyVector = Vector<double, Eigen::Dynamic>;
using AnyMatrix = Matrix<double, Eigen::Dynamic>;

/// The position, or its height alone, with the Jacobian in the split chart.
struct PositionOrHeight {
  AnyVector operator()(const Pose& x, std::size_t i) const {
    return i == 0 ? AnyVector(x.translation()) : AnyVector(x.translation().tail<1>());
  }
  AnyVector operator()(const Pose& x, std::size_t i, Matrix<double, Eigen::Dynamic, 6>& J) const {
    const int rows = i == 0 ? 3 : 1;
    J.setZero();
    J.rightCols(rows).bottomRows(rows).setIdentity();
    return (*this)(x, i);
  }
};

[[nodiscard]] std::vector<AnyRows> position_and_height() {
  return {{AnyVector(Vector3<double>(1, 2, 3)), AnyMatrix(0.04 * Matrix3<double>::Identity())},
          {AnyVector(Vector<double, 1>(3.1)), AnyMatrix(Vector<double, 1>(0.01))}};
}

[[nodiscard]] SplitPoseGaussian<double> around_origin() {
  return {Pose::identity(), pose_covariance<double>(0.1, 5.0)};
}

}  // namespace

TEST_CASE("Measurements of different lengths go into one update", "[measurements]") {
  const auto prior = around_origin();
  const auto z = position_and_height();
  const auto linearized = linearized_update(prior, z, PositionOrHeight{});
  const auto newton = gauss_newton_update(prior, z, PositionOrHeight{});
  const auto quadratic = quadratic_update(prior, GaussianMeasurements(z, PositionOrHeight{}));
  // Independent axes: informations add up.
  const double height_variance = 1.0 / (1.0 / 25.0 + 1.0 / 0.04 + 1.0 / 0.01);
  const double height = height_variance * (3.0 / 0.04 + 3.1 / 0.01);
  for (const auto& result : {linearized, newton, quadratic}) {
    CHECK(result.status == UpdateStatus::kConverged);
    CHECK(result.posterior.pose.translation()[2] == Approx(height).epsilon(1e-9));
    CHECK(result.posterior.covariance(5, 5) == Approx(height_variance).epsilon(1e-9));
    CHECK(result.posterior.covariance(3, 3) == Approx(1.0 / (1.0 / 25.0 + 1.0 / 0.04)).epsilon(1e-9));
    CHECK(result.nis == Approx(linearized.nis).epsilon(1e-9));
  }
}

TEST_CASE("A robust likelihood takes measurements of different lengths", "[measurements]") {
  const auto z = position_and_height();
  const StudentT<double> noise;
  const RobustMeasurements likelihood(z, PositionOrHeight{}, noise);
  CHECK(likelihood(Pose::identity()) ==
        Approx(noise.log_density(14.0 / 0.04, 3) + noise.log_density(3.1 * 3.1 / 0.01, 1)));
}

TEST_CASE("No measurement leaves the prior", "[measurements]") {
  const auto prior = around_origin();
  const std::vector<AnyRows> none;
  const auto result = linearized_update(prior, none, PositionOrHeight{});
  CHECK(result.status == UpdateStatus::kConverged);
  CHECK(result.posterior.covariance == prior.covariance);
  CHECK(result.nis == 0.0);
  CHECK(gauss_newton_update(prior, none, PositionOrHeight{}).status == UpdateStatus::kConverged);
  CHECK(quadratic_update(prior, GaussianMeasurements(none, PositionOrHeight{}))
            .posterior.covariance.isApprox(prior.covariance));
}

TEST_CASE("Lengths that do not fit are named", "[measurements][error]") {
  const auto prior = around_origin();
  std::vector<AnyRows> z = position_and_height();
  z[1].R = AnyMatrix::Identity(2, 2);
  const std::string size_of_R =
      "covariance of a measurement is not as large as the measurement: [1, 0; 0, 1]";
  CHECK(error_message([&] { (void)linearized_update(prior, z, PositionOrHeight{}); }) == size_of_R);
  CHECK(error_message([&] { (void)gauss_newton_update(prior, z, PositionOrHeight{}); }) == size_of_R);
  CHECK(error_message([&] { GaussianMeasurements(z, PositionOrHeight{}); }) == size_of_R);
  const auto position = [](const Pose& x, std::size_t) { return AnyVector(x.translation()); };
  const std::string rows = "the model predicts another number of rows than were measured: 3";
  CHECK(error_message([&] { (void)linearized_update(prior, position_and_height(), position); }) == rows);
  CHECK(error_message([&] { (void)GaussianMeasurements(position_and_height(), position)(Pose()); }) == rows);
  const auto wrong_jacobian = [](const Pose&, std::size_t i, Matrix<double, Eigen::Dynamic, 6>& J) {
    J.setZero(5, 6);
    return position_and_height()[i].z;
  };
  CHECK(error_message([&] { (void)gauss_newton_update(prior, position_and_height(), wrong_jacobian); }) ==
        "the Jacobian of the model has another number of rows than were measured: 5");
}

TEMPLATE_TEST_CASE("One triangle of a covariance is refused with its value", "[measurements][error]", float,
                   double) {
  using Scalar = TestType;
  using Split = SplitPoseGaussian<Scalar>;
  using Position = NoisyMeasurement<Scalar, 3>;
  const Split prior{DualQuaternion<Scalar>::identity(), pose_covariance<Scalar>(0.1, 5.0)};
  const auto h = [](const DualQuaternion<Scalar>& x, std::size_t) {
    return Vector3<Scalar>(x.translation());
  };
  const auto h_and_J = [&](const DualQuaternion<Scalar>& x, std::size_t i, Matrix<Scalar, 3, 6>& J) {
    J.setZero();
    J.template rightCols<3>().setIdentity();
    return h(x, i);
  };
  Matrix3<Scalar> upper;
  upper << Scalar(2), Scalar(1), Scalar(0), Scalar(0), Scalar(2), Scalar(0), Scalar(0), Scalar(0), Scalar(2);
  const auto updates = [&](const Matrix3<Scalar>& R) {
    const std::vector<Position> z{{Vector3<Scalar>(1, 2, 3), Matrix3<Scalar>::Identity()},
                                  {Vector3<Scalar>(1, 2, 3), R}};
    return std::array{
        error_message([&] { (void)linearized_update(prior, z, h); }),
        error_message([&] { (void)gauss_newton_update(prior, z, h_and_J); }),
        error_message([&] { (void)GaussianMeasurements<Scalar, 3, decltype(h)>(z, h); }),
        error_message([&] { (void)RobustMeasurements<Scalar, 3, decltype(h), StudentT<Scalar>>(z, h, {}); })};
  };
  for (const std::string& message : updates(upper)) {
    CHECK(contains(message, "covariance of a measurement is not"));
    CHECK(contains(message, "symmetric: [2, 1, 0; 0, 2, 0; 0, 0, 2]"));
  }
  for (const std::string& message : updates(upper.transpose())) {
    CHECK(contains(message, "symmetric: [2, 0, 0; 1, 2, 0; 0, 0, 2]"));
  }
  // Both triangles, one of them with rounding errors.
  Matrix3<Scalar> rounded = upper + upper.transpose();
  rounded(0, 1) *= Scalar(1) + std::numeric_limits<Scalar>::epsilon();
  for (const std::string& message : updates(rounded)) CHECK(message == "nothing thrown");
}

TEST_CASE("A covariance that is not a number in the triangle that is not read is not used",
          "[measurements]") {
  const auto prior = around_origin();
  auto z = position_and_height();
  z[0].R(0, 2) = std::numeric_limits<double>::quiet_NaN();
  for (const auto& result :
       {linearized_update(prior, z, PositionOrHeight{}), gauss_newton_update(prior, z, PositionOrHeight{})}) {
    CHECK(result.status == UpdateStatus::kNotFinite);
    CHECK(result.posterior.covariance == prior.covariance);
  }
}

TEST_CASE("Measurements that are no measurements are refused", "[measurements][error]") {
  using One = NoisyMeasurement<double, 1>;
  const auto roots = [](double z, double R) {
    return error_message([&] {
      (void)detail::roots_of_noise<double, 1>({One{Vector<double, 1>(z), Vector<double, 1>(R)}});
    });
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK(contains(roots(kNan, 1.0), "measurement is not finite"));
  CHECK(contains(roots(0.0, kNan), "covariance of a measurement is not finite or not symmetric"));
  CHECK(contains(roots(0.0, 0.0), "covariance of a measurement is not positive definite: [0]"));
  CHECK(contains(roots(0.0, -1.0), "covariance of a measurement is not positive definite: [-1]"));
  CHECK(detail::roots_of_noise<double, 1>({One{Vector<double, 1>(0.0), Vector<double, 1>(4.0)}})[0](0, 0) ==
        2.0);
}
