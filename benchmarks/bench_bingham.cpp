// SPDX-License-Identifier: MIT
// The Bingham density beside the saddlepoint approximation that is usually taken for its normaliser, each on
// 256 random densities in turn, from nearly uniform to a concentration of 1e8.
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <Eigen/Eigenvalues>

#include <antipode/distributions/bingham.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"

namespace antipode::test {
namespace {

using Catch::Benchmark::Chronometer;
using Density = Bingham<double, 4>;

constexpr std::size_t kDensities = 256;

struct Inputs {
  std::vector<Density> densities;
  std::vector<Matrix4<double>> scatters;

  Inputs() {
    Rng rng(1);
    for (std::size_t k = 0; k < kDensities; ++k) {
      densities.push_back(random_bingham<double, 4>(rng, -2.0, 8.0));
      scatters.push_back(densities.back().scatter());
    }
  }
};

constexpr std::size_t at(int i) { return static_cast<std::size_t>(i) % kDensities; }

/// log N by the third-order saddlepoint approximation (Kume and Wood 2005): 3e-4 to 2e-2 off, where the
/// contour quadrature is 2e-14 off.
double saddlepoint_log_normalizer(const Vector4<double>& z) {
  double t = 0.5;  // minus the saddlepoint; sum_i 1/(2 (t - z_i)) = 1 by Newton's method
  for (int iteration = 0; iteration < 50; ++iteration) {
    const Vector4<double> r = (t - z.array()).inverse();
    const double step = (0.5 * r.sum() - 1.0) / (0.5 * r.squaredNorm());
    t += step;
    if (std::abs(step) < 1e-12 * t) break;
  }
  const Vector4<double> r = (t - z.array()).inverse();
  const double k2 = 0.5 * r.squaredNorm(), k3 = r.array().cube().sum(), k4 = 3.0 * r.array().pow(4).sum();
  const double correction = k4 / (8.0 * k2 * k2) - 5.0 * k3 * k3 / (24.0 * k2 * k2 * k2);
  return std::log(2.0 * std::numbers::pi * std::numbers::pi) + 0.5 * r.array().log().sum() + t -
         0.5 * std::log(2.0 * std::numbers::pi * k2) + correction;
}

TEST_CASE("Normaliser", "[benchmark][bingham]") {
  const Inputs in;
  const auto z = [&](int i) -> const Vector4<double>& { return in.densities[at(i)].concentrations(); };
  BENCHMARK_ADVANCED("log N: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return bingham_log_normalizer(z(i)); });
  };
  BENCHMARK_ADVANCED("log N: saddlepoint, third order")(Chronometer meter) {
    meter.measure([&](int i) { return saddlepoint_log_normalizer(z(i)); });
  };
  BENCHMARK_ADVANCED("log N and gradient: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return bingham_normalizer(z(i)); });
  };
  BENCHMARK_ADVANCED("log N and gradient: saddlepoint, differences")(Chronometer meter) {
    meter.measure([&](int i) {
      constexpr double kStep = 1e-6;
      Vector4<double> gradient;
      const double value = saddlepoint_log_normalizer(z(i));
      for (int j = 0; j < 4; ++j) {
        const Vector4<double> moved = z(i) - kStep * (1.0 - z(i)[j]) * Vector4<double>::Unit(j);
        gradient[j] = (value - saddlepoint_log_normalizer(moved)) / (kStep * (1.0 - z(i)[j]));
      }
      return gradient;
    });
  };
  BENCHMARK_ADVANCED("log N, gradient and Hessian: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return bingham_normalizer_hessian(z(i)); });
  };
}

TEST_CASE("Densities", "[benchmark][bingham]") {
  const Inputs in;
  BENCHMARK_ADVANCED("fit to a scatter matrix")(Chronometer meter) {
    meter.measure([&](int i) { return Density::fit(in.scatters[at(i)]); });
  };
  BENCHMARK_ADVANCED("product")(Chronometer meter) {
    meter.measure([&](int i) { return in.densities[at(i)].product(in.densities[at(i + 1)]); });
  };
  BENCHMARK_ADVANCED("composition")(Chronometer meter) {
    meter.measure([&](int i) { return compose(in.densities[at(i)], in.densities[at(i + 1)]); });
  };
  BENCHMARK_ADVANCED("log density")(Chronometer meter) {
    meter.measure([&](int i) { return in.densities[at(i)].log_density(in.densities[at(i + 1)].mode()); });
  };
  BENCHMARK_ADVANCED("random draw")(Chronometer meter) {
    Rng rng(2);
    meter.measure([&](int i) { return in.densities[at(i)].sample(rng); });
  };
}

TEST_CASE("Eigenvectors of a scatter matrix", "[benchmark][bingham]") {
  const Inputs in;
  BENCHMARK_ADVANCED("Jacobi: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return detail::symmetric_eigen(in.scatters[at(i)]).values; });
  };
  BENCHMARK_ADVANCED("Eigen::SelfAdjointEigenSolver")(Chronometer meter) {
    meter.measure([&](int i) -> Vector4<double> {
      return Eigen::SelfAdjointEigenSolver<Matrix4<double>>(in.scatters[at(i)]).eigenvalues();
    });
  };
}

}  // namespace
}  // namespace antipode::test
