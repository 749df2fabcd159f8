// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include <antipode/filters/weighted_sums.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"

using namespace antipode;
using namespace antipode::test;

TEST_CASE("Rows added one by one are the same as together", "[least-squares]") {
  Rng rng(1);
  WeightedSums<double, 3> rows, together;
  const Vector2<double> e(0.3, -0.7);
  const auto J = random_matrix<double, 2, 3>(rng);
  using Number = Vector<double, 1>;
  for (int i = 0; i < 2; ++i) rows.add<1>(Number(e[i]), Number(4.0), J.row(i));
  together.add<2>(e, 4.0 * Matrix2<double>::Identity(), J);
  CHECK(max_difference(rows.information(), together.information()) < 1e-15);
  CHECK(max_difference(rows.vector(), together.vector()) < 1e-15);
  CHECK(rows.squared_distance() == Approx(together.squared_distance()).epsilon(1e-14));
  CHECK(rows.numbers() == together.numbers());
}

TEST_CASE("A measurement that cannot be predicted costs more than any other, and pulls at nothing",
          "[least-squares]") {
  const CauchyLoss<double> loss;
  WeightedSums<double, 1, 0, CauchyLoss<double>> far(loss), missed(loss);
  using Number = Vector<double, 1>;
  far.add<1>(Number(900.0), Number(1.0), Number(1.0));
  missed.miss(1);
  CHECK(missed.cost() > far.cost());
  CHECK(missed.information().isZero(0.0));
  CHECK(missed.measurements() == 0);
}

TEST_CASE("What no measurement depends on has no root", "[least-squares]") {
  WeightedSums<double, 2> sums;
  CHECK_FALSE(sums.root());
  using Number = Vector<double, 1>;
  sums.add<1>(Number(1.0), Number(1.0), Matrix<double, 1, 2>(1.0, 1.0));
  CHECK_FALSE(sums.root());
  CHECK_FALSE(sums.covariance_by_noise());
  sums.add_prior(Matrix2<double>::Identity(), Vector2<double>::Zero(), 0.0);
  REQUIRE(sums.root());
  CHECK(max_difference(sums.solve(*sums.root(), sums.vector()), Vector2<double>::Constant(1.0 / 3.0)) <
        1e-15);
}

TEST_CASE("Noise that is no covariance, and numbers that are not finite, are noticed", "[least-squares]") {
  using Number = Vector<double, 1>;
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto finite = [](double e, double S_inverse, double J) {
    WeightedSums<double, 1> sums;
    sums.add<1>(Number(e), Number(S_inverse), Number(J));
    return sums.finite();
  };
  CHECK(finite(1.0, 1.0, 1.0));
  CHECK_FALSE(finite(1.0, -1.0, 1.0));
  CHECK_FALSE(finite(kNaN, 1.0, 1.0));
  CHECK_FALSE(finite(1.0, 1.0, kNaN));
  CHECK_FALSE(finite(1e200, 1.0, 1.0));
}
