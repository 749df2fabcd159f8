// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/LU>

#include <antipode/eigen_types.hpp>

#include "support/random.hpp"

namespace antipode::test {

/// Measurements z_i = J_i x + K_i c of two numbers each, of noise with the covariance S_i.
template <int N, int Considered>
struct LinearProblem {
  struct Row {
    Vector2<double> z;
    Matrix2<double> S_inverse;
    Matrix<double, 2, N> J;
    Matrix<double, 2, Considered> K;
  };
  std::vector<Row> rows;

  LinearProblem(Rng& rng, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      Row row;
      row.z = random_matrix<double, 2, 1>(rng);
      row.S_inverse = random_covariance<double, 2>(rng).inverse();
      row.J = random_matrix<double, 2, N>(rng);
      row.K = random_matrix<double, 2, Considered>(rng);
      rows.push_back(row);
    }
  }
  template <class Sums>
  void operator()(const Vector<double, N>& x, Sums& sums) const {
    for (const auto& [z, S_inverse, J, K] : rows) sums.add(Vector2<double>(z - J * x), S_inverse, J, K);
  }
};

}  // namespace antipode::test
