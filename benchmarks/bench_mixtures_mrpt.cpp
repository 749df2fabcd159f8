// SPDX-License-Identifier: MIT
// What MRPT's CPose3DPDFSOG, a sum of Gaussians in (x, y, z, yaw, pitch, roll), shares with a Mixture: ten
// components beside ten. Its fusion is declared but throws, and it has neither a reduction in 3-D nor a
// density.
#include <mrpt/poses/CPose3DPDFSOG.h>

#include <antipode/distributions/mixture.hpp>
#include <antipode/sampling/mixture_moments.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"

namespace antipode::test {

TEST_CASE("Beside MRPT", "[benchmark][mixtures]") {
  using mrpt::poses::CPose3D;
  using mrpt::poses::CPose3DPDFSOG;
  constexpr int kComponents = 10;
  Rng rng(8);
  const PoseMixture mixture = random_mixture(rng, kComponents, random_pose<double>(rng));
  const auto motion = random_pose<double>(rng);
  BENCHMARK("change of the parent frame, 10 components: antipode") {
    return compose(motion, mixture).size();
  };
  BENCHMARK("mean and covariance, 10 components: antipode") {
    return moment_match(mixture).covariance()(0, 0);
  };
  BENCHMARK("draw of 10 components: antipode") { return mixture.sample(rng); };

  CPose3DPDFSOG sum(kComponents);
  for (auto& mode : sum) {
    mode.log_w = 0.0;
    mode.val.mean =
        CPose3D(uniform<double>(rng, -0.1, 0.1), 0.2, 0.3, uniform<double>(rng, -0.1, 0.1), 0.1, 0.2);
    mode.val.cov = mrpt::math::CMatrixDouble66(random_covariance<double, 6>(rng, 0.1).eval());
  }
  const CPose3D step(1.0, 2.0, 3.0, 0.3, 0.2, 0.1);
  BENCHMARK("change of the parent frame, 10 components: MRPT") {
    CPose3DPDFSOG moved = sum;
    moved.changeCoordinatesReference(step);
    return moved.size();
  };
  BENCHMARK("mean and covariance, 10 components: MRPT") {
    return std::get<0>(sum.getCovarianceAndMean())(0, 0);
  };
  BENCHMARK("draw of 10 components: MRPT") {
    CPose3D pose;
    sum.drawSingleSample(pose);
    return pose.x();
  };
}

}  // namespace antipode::test
