// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <numbers>

#include <antipode/detail/products.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// Moments of log(exp(a) exp(b)) for Gaussian a and b of SE(3), by the series of Baker, Campbell and
/// Hausdorff,
///
///     a + b + [a, b]/2 + [a - b, [a, b]]/12 + ...,   [a, b] = ad(a) b,   ad(phi, rho) = [phi^, 0; rho^,
///     phi^].
///
/// For independent a and b the covariance is that of Barfoot and Furgale, "Associating uncertainty with
/// three-dimensional poses for use in estimation problems", 2014, Eq. (55).
namespace antipode::detail {

/// E[u^ K v^T^] (v^T^ the transpose of v^) for vectors u, v of R^3 with E[u v^T] = S.
template <class Scalar>
[[nodiscard]] Matrix3<Scalar> mean_of_skew_product(const Matrix3<Scalar>& S, const Matrix3<Scalar>& K) {
  Matrix3<Scalar> mean;
  for (int j = 0; j < 3; ++j) {
    const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
    for (int i = 0; i < 3; ++i) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
      mean(i, j) =
          S(i1, j1) * K(i2, j2) - S(i1, j2) * K(i2, j1) - S(i2, j1) * K(i1, j2) + S(i2, j2) * K(i1, j1);
    }
  }
  return mean;
}

/// E[ad(x) K ad(y)^T] for vectors x, y of R^6 with E[x y^T] = S, if it is symmetric.
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> mean_of_ad_product(const Matrix6<Scalar>& S, const Matrix6<Scalar>& K) {
  const auto mean = [&](int row, int column, int row_K, int column_K) -> Matrix3<Scalar> {
    return mean_of_skew_product<Scalar>(S.template block<3, 3>(row, column),
                                        K.template block<3, 3>(row_K, column_K));
  };
  Matrix6<Scalar> result;
  result.template topLeftCorner<3, 3>() = mean(0, 0, 0, 0);
  result.template bottomLeftCorner<3, 3>() = mean(3, 0, 0, 0) + mean(0, 0, 3, 0);
  result.template topRightCorner<3, 3>() = result.template bottomLeftCorner<3, 3>().transpose();
  result.template bottomRightCorner<3, 3>() =
      mean(3, 3, 0, 0) + mean(0, 3, 3, 0) + mean(3, 0, 0, 3) + mean(0, 0, 3, 3);
  return result;
}

/// E[ad(x) ad(y)] for vectors x, y of R^6 with E[x y^T] = S.
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> mean_of_ad_square(const Matrix6<Scalar>& S) {
  const auto mean = [&](int row, int column) -> Matrix3<Scalar> {  // E[u^ v^] = E[v u^T] - E[u.v] I
    Matrix3<Scalar> square = S.template block<3, 3>(row, column).transpose();
    square.diagonal().array() -= S(row, column) + S(row + 1, column + 1) + S(row + 2, column + 2);
    return square;
  };
  Matrix6<Scalar> result = Matrix6<Scalar>::Zero();
  result.template topLeftCorner<3, 3>() = result.template bottomRightCorner<3, 3>() = mean(0, 0);
  result.template bottomLeftCorner<3, 3>() = mean(3, 0) + mean(0, 3);
  return result;
}

/// E[[a, b]] for vectors of R^6 with E[a b^T] = C.
template <class Scalar>
[[nodiscard]] Vector6<Scalar> mean_bracket(const Matrix6<Scalar>& C) {
  const auto cross = [&](int i, int row, int column) {  // of E[u x v]
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    return C(row + i1, column + i2) - C(row + i2, column + i1);
  };
  Vector6<Scalar> mean;
  for (int i = 0; i < 3; ++i) {
    mean[i] = cross(i, 0, 0);
    mean[3 + i] = cross(i, 0, 3) + cross(i, 3, 0);
  }
  return mean;
}

/// ad(x).
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> ad(const Vector6<Scalar>& x) {
  Matrix6<Scalar> result = Matrix6<Scalar>::Zero();
  result.template topLeftCorner<3, 3>() = skew(Vector3<Scalar>(x.template head<3>()));
  result.template bottomRightCorner<3, 3>() = result.template topLeftCorner<3, 3>();
  result.template bottomLeftCorner<3, 3>() = skew(Vector3<Scalar>(x.template tail<3>()));
  return result;
}

/// The factor that makes the rotation of a covariance no wider than a uniform one, whose rotation vector has
/// the mean square pi^2/3 + 2 rad^2. The series says nothing about more.
template <class Scalar>
[[nodiscard]] Scalar factor_to_uniform(const Matrix6<Scalar>& P) {
  constexpr Scalar kUniform = std::numbers::pi_v<Scalar> * std::numbers::pi_v<Scalar> / Scalar(3) + Scalar(2);
  const Scalar mean_square = P(0, 0) + P(1, 1) + P(2, 2);
  return mean_square > kUniform ? std::sqrt(kUniform / mean_square) : Scalar(1);
}

/// The second moments of two zero-mean errors a and b.
template <class Scalar>
struct PairMoments {
  Matrix6<Scalar> P, Q;  ///< Cov a, Cov b
  Matrix6<Scalar> C;     ///< E[a b^T]

  /// The same with rotations no wider than uniform ones.
  [[nodiscard]] PairMoments within_rotations() const {
    const Scalar f_a = factor_to_uniform<Scalar>(P), f_b = factor_to_uniform<Scalar>(Q);
    PairMoments scaled = *this;
    if (f_a == Scalar(1) && f_b == Scalar(1)) return scaled;
    const auto scale = [](Matrix6<Scalar>& A, Scalar rows, Scalar columns) {
      A.template topRows<3>() *= rows;
      A.template leftCols<3>() *= columns;
    };
    scale(scaled.P, f_a, f_a);
    scale(scaled.Q, f_b, f_b);
    scale(scaled.C, f_a, f_b);
    return scaled;
  }
};

/// The m about which the error of exp(a) exp(b) = exp(m) exp(e) has the mean zero to second order, and the
/// covariance of e to fourth order, which is positive semidefinite. For independent a and b also what the
/// cubic terms add to directions that the others do not reach, up to twice of it.
template <class Scalar>
struct ProductMoments {
  Vector6<Scalar> mean;
  Matrix6<Scalar> covariance;

  explicit ProductMoments(const PairMoments<Scalar>& errors) {
    const auto& [P, Q, C] = errors.within_rotations();  // for the terms of higher order
    const Matrix6<Scalar> Ct = C.transpose();
    mean = Scalar(0.5) * mean_bracket<Scalar>(C);
    // The cubic terms, and log(exp(-m) exp(m + e)) = e - [m, e]/2, by their best linear approximations in a
    // and b.
    const Matrix6<Scalar> ad_m = ad<Scalar>(mean);
    const Matrix6<Scalar> J_a = Matrix6<Scalar>::Identity() - ad_m * Scalar(2.0 / 3.0) -
                                mean_of_ad_square<Scalar>(C - Q) * Scalar(1.0 / 12.0);
    const Matrix6<Scalar> J_b = Matrix6<Scalar>::Identity() - ad_m * Scalar(1.0 / 3.0) +
                                mean_of_ad_square<Scalar>(P - Ct) * Scalar(1.0 / 12.0);
    // The covariance of [a, b]/2: the narrow directions that the product of two wide ones moves along.
    Matrix6<Scalar> sum = Scalar(0.25) * mean_of_ad_product<Scalar>(P, Q);
    if (C.isZero(Scalar(0))) {
      // Cov [a, [a, b]], without its linear part, is the mean of two products, the second at most as large as
      // the first.
      sum += Scalar(1.0 / 72.0) * (mean_of_ad_product<Scalar>(P, mean_of_ad_product<Scalar>(P, Q)) +
                                   mean_of_ad_product<Scalar>(Q, mean_of_ad_product<Scalar>(Q, P)));
    } else {
      sum += Scalar(2) * J_a * errors.C * J_b.transpose() - Scalar(0.25) * mean_of_ad_product<Scalar>(C, Ct);
    }
    sum += congruence<Scalar, 6, 6>(J_a, errors.P) + congruence<Scalar, 6, 6>(J_b, errors.Q);
    covariance = Scalar(0.5) * (sum + sum.transpose());
  }
};

}  // namespace antipode::detail
