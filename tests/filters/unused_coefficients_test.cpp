// SPDX-License-Identifier: MIT
// Robust least squares with fewer unknowns than its type has: those not used have a prior and no derivative.
#include <cstddef>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

#include <antipode/filters/robust_least_squares.hpp>

#include "filters/linear_problem.hpp"
#include "support/catch.hpp"
#include "support/no_allocation.hpp"

using namespace antipode;
using namespace antipode::test;

TEST_CASE("Of a field of coefficients as many may be used as are known at run time, without allocating",
          "[least-squares]") {
  // Those that are not used change no measurement, and have a prior of variance 1.
  constexpr int kMost = 16;
  using Field = VectorChart<double, kMost>;
  for (const int used : {1, 5, 11, kMost}) {
    CAPTURE(used);
    Rng rng(static_cast<unsigned>(used));
    LinearProblem<kMost, 0> problem(rng, 40);
    for (auto& row : problem.rows) row.J.rightCols(kMost - used).setZero();
    LeastSquaresPrior<Field> unused{Field::Point::Zero()};
    unused.information.diagonal().tail(kMost - used).setOnes();
    const auto fit = [&](const auto& noise, const LeastSquaresOptions<double>& options) {
      return without_allocation([&] {
        return robust_least_squares<Field>(Field::Point::Zero(), problem, noise, options, &unused);
      });
    };
    Eigen::MatrixXd A(80, used);
    Eigen::VectorXd b(80);
    for (std::size_t i = 0; i < problem.rows.size(); ++i) {
      const auto& row = problem.rows[i];
      const Matrix2<double> U = row.S_inverse.llt().matrixU();
      A.middleRows<2>(2 * static_cast<Eigen::Index>(i)) = U * row.J.leftCols(used);
      b.segment<2>(2 * static_cast<Eigen::Index>(i)) = U * row.z;
    }
    const Eigen::VectorXd x = A.colPivHouseholderQr().solve(b);
    const Eigen::MatrixXd P = (A.transpose() * A).inverse();
    const auto result = fit(NormalNoise<double>{}, {.covariance = CovarianceFrom::kNoise});
    CHECK(result.converged());
    CHECK((result.state.head(used) - x).norm() < 1e-11);
    CHECK((result.covariance.topLeftCorner(used, used) - P).norm() < 1e-11);
    CHECK(result.state.tail(kMost - used).isZero(0.0));
    CHECK(result.covariance.bottomRightCorner(kMost - used, kMost - used).isIdentity(1e-15));
    CHECK(result.squared_distance == Approx((A * x - b).squaredNorm()).epsilon(1e-11));
    // By the residuals: the same times their mean square, whose degrees of freedom the unused ones do not
    // change.
    const double mean_square = (A * x - b).squaredNorm() / (80 - used);
    const auto by_residuals = fit(NormalNoise<double>{}, {});
    CHECK((by_residuals.covariance.topLeftCorner(used, used) - mean_square * P).norm() < 1e-11);
  }
}

TEST_CASE("Coefficients that are not used change nothing of a robust fit of the others", "[least-squares]") {
  constexpr int kUsed = 5, kMost = 16;
  using Field = VectorChart<double, kMost>;
  using Used = VectorChart<double, kUsed>;
  for (unsigned seed = 0; seed < 5; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    LinearProblem<kMost, 0> problem(rng, 40);
    for (std::size_t i = 0; i < problem.rows.size(); ++i) {
      problem.rows[i].J.rightCols<kMost - kUsed>().setZero();
      if (i % 10 == 0) problem.rows[i].z *= 30.0;  // outliers
    }
    LeastSquaresPrior<Field> unused{Field::Point::Zero()};
    unused.information.diagonal().tail<kMost - kUsed>().setOnes();
    const auto exact_size = [&](const Used::Point& c, auto& sums) {
      for (const auto& [z, S_inverse, J, K] : problem.rows) {
        const Matrix<double, 2, kUsed> of_used = J.leftCols<kUsed>();
        sums.add(Vector2<double>(z - of_used * c), S_inverse, of_used);
      }
    };
    const auto expected = robust_least_squares<Used>(Used::Point::Zero(), exact_size, CauchyLoss<double>{});
    const auto result = without_allocation([&] {
      return robust_least_squares<Field>(Field::Point::Zero(), problem, CauchyLoss<double>{}, {}, &unused);
    });
    REQUIRE(expected.converged());
    CHECK(result.status == expected.status);
    CHECK(max_difference(result.state.head<kUsed>(), expected.state) < 1e-11);
    CHECK(max_difference(result.covariance.topLeftCorner<kUsed, kUsed>(), expected.covariance) < 1e-11);
    CHECK(result.cost == Approx(expected.cost).epsilon(1e-11));
    CHECK(result.log_evidence == Approx(expected.log_evidence).epsilon(1e-11));
    CHECK(result.evaluations == expected.evaluations);
  }
}
