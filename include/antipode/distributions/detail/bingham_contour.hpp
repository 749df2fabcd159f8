// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

#include <Eigen/Core>

#include <antipode/eigen_types.hpp>

/// The inverse Laplace transform behind the Bingham normaliser, by a quadrature with fixed nodes.
///
///   N(z) = 2 pi^(d/2) / (2 pi i)  int_Gamma  e^s  prod_i (s - z_i)^(-1/2)  ds
///
/// With max z = 0 all branch points lie on (-inf, 0]. The parabola s(u) = mu (1 + i u)^2 wraps them, and the
/// midpoint rule on it converges geometrically (Weideman and Trefethen, "Parabolic and hyperbolic contours
/// for computing the Bromwich integral", 2007). All singularities sit at Im u = 1 whatever z is, so that one
/// set of 20 nodes gives N and its first two derivatives to 1e-13 (2e-14 for Dim <= 4), each RELATIVE to
/// itself, from the uniform density to z = -1e15.
namespace antipode::detail {

/// Types of the nodes depend on Dim, so that expressions of them are compiled only where they are used.
template <int Dim>
inline constexpr int kContourNodes = 20;
template <int Dim>
using ContourArray = Eigen::Array<double, kContourNodes<Dim>, 1>;

/// Nodes s_k and weights w_k = (2 mu h / pi) (1 + i u_k) e^(s_k), the conjugate half folded in.
template <int Dim>
struct BinghamContour {
  ContourArray<Dim> s_real, s_imag, w_real, w_imag;

  [[nodiscard]] static const BinghamContour& instance() {
    static const BinghamContour contour;
    return contour;
  }

 private:
  BinghamContour() {
    // A contour farther to the right with finer steps resolves smaller values of N (N falls with the
    // dimension), but loses more digits by cancellation when large |z_i| leave few dimensions. These
    // constants minimise the larger of the two errors.
    constexpr long double kMu = Dim <= 4 ? 4.5L : 6.0L;
    constexpr long double kStep = Dim <= 4 ? 0.14L : 0.12L;
    for (int k = 0; k < kContourNodes<Dim>; ++k) {
      const std::complex<long double> direction(1.0L, (static_cast<long double>(k) + 0.5L) * kStep);
      const std::complex<long double> s = kMu * direction * direction;
      const std::complex<long double> w =
          2.0L * kMu * kStep / std::numbers::pi_v<long double> * direction * std::exp(s);
      s_real[k] = static_cast<double>(s.real());
      s_imag[k] = static_cast<double>(s.imag());
      w_real[k] = static_cast<double>(w.real());
      w_imag[k] = static_cast<double>(w.imag());
    }
  }
};

/// The integrand on all nodes at once, for max z = 0. Real arithmetic in loops, so that it vectorises.
template <int Dim>
class BinghamContourSum {
 public:
  explicit BinghamContourSum(const Vector<double, Dim>& z) : y_(BinghamContour<Dim>::instance().s_imag) {
    const BinghamContour<Dim>& contour = BinghamContour<Dim>::instance();
    for (int i = 0; i < Dim; ++i) x_[i] = contour.s_real - z[i];
    multiply_roots(contour);
    sum_ = v_real_.sum();
  }

  /// log N(z).
  [[nodiscard]] double log_normalizer() const {
    using std::log;
    return log(2.0 * sum_) + 0.5 * Dim * log(std::numbers::pi);
  }

  /// omega_i = E[x_i^2] = (1/2S) sum Re(v r_i), with the resolvent r_i = 1/(s - z_i).
  [[nodiscard]] Vector<double, Dim> second_moments() const {
    Vector<double, Dim> omega;
    for (int i = 0; i < Dim; ++i) {
      omega[i] = ((v_real_ * x_[i] + v_imag_ * y_) * inverse_norm_[i]).sum() / (2.0 * sum_);
    }
    return omega;
  }

  /// E[x_i^2 x_j^2] = (1/4S) sum Re(v r_i r_j) for i != j; on the diagonal, three times this formula.
  [[nodiscard]] Matrix<double, Dim> fourth_moments() const {
    Matrix<double, Dim> moments;
    for (int i = 0; i < Dim; ++i) {
      const ContourArray<Dim> v_r_real = (v_real_ * x_[i] + v_imag_ * y_) * inverse_norm_[i];
      const ContourArray<Dim> v_r_imag = (v_imag_ * x_[i] - v_real_ * y_) * inverse_norm_[i];
      for (int j = i; j < Dim; ++j) {
        const double sum = ((v_r_real * x_[j] + v_r_imag * y_) * inverse_norm_[j]).sum();
        moments(i, j) = moments(j, i) = (i == j ? 0.75 : 0.25) * sum / sum_;
      }
    }
    return moments;
  }

 private:
  /// v = w prod_i (s - z_i)^(-1/2). The argument of every factor lies in (0, pi), and so does that of the
  /// root of a PAIR of factors, which halves the angle between them:
  ///   sqrt(a b) = (|b| a + |a| b) / sqrt(2 (|a||b| + Re a conj(b))).
  /// The root of the whole product could be on the wrong branch. In odd dimensions the last factor pairs with
  /// b = 1.
  void multiply_roots(const BinghamContour<Dim>& contour) {
    using std::sqrt;
    ContourArray<Dim> modulus[static_cast<std::size_t>(Dim)];
    for (int i = 0; i < Dim; ++i) {
      for (int k = 0; k < kContourNodes<Dim>; ++k) {
        const double norm = x_[i][k] * x_[i][k] + y_[k] * y_[k];
        inverse_norm_[i][k] = 1.0 / norm;
        modulus[i][k] = sqrt(norm);
      }
    }
    for (int k = 0; k < kContourNodes<Dim>; ++k) {
      double real = contour.w_real[k], imag = contour.w_imag[k], moduli = 1.0, denominator = 1.0;
      const auto divide_by_root = [&](double root_real, double root_imag) {
        const double quotient_real = real * root_real + imag * root_imag;
        imag = imag * root_real - real * root_imag;
        real = quotient_real;
      };
      for (int i = 0; i + 1 < Dim; i += 2) {
        const double x_a = x_[i][k], x_b = x_[i + 1][k], m_a = modulus[i][k], m_b = modulus[i + 1][k];
        divide_by_root(m_b * x_a + m_a * x_b, y_[k] * (m_a + m_b));
        moduli *= m_a * m_b;
        denominator *= 2.0 * (m_a * m_b + x_a * x_b + y_[k] * y_[k]);
      }
      if constexpr (Dim % 2 == 1) {
        const double x_a = x_[Dim - 1][k], m_a = modulus[Dim - 1][k];
        divide_by_root(x_a + m_a, y_[k]);
        moduli *= m_a;
        denominator *= 2.0 * (m_a + x_a);
      }
      const double scale = 1.0 / (moduli * sqrt(denominator));
      v_real_[k] = real * scale;
      v_imag_[k] = imag * scale;
    }
  }

  const ContourArray<Dim>& y_;                                     // Im(s - z_i), the same for all i
  ContourArray<Dim> x_[static_cast<std::size_t>(Dim)];             // Re(s - z_i)
  ContourArray<Dim> inverse_norm_[static_cast<std::size_t>(Dim)];  // 1/|s - z_i|^2
  ContourArray<Dim> v_real_, v_imag_;
  double sum_;
};

}  // namespace antipode::detail
