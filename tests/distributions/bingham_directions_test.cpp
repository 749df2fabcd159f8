// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <vector>

#include <antipode/distributions/bingham_directions.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

const Vector3<double> kUp(0, 0, 1);

/// All pairs of axes, and random ones: body and reference may be opposite.
[[nodiscard]] std::vector<Vector3<double>> directions() {
  Rng rng(1);
  std::vector<Vector3<double>> all;
  for (int i = 0; i < 3; ++i) {
    all.push_back(Vector3<double>::Unit(i));
    all.push_back(-Vector3<double>::Unit(i));
    all.push_back(random_unit<double, 3>(rng));
  }
  all.push_back(Vector3<double>(1e-9, 0, -1).normalized());
  return all;
}

}  // namespace

TEST_CASE("The density of a direction is von Mises and Fisher's for every orientation",
          "[bingham_directions]") {
  for (const double concentration : {0.0, 1e-3, 1.0, 50.0, 1e4}) {
    for (const auto& body : directions()) {
      for (const auto& reference : directions()) {
        CAPTURE(concentration, body.transpose(), reference.transpose());
        const auto density = bingham_from_direction<double>(3.0 * body, 7.0 * reference, concentration);
        Rng rng(2);
        const auto p = random_quaternion<double>(rng), q = random_quaternion<double>(rng);
        const auto cosine = [&](const Vector4<double>& x) { return rotate(x, body).dot(reference); };
        const double expected = concentration * (cosine(p) - cosine(q));
        CHECK(std::abs(density.log_density(p) - density.log_density(q) - expected) <=
              1e-14 * (1.0 + 10 * concentration));
        CHECK(density.concentrations()[2] == 0.0);  // the heading is free
        CHECK((rotate(density.mode(), body) - reference).norm() <= 1e-14);
        CHECK((rotate(Vector4<double>(density.axes().col(2)), body) - reference).norm() <= 1e-14);
      }
    }
  }
}

TEST_CASE("Draws from the density of gravity have its direction and any heading",
          "[bingham_directions][random]") {
  constexpr int kDraws = 20000;
  const Vector3<double> gravity(0, 0, -9.81);
  for (const double sigma : {0.3, 3.0, 30.0}) {
    CAPTURE(sigma);
    const Vector3<double> f = 9.5 * Vector3<double>(0.6, -0.48, 0.64);
    const double kappa = 9.5 * 9.81 / (sigma * sigma);
    const auto density = bingham_from_gravity(f, gravity, sigma);
    Rng rng(3);
    Vector3<double> mean = Vector3<double>::Zero();
    Vector2<double> heading = Vector2<double>::Zero(), twice_heading = Vector2<double>::Zero();
    for (int i = 0; i < kDraws; ++i) {
      const Vector4<double> q = density.sample(rng);
      mean += rotate(conjugate(q), kUp) / kDraws;
      const Vector3<double> ahead = rotate(q, Vector3<double>::UnitX());
      const double psi = std::atan2(ahead[1], ahead[0]);
      heading += Vector2<double>(std::cos(psi), std::sin(psi)) / kDraws;
      twice_heading += Vector2<double>(std::cos(2 * psi), std::sin(2 * psi)) / kDraws;
    }
    const double length = 1.0 / std::tanh(kappa) - 1.0 / kappa;
    // Each coordinate of a unit vector has a variance of at most one.
    const double allowed = 4.0 / std::sqrt(kDraws);
    CHECK((mean - length * f / 9.5).norm() <= allowed);
    CHECK(heading.norm() <= allowed);
    CHECK(twice_heading.norm() <= allowed);
    // Concentrated: 1 - cos of the tilt is exponential with the mean 1 / kappa, and the same standard
    // deviation.
    if (kappa > 100.0) {
      CHECK(std::abs((1.0 - mean.dot(f) / 9.5) * kappa - 1.0) <= 4.0 / std::sqrt(kDraws) + 1.0 / kappa);
    }
  }
}

TEST_CASE("Gravity and a heading determine the orientation", "[bingham_directions]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto truth = random_quaternion<double>(rng);
    const Vector3<double> gravity(0, 0, -9.81), north(0.5, 0.0, -0.8);
    const auto seen = [&](const Vector3<double>& v) { return Vector3<double>(rotate(conjugate(truth), v)); };
    const auto tilt = bingham_from_gravity<double>(-seen(gravity), gravity, 0.05);
    const auto both = tilt.product(bingham_from_direction<double>(seen(north), north, 1e4));
    CHECK(std::abs(both.mode().dot(truth)) >= 1.0 - 1e-12);
    CHECK(both.concentrations()[2] < -100.0);
    // Information adds: about the vertical, only the horizontal part of the field tells.
    const double horizontal = 0.25 / 0.89;
    const Matrix4<double> L = left_matrix(truth);
    const Vector3<double> down_body = seen(gravity) / 9.81;
    const Vector4<double> about_vertical = L * Vector4<double>(0, down_body[0], down_body[1], down_body[2]);
    const double information = -about_vertical.dot(both.parameter_matrix() * about_vertical);
    CHECK(information == Approx(2e4 * horizontal).epsilon(1e-9));
  }
}

TEST_CASE("Directions that say nothing are refused with the value", "[bingham_directions][error]") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [](const Vector3<double>& body, const Vector3<double>& reference,
                          double concentration) {
    return error_message([&] { (void)bingham_from_direction<double>(body, reference, concentration); });
  };
  CHECK(contains(message({0, 0, 0}, kUp, 1.0), "direction is zero or not finite: [0; 0; 0]"));
  CHECK(contains(message(kUp, {kNan, 0, 0}, 1.0), "direction is zero or not finite: [nan; 0; 0]"));
  CHECK(contains(message(kUp, kUp, -1.0), "concentration of a direction is negative or not a number: -1"));
  CHECK(contains(message(kUp, kUp, kNan), "not a number: nan"));
  CHECK(contains(error_message([] {
                   (void)bingham_from_gravity<double>({0, 0, 9.8}, {0, 0, -9.8}, 0.0);
                 }),
                 "specific force is not positive: 0"));
  // Lengths whose squares overflow are no reason to refuse a direction.
  CHECK(std::abs(bingham_from_direction<double>(1e200 * kUp, 1e-200 * kUp, 1.0).mode().norm() - 1.0) <=
        1e-15);
}

}  // namespace antipode::test
