// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <antipode/detail/products.hpp>
#include <antipode/detail/symmetric_eigen.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

template <class Scalar, int N>
void check_decomposition(const Matrix<Scalar, N>& A) {
  const auto eigen = detail::symmetric_eigen(A);
  // An entry is turned 2 (N - 1) times in each of about six sweeps, and rounded twice each time.
  constexpr double kTolerance = 24 * (N - 1) * kEpsilon<Scalar>;
  const Matrix<Scalar, N> again = detail::scaled_square<Scalar, N, N>(eigen.vectors, eigen.values);
  const Matrix<Scalar, N> identity = eigen.vectors.transpose().lazyProduct(eigen.vectors);
  CHECK(max_difference(again, A) <= kTolerance * static_cast<double>(A.norm()));
  CHECK(max_difference(identity, Matrix<Scalar, N>::Identity()) <= kTolerance);
  CHECK(std::is_sorted(eigen.values.begin(), eigen.values.end()));
}

/// A positive definite matrix whose rows and columns have the sizes of `scale`, exactly symmetric.
Matrix4<double> graded_covariance(Rng& rng, const Vector4<double>& scale) {
  const Matrix4<double> A = scale.asDiagonal() * random_covariance<double, 4>(rng, 0.1) * scale.asDiagonal();
  return 0.5 * (A + A.transpose());
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("A symmetric matrix is put together again from its eigenvectors", "[eigen][law]",
                       ((class Scalar, int N), Scalar, N), (float, 3), (double, 2), (double, 3), (double, 4),
                       (double, 6)) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Matrix<Scalar, N> A = random_matrix<Scalar, N>(rng);
    check_decomposition<Scalar, N>(A + A.transpose());
    check_decomposition<Scalar, N>(A.col(0) * A.col(0).transpose());
    check_decomposition<Scalar, N>(A.col(0) * A.col(0).transpose() - A.col(1) * A.col(1).transpose());
  }
  check_decomposition<Scalar, N>(Matrix<Scalar, N>::Zero());
  check_decomposition<Scalar, N>(Matrix<Scalar, N>::Identity());
  check_decomposition<Scalar, N>(Matrix<Scalar, N>::Ones());
}

TEST_CASE("Small eigenvalues of a graded positive matrix are relatively accurate", "[eigen]") {
  for (unsigned seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Matrix4<double> A = graded_covariance(rng, {1e-7, 1e-4, 1e-2, 1.0});
    const auto eigen = detail::symmetric_eigen<double, 4>(A);
    const auto oracle = detail::symmetric_eigen<long double, 4>(A.cast<long double>());
    for (int i = 0; i < 4; ++i) {
      // The condition of the scaled matrix is 10; values down to 1e-15 of the largest.
      CHECK(std::abs(eigen.values[i] / static_cast<double>(oracle.values[i]) - 1.0) <= 1e-13);
    }
  }
}

TEST_CASE("A very small or very large matrix is decomposed as accurately as any other", "[eigen][law]") {
  for (unsigned seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Matrix4<double> A = graded_covariance(rng, {1e-4, 1e-3, 1e-2, 1.0});
    const auto eigen = detail::symmetric_eigen<double, 4>(A);
    for (const int exponent : {-960, 1020}) {
      CAPTURE(exponent);
      const Matrix4<double> extreme = A.unaryExpr([&](double entry) { return std::ldexp(entry, exponent); });
      const auto scaled = detail::symmetric_eigen<double, 4>(extreme);
      CHECK(scaled.vectors == eigen.vectors);
      for (int i = 0; i < 4; ++i) CHECK(scaled.values[i] == std::ldexp(eigen.values[i], exponent));
    }
  }
}
