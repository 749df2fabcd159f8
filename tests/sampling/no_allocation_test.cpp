// SPDX-License-Identifier: MIT
// Counts every allocation of the process, and makes Eigen assert on its own.
#define EIGEN_RUNTIME_NO_MALLOC

#include <cstdlib>
#include <new>

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/sampling/bingham_rules.hpp>
#include <antipode/sampling/point_sets.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"

namespace {
std::size_t allocations = 0;
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

using namespace antipode;
using namespace antipode::test;

namespace {

/// The allocations during f().
template <class Function>
std::size_t allocations_in(const Function& f) {
  const std::size_t before = allocations;
  Eigen::internal::set_is_malloc_allowed(false);
  f();
  Eigen::internal::set_is_malloc_allowed(true);
  return allocations - before;
}

}  // namespace

TEST_CASE("The counter counts", "[allocation]") {
  CHECK(allocations_in([] { delete new int(1); }) == 1);
}

TEMPLATE_TEST_CASE("Densities are built, evaluated and drawn from without the heap", "[allocation]", float,
                   double) {
  Rng rng(1);
  const auto x = random_bingham_gaussian<TestType>(rng, 0.0, 3.0);
  const auto y = random_pose<TestType>(rng);
  TestType sum(0);
  CHECK(allocations_in([&] {
          const auto& b = x.orientation();
          const auto product = b.product(compose(b, compose(y.rotation(), b)));
          sum += product.kl_divergence(b) + product.entropy() + product.sample(rng).sum();
          const auto moved = compose(compose(y, x), y);
          const auto narrow = BinghamGaussian<TestType>::from_pose_covariance(y, x.covariance());
          sum +=
              moved.log_density(y) + narrow.sample(rng).coeffs().sum() + moved.translation_covariance().sum();
          const Gaussian<TestType, 3> g(x.mean_translation(), x.conditional_covariance());
          sum += g.log_density(g.sample(rng));
        }) == 0);
  CHECK(std::isfinite(sum));
}

TEMPLATE_TEST_CASE("Samples are made and matched without the heap", "[allocation]", float, double) {
  Rng rng(2);
  const auto x = random_bingham_gaussian<TestType>(rng, 0.0, 3.0);
  const auto match = [&](const auto& rule) {
    return allocations_in([&] { (void)moment_match(sample(rule, x)); });
  };
  using Fibonacci = PointSetRule<3, 20>;
  CHECK(match(PaperPoseRule{}) == 0);
  CHECK(match(RichPoseRule{}) == 0);
  CHECK(match(JointPoseRule{}) == 0);
  CHECK(match(CartesianPoseRule<EqualWeightRule<Fibonacci>, Fibonacci>{{Fibonacci::fibonacci()},
                                                                       Fibonacci::fibonacci()}) == 0);
}
