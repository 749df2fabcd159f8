// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/selected_inverse.hpp"

#include <random>
#include <vector>

#include <Eigen/LU>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// A chain with a few long connections: positive definite, since its diagonal dominates.
SparseMatrix chain(int size, int connections, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  std::uniform_int_distribution<int> place(0, size - 1);
  std::vector<Eigen::Triplet<double>> entries;
  const auto connect = [&](int i, int j) {
    const double v = value(random);
    entries.insert(entries.end(), {{i, j, v}, {j, i, v}, {i, i, 1.1}, {j, j, 1.1}});
  };
  entries.emplace_back(0, 0, 0.5);
  for (int i = 1; i < size; ++i) connect(i - 1, i);
  for (int k = 0; k < connections; ++k) {
    const int i = place(random), j = place(random);
    if (i != j) connect(i, j);
  }
  SparseMatrix result(size, size);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

TEST_CASE("The selected inverse has the entries of the inverse wherever the matrix has its own",
          "[stereo_slam][pose_graph]") {
  for (const unsigned seed : {1U, 2U, 3U}) {
    for (const int size : {1, 2, 7, 60}) {
      for (const int connections : {0, 3, 200}) {  // the last is nearly dense
        CAPTURE(seed, size, connections);
        const SparseMatrix A = chain(size, size > 1 ? connections : 0, seed);
        const Eigen::MatrixXd expected = Eigen::MatrixXd(A).inverse();
        const SparseFactor factor(A);
        REQUIRE(factor.info() == Eigen::Success);
        const SelectedInverse inverse(factor);
        for (int j = 0; j < size; ++j) {
          for (SparseMatrix::InnerIterator entry(A, j); entry; ++entry) {
            const auto found = inverse(static_cast<int>(entry.row()), j);
            REQUIRE(found);
            CHECK(*found == Approx(expected(entry.row(), j)).epsilon(1e-10).margin(1e-12));
          }
        }
      }
    }
  }
}

TEST_CASE("The selected inverse says which entries it does not have", "[stereo_slam][pose_graph]") {
  const SparseMatrix A = chain(50, 0, 1);
  const SelectedInverse inverse{SparseFactor(A)};
  CHECK_FALSE(inverse(0, 49));
  CHECK(inverse(20, 21));
}

}  // namespace
}  // namespace stereo_slam
