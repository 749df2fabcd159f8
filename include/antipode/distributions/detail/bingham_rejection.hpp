// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <random>

#include <antipode/detail/standard_normal.hpp>
#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// Exact sampling of exp(-sum_i a_i x_i^2), a_i >= 0 with min a = 0, on the unit sphere by rejection from an
/// angular central Gaussian envelope (Kent, Ganeiban and Mardia, "A new unified approach for the simulation
/// of a wide class of directional distributions", 2018).
template <class Scalar, int Dim>
class BinghamRejection {
 public:
  explicit BinghamRejection(const Vector<Scalar, Dim>& a) : a_(a), b_(envelope_parameter(a)) {
    omega_ = Scalar(1) + Scalar(2) / b_ * a.array();
  }

  /// A draw, in the eigenbasis.
  template <std::uniform_random_bit_generator Rng>
  [[nodiscard]] Vector<Scalar, Dim> operator()(Rng& rng) const {
    std::uniform_real_distribution<Scalar> uniform;
    for (;;) {
      Vector<Scalar, Dim> x =
          standard_normal<Scalar, Dim>(rng).cwiseQuotient(omega_.cwiseSqrt()).normalized();
      if (uniform(rng) < acceptance(x)) return x;
    }
  }

  /// The probability of accepting the draw x of the envelope.
  [[nodiscard]] Scalar acceptance(const Vector<Scalar, Dim>& x) const {
    using std::exp;
    using std::log;
    const Vector<Scalar, Dim> squares = x.cwiseAbs2();
    constexpr Scalar kHalfDim = Scalar(0.5) * Dim;
    return exp(-a_.dot(squares) + Scalar(0.5) * (Dim - b_) + kHalfDim * log(omega_.dot(squares) * b_ / Dim));
  }

 private:
  /// The tightest envelope: sum_i 1/(b + 2 a_i) = 1 with 1 <= b <= Dim. The sum is convex and decreasing in
  /// b, so that Newton's method from b = 1 climbs to the root monotonically.
  [[nodiscard]] static Scalar envelope_parameter(const Vector<Scalar, Dim>& a) {
    Scalar b(1);
    for (;;) {
      const Vector<Scalar, Dim> terms = (b + Scalar(2) * a.array()).inverse();
      const Scalar next = b + (terms.sum() - Scalar(1)) / terms.squaredNorm();
      if (!(next > b)) return b;
      b = next;
    }
  }

  Vector<Scalar, Dim> a_;
  Scalar b_;
  Vector<Scalar, Dim> omega_;  // precision of the envelope, I + 2 A/b
};

}  // namespace antipode::detail
