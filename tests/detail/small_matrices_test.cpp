// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/least_squares.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/solve.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// Positive definite with eigenvalues between 0.1 and 1.
template <class Scalar, int N>
Matrix<Scalar, N> random_definite(Rng& rng) {
  return random_covariance<Scalar, N>(rng, 0.1);
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("Products of three matrices are symmetric and what they say", "[matrix]",
                       ((class Scalar, int M, int N), Scalar, M, N), (float, 3, 3), (double, 6, 3)) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto A = random_matrix<Scalar, M, N>(rng);
    const Vector<Scalar, N> d = random_matrix<Scalar, N, 1>(rng);
    const Matrix<Scalar, N> D = d.asDiagonal();
    const auto S = random_definite<Scalar, N>(rng);
    const auto scaled = detail::scaled_square<Scalar, M, N>(A, d);
    const auto congruent = detail::congruence<Scalar, M, N>(A, S);
    const Matrix<Scalar, N, M> At = A.transpose();
    const Matrix<Scalar, M, N> AD = A * D, AS = A * S;
    // Sums of N^2 products of order one.
    CHECK(max_difference(scaled, AD * At) <= N * N * kEpsilon<Scalar>);
    CHECK(max_difference(congruent, AS * At) <= N * N * kEpsilon<Scalar>);
    CHECK(max_difference(scaled, scaled.transpose()) == 0.0);
    CHECK(max_difference(congruent, congruent.transpose()) == 0.0);
    Matrix<Scalar, M, N> sum = A;
    detail::add_outer_product<Scalar, M, N>(Scalar(2), A.col(0), d, sum);
    for (int i = 0; i < M; ++i) {
      for (int j = 0; j < N; ++j) {
        CHECK(static_cast<double>(std::abs(sum(i, j) - (A(i, j) + Scalar(2) * A(i, 0) * d[j]))) <=
              4 * kEpsilon<Scalar>);
      }
    }
  }
}

TEMPLATE_TEST_CASE_SIG("A Cholesky factor squares to its matrix and solves for it", "[matrix][law]",
                       ((class Scalar, int N), Scalar, N), (float, 3), (double, 6)) {
  // Backward stable: N roundings of order one; solving multiplies by the condition of 10.
  constexpr double kTolerance = 4 * N * kEpsilon<Scalar>;
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto A = random_definite<Scalar, N>(rng);
    const auto B = random_matrix<Scalar, N>(rng);
    const Vector<Scalar, N> b = B.col(0);
    const auto L = detail::cholesky_factor(A);
    REQUIRE(L.has_value());
    CHECK(max_difference(detail::scaled_square<Scalar, N, N>(*L, Vector<Scalar, N>::Ones()), A) <=
          kTolerance);
    CHECK(max_difference(*L * detail::solve_lower(*L, B), B) <= 10 * kTolerance);
    CHECK(max_difference(A * detail::solve_positive_definite(A, b), b) <= 10 * kTolerance);
    for (int i = 0; i < N; ++i) {
      CHECK((*L)(i, i) > Scalar(0));
      for (int j = i + 1; j < N; ++j) CHECK((*L)(i, j) == Scalar(0));
    }
  }
}

TEST_CASE("A matrix that is not positive definite has no Cholesky factor", "[matrix][error]") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(detail::cholesky_factor(Matrix2<double>{{1.0, 2.0}, {2.0, 1.0}}).has_value());
  CHECK_FALSE(detail::cholesky_factor(Matrix2<double>{{1.0, 1.0}, {1.0, 1.0}}).has_value());
  CHECK_FALSE(detail::cholesky_factor(Matrix2<double>{{kNan, 0.0}, {0.0, 1.0}}).has_value());
  CHECK_FALSE(detail::cholesky_factor(Matrix2<double>{{1.0, 0.0}, {0.0, kNan}}, 1.0).has_value());
}

TEST_CASE("Pivots that rounding lowers are raised to what they are at least", "[matrix]") {
  // I + c v v^T with v = (1, 1): the second pivot is 1 + c/(1 + c), and lost beside c = 1e20.
  const double c = 1e20;
  const auto L = detail::cholesky_factor(Matrix2<double>{{1.0 + c, c}, {c, 1.0 + c}}, 1.0);
  REQUIRE(L.has_value());
  CHECK((*L)(1, 1) == 1.0);
}

TEMPLATE_TEST_CASE_SIG("Linear equations are solved, whatever the order of their rows", "[matrix][law]",
                       ((class Scalar, int N), Scalar, N), (float, 3), (double, 6)) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    // An orthogonal matrix with its columns scaled by up to 1e3, and a zero for a pivot.
    Matrix<Scalar, N> A = random_orthogonal<Scalar, N>(rng);
    for (int j = 0; j < N; ++j) A.col(j) *= uniform<Scalar>(rng, 1.0, 1e3);
    A(0, 0) = Scalar(0);
    const Matrix<Scalar, N, 2> X = random_matrix<Scalar, N, 2>(rng);
    const Matrix<Scalar, N, 2> B = A * X;
    const auto solved = detail::solve(A, B);
    // Elimination with row pivots leaves residuals of N roundings of the largest product.
    CHECK(max_difference(A * solved, B) <= 8 * N * 1e3 * kEpsilon<Scalar>);
  }
}

TEST_CASE("A singular system has no finite solution", "[matrix]") {
  const Matrix2<double> A{{1.0, 2.0}, {2.0, 4.0}};
  CHECK_FALSE(detail::solve(A, Vector2<double>(1.0, 1.0)).allFinite());
}

TEST_CASE("Angles are no less impossible beside a large position", "[matrix][error]") {
  for (const double position : {1e-12, 1.0, 1e6, 1e12}) {
    CAPTURE(position);
    Matrix6<double> P = Matrix6<double>::Identity();
    P.bottomRightCorner<3, 3>() *= position;
    P.topLeftCorner<3, 3>() *= 0.01;
    const auto root = [&] {
      return detail::root_of_covariance<double, 6>("negative eigenvalue",
                                                   detail::checked_covariance<double, 6>("not symmetric", P));
    };
    CHECK(error_message(root) == "nothing thrown");
    P(0, 1) = P(1, 0) = 0.02;  // a correlation of 2
    CHECK(error_message(root).starts_with("negative eigenvalue"));
    P(0, 1) = P(1, 0) = 0.010001;
    CHECK(error_message(root).starts_with("negative eigenvalue"));
    P(0, 1) = 0.005;
    P(1, 0) = -0.005;
    CHECK(error_message(root).starts_with("not symmetric"));
    P(0, 1) = P(1, 0) = 0.0;
    P(2, 2) = -1e-6;
    CHECK(error_message(root).starts_with("negative eigenvalue"));
    P(2, 2) = 0.0;
    CHECK(error_message(root) == "nothing thrown");
    P(2, 2) = -1e-20;  // rounding beside .01
    CHECK(error_message(root) == "nothing thrown");
    P(0, 3) = P(3, 0) = 2.0 * std::sqrt(0.01 * position);
    CHECK(error_message(root).starts_with("negative eigenvalue"));
  }
}

TEST_CASE("The root of a singular covariance is right in every unit", "[matrix]") {
  for (const double unit : {1e-6, 1.0, 1e6}) {
    CAPTURE(unit);
    for (unsigned seed = 0; seed < 10; ++seed) {
      CAPTURE(seed);
      Rng rng(seed);
      const auto factor = random_matrix<double, 6, 4>(rng);
      Matrix6<double> P = factor * factor.transpose();
      P.bottomRows<3>() *= unit;
      P.rightCols<3>() *= unit;
      const auto root = detail::root_of_covariance<double, 6>("negative eigenvalue", P);
      const Matrix6<double> square = root.L * root.L.transpose();
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) {
          CHECK(std::abs(square(i, j) - P(i, j)) <=
                100 * kEpsilon<double> * std::sqrt(P(i, i) * P(j, j)) + 6e-9 * std::sqrt(P(i, i) * P(j, j)));
        }
      }
    }
  }
}

TEST_CASE("Least squares keep what only rows of a small weight know", "[matrix]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto A = random_matrix<double, 12, 6>(rng);
    const Vector6<double> x = random_matrix<double, 6, 1>(rng);
    for (const double weight : {1.0, 1e-8, 1e-30, 1e-150}) {
      CAPTURE(weight);
      // Four rows of weight one leave two directions to the other eight, whatever their order.
      Matrix<double, 12, 6> rows = A;
      for (int i = 0; i < 12; ++i) {
        if (i % 3 != 1) rows.row(i) *= weight;
      }
      const Vector<double, 12> b = rows * x;
      const detail::LeastSquares<double, 12, 6> solved(rows, b);
      CHECK(max_difference(solved.x, x) <= 1e-10);
      CHECK(solved.squared_residual <= 1e-24);
      Vector<double, 12> shifted = b;
      for (int i = 0; i < 12; ++i) {
        if (i % 3 != 1) shifted[i] += weight;
      }
      // The residual is that of the light rows, which cannot all be fulfilled.
      const double residual = detail::LeastSquares<double, 12, 6>(rows, shifted).squared_residual;
      CHECK(residual <= 8.0 * weight * weight * (1 + 1e-9));
    }
  }
}

TEST_CASE("The root of least squares is that of the inverse normal matrix", "[matrix]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto A = random_matrix<double, 12, 6>(rng);
    const Vector<double, 12> b = random_matrix<double, 12, 1>(rng);
    const detail::LeastSquares<double, 12, 6> solved(A, b);
    const Matrix6<double> normal = A.transpose() * A;
    CHECK(max_difference(solved.root * solved.root.transpose() * normal,
                         Matrix6<double>(Matrix6<double>::Identity())) <= 1e-10);
    CHECK(max_difference(normal * solved.x, A.transpose() * b) <= 1e-11);
    CHECK(solved.squared_residual == Approx((A * solved.x - b).squaredNorm()).epsilon(1e-10));
    CHECK(solved.log_determinant == Approx(0.5 * std::log(normal.determinant())).epsilon(1e-9));
  }
}
