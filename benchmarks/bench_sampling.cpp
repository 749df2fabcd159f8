// SPDX-License-Identifier: MIT
// Every sampling rule on 64 random densities in turn, and the match of a density to the samples; random draws
// of the same number beside them.
#include <cstddef>
#include <vector>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/cubature/point_sets.hpp>
#include <antipode/distributions/pose_algebra.hpp>
#include <antipode/sampling/bingham_rules.hpp>
#include <antipode/sampling/pose_rules.hpp>
#include <antipode/sampling/sample_gaussian.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"

namespace antipode::test {
namespace {

using Catch::Benchmark::Chronometer;
using Density = BinghamGaussian<double>;
using Fibonacci = PointSetRule<3, 40>;

constexpr std::size_t kDensities = 64;

struct Inputs {
  std::vector<Density> poses;
  std::vector<Gaussian<double, 3>> translations;

  Inputs() {
    Rng rng(1);
    for (std::size_t k = 0; k < kDensities; ++k) {
      poses.push_back(random_bingham_gaussian<double>(rng, 0.0, 6.0));
      translations.emplace_back(poses.back().mean_translation(), poses.back().conditional_covariance());
    }
  }
};

constexpr std::size_t at(int i) { return static_cast<std::size_t>(i) % kDensities; }

TEST_CASE("Gaussian rules", "[benchmark][sampling]") {
  const Inputs in;
  const auto run = [&](Chronometer meter, const auto& rule) {
    meter.measure([&](int i) { return sample(rule, in.translations[at(i)]).points.sum(); });
  };
  BENCHMARK_ADVANCED("unscented, 7 points")(Chronometer meter) { run(meter, UnscentedRule<3>{1.0}); };
  BENCHMARK_ADVANCED("cubature, 6 points")(Chronometer meter) { run(meter, CubatureRule<3>{}); };
  BENCHMARK_ADVANCED("degree 5, 15 points")(Chronometer meter) { run(meter, Degree5Rule<3>{}); };
  BENCHMARK_ADVANCED("Fibonacci, 40 points")(Chronometer meter) { run(meter, Fibonacci::fibonacci()); };
  BENCHMARK_ADVANCED("baseline: 15 random draws")(Chronometer meter) {
    Rng rng(2);
    meter.measure([&](int i) {
      double sum = 0.0;
      for (int k = 0; k < 15; ++k) sum += in.translations[at(i)].sample(rng).sum();
      return sum;
    });
  };
}

TEST_CASE("Bingham rules", "[benchmark][sampling]") {
  const Inputs in;
  const auto run = [&](Chronometer meter, const auto& rule) {
    meter.measure([&](int i) { return sample(rule, in.poses[at(i)].orientation()).points.sum(); });
  };
  BENCHMARK_ADVANCED("base, 7 points")(Chronometer meter) { run(meter, BinghamBaseRule{}); };
  BENCHMARK_ADVANCED("gnomonic degree 5, 15 points")(Chronometer meter) {
    run(meter, BinghamGnomonicRule{});
  };
  BENCHMARK_ADVANCED("gnomonic Fibonacci, 40 points")(Chronometer meter) {
    run(meter, GnomonicRule<Fibonacci>{Fibonacci::fibonacci()});
  };
  BENCHMARK_ADVANCED("equal weights, 40 points")(Chronometer meter) {
    run(meter, EqualWeightRule<Fibonacci>{Fibonacci::fibonacci()});
  };
  BENCHMARK_ADVANCED("baseline: 15 random draws")(Chronometer meter) {
    Rng rng(2);
    meter.measure([&](int i) {
      double sum = 0.0;
      for (int k = 0; k < 15; ++k) sum += in.poses[at(i)].orientation().sample(rng).sum();
      return sum;
    });
  };
}

TEST_CASE("Pose rules", "[benchmark][sampling]") {
  const Inputs in;
  const auto run = [&](Chronometer meter, const auto& rule) {
    meter.measure([&](int i) { return sample(rule, in.poses[at(i)]).points.sum(); });
  };
  BENCHMARK_ADVANCED("paper, 7 x 7 = 49 points")(Chronometer meter) { run(meter, PaperPoseRule{}); };
  BENCHMARK_ADVANCED("joint, 57 points")(Chronometer meter) { run(meter, JointPoseRule{}); };
  BENCHMARK_ADVANCED("rich, 15 x 15 = 225 points")(Chronometer meter) { run(meter, RichPoseRule{}); };
  BENCHMARK_ADVANCED("baseline: 57 random draws")(Chronometer meter) {
    Rng rng(2);
    meter.measure([&](int i) {
      double sum = 0.0;
      for (int k = 0; k < 57; ++k) sum += in.poses[at(i)].sample(rng).coeffs().sum();
      return sum;
    });
  };
}

TEST_CASE("Moment matching", "[benchmark][sampling]") {
  const Inputs in;
  const auto run = [&](Chronometer meter, const auto& rule, bool keep_coupling) {
    std::vector<decltype(sample(rule, in.poses[0]))> samples;
    for (const Density& pose : in.poses) samples.push_back(sample(rule, pose));
    meter.measure([&](int i) { return moment_match(samples[at(i)], {.keep_coupling = keep_coupling}); });
  };
  BENCHMARK_ADVANCED("49 samples, independent")(Chronometer meter) { run(meter, PaperPoseRule{}, false); };
  BENCHMARK_ADVANCED("49 samples")(Chronometer meter) { run(meter, PaperPoseRule{}, true); };
  BENCHMARK_ADVANCED("57 samples")(Chronometer meter) { run(meter, JointPoseRule{}, true); };
  BENCHMARK_ADVANCED("225 samples")(Chronometer meter) { run(meter, RichPoseRule{}, true); };
}

TEST_CASE("Covariances of poses", "[benchmark][sampling]") {
  Rng rng(3);
  std::vector<Density> poses;
  std::vector<Matrix6<double>> covariances;
  for (std::size_t k = 0; k < kDensities; ++k) {
    poses.push_back(random_bingham_gaussian<double>(rng, 2.0, 6.0));
    covariances.push_back(poses.back().covariance());
  }
  BENCHMARK_ADVANCED("covariance of a density")(Chronometer meter) {
    meter.measure([&](int i) { return poses[at(i)].covariance(); });
  };
  BENCHMARK_ADVANCED("density of a covariance")(Chronometer meter) {
    meter.measure(
        [&](int i) { return Density::from_pose_covariance(poses[at(i)].pose(), covariances[at(i)]); });
  };
  BENCHMARK_ADVANCED("change of the child frame")(Chronometer meter) {
    meter.measure([&](int i) { return compose(poses[at(i)], poses[at(i + 1)].pose()); });
  };
}

TEST_CASE("Products of uncertain poses", "[benchmark][sampling]") {
  Rng rng(4);
  std::vector<PoseGaussian<double>> poses;
  for (std::size_t k = 0; k < kDensities; ++k) {
    poses.push_back(to_pose_gaussian(random_bingham_gaussian<double>(rng, 2.0, 6.0)));
  }
  const Matrix6<double> independent = Matrix6<double>::Zero();
  const auto product = [](const DualQuaternion<double>& a, const DualQuaternion<double>& b) { return a * b; };
  BENCHMARK_ADVANCED("first order")(Chronometer meter) {
    meter.measure([&](int i) { return compose_first_order(poses[at(i)], poses[at(i + 1)]); });
  };
  BENCHMARK_ADVANCED("fourth order")(Chronometer meter) {
    meter.measure([&](int i) { return compose(poses[at(i)], poses[at(i + 1)]); });
  };
  BENCHMARK_ADVANCED("24 points on the axes")(Chronometer meter) {
    meter.measure([&](int i) {
      return propagate(CubatureRule<12>{}, poses[at(i)], poses[at(i + 1)], independent, product);
    });
  };
  BENCHMARK_ADVANCED("degree 5, 280 points")(Chronometer meter) {
    meter.measure([&](int i) {
      return propagate(Degree5Rule<12>{}, poses[at(i)], poses[at(i + 1)], independent, product);
    });
  };
}

}  // namespace
}  // namespace antipode::test
