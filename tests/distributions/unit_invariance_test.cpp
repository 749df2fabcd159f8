// SPDX-License-Identifier: MIT
#include <cmath>
#include <utility>
#include <vector>

#include <antipode/distributions/mixture_reduction.hpp>
#include <antipode/distributions/pose_algebra.hpp>
#include <antipode/distributions/pose_charts.hpp>
#include <antipode/distributions/pose_fusion.hpp>
#include <antipode/distributions/pose_gaussian_queries.hpp>
#include <antipode/distributions/projected_gaussian_conversions.hpp>
#include <antipode/filters/predict.hpp>
#include <antipode/geometry/interpolation.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

/// No result may depend on the unit of length. A comparison of a norm or a trace over radians and metres
/// depends on it: in millimetres, the angles would count for nothing.
namespace {

using Pose = DualQuaternion<double>;
using Screw = PoseGaussian<double>;
using Split = SplitPoseGaussian<double>;

constexpr double kUnits[] = {1e-6, 1e-3, 1e3, 1e6};  // lengths of one metre

[[nodiscard]] Pose in_unit(const Pose& x, double unit) {
  return Pose::from_rotation_translation(x.rotation(), Vector3<double>(unit * x.translation()));
}

[[nodiscard]] Matrix6<double> in_unit(Matrix6<double> P, double unit) {
  P.bottomRows<3>() *= unit;
  P.rightCols<3>() *= unit;
  return P;
}

template <class Chart>
[[nodiscard]] PoseGaussian<double, Chart> in_unit(const PoseGaussian<double, Chart>& x, double unit) {
  return {in_unit(x.pose, unit), in_unit(x.covariance, unit)};
}

[[nodiscard]] PoseComponent in_unit(const PoseComponent& x, double unit) {
  Vector6<double> mean = x.mean();
  mean.tail<3>() *= unit;
  return {x.tangent_point(), mean, in_unit(x.covariance(), unit)};
}

/// The largest difference of two densities in standard deviations of every coordinate and of a correlation.
template <class Chart>
[[nodiscard]] double difference(const PoseGaussian<double, Chart>& a, const PoseGaussian<double, Chart>& b) {
  const Vector6<double> sigma = b.covariance.diagonal().cwiseSqrt();
  const Vector6<double> shift = Chart::local(b.pose, a.pose);
  double largest = 0.0;
  for (int i = 0; i < 6; ++i) {
    const double step = std::abs(shift[i]) / sigma[i];
    if (!(step <= largest)) largest = step;
    for (int j = 0; j < 6; ++j) {
      const double change = std::abs(a.covariance(i, j) - b.covariance(i, j)) / (sigma[i] * sigma[j]);
      if (!(change <= largest)) largest = change;
    }
  }
  return largest;
}

/// Angles of tenths of a radian with positions from a millimetre to hundreds of metres.
struct World {
  double angle_rad, position_m;
};
constexpr World kWorlds[] = {{0.3, 300.0}, {0.3, 1e-3}, {0.01, 10.0}};

template <class Density>
[[nodiscard]] Density random_estimate(Rng& rng, const World& world) {
  return {random_pose<double>(rng, 10.0),
          random_tangent_covariance<double>(rng, world.angle_rad, world.position_m)};
}

/// Rounding: 1e6 times the unit roundoff, for means that come from differences of long vectors.
constexpr double kTolerance = 1e-9;

/// Checks that result(x in a unit) is result(x) in the unit.
template <class Result>
void check_units(const Result& result) {
  for (const World& world : kWorlds) {
    for (unsigned seed = 0; seed < 5; ++seed) {
      const auto in_metres = [&] {
        Rng rng(seed);
        return result(rng, world, 1.0);
      }();
      for (const double unit : kUnits) {
        CAPTURE(world.angle_rad, world.position_m, seed, unit);
        Rng rng(seed);
        CHECK(difference(result(rng, world, unit), in_unit(in_metres, unit)) <= kTolerance);
      }
    }
  }
}

}  // namespace

TEST_CASE("The unit of length does not matter to sigma points", "[units][law]") {
  check_units([](Rng& rng, const World& world, double unit) {
    const auto x = random_estimate<Screw>(rng, world), y = random_estimate<Screw>(rng, world);
    return propagate(CubatureRule<12>{}, in_unit(x, unit), in_unit(y, unit),
                     Matrix6<double>(Matrix6<double>::Zero()),
                     [](const Pose& a, const Pose& b) { return a * b; });
  });
  check_units([](Rng& rng, const World& world, double unit) {
    const auto x = random_estimate<Split>(rng, world);
    const Pose motion = in_unit(random_pose<double>(rng), unit);
    const Matrix6<double> noise =
        in_unit(1e-4 * random_tangent_covariance<double>(rng, world.angle_rad, world.position_m), unit);
    return predict(
        in_unit(x, unit), [&](const Pose& a) { return a * motion; }, noise);
  });
}

TEST_CASE("The unit of length does not matter to products, inverses and differences", "[units][law]") {
  check_units([](Rng& rng, const World& world, double unit) {
    const auto x = in_unit(random_estimate<Screw>(rng, world), unit);
    const auto y = in_unit(random_estimate<Screw>(rng, world), unit);
    return relative_pose(inverse(x), compose(x, y));
  });
}

TEST_CASE("The unit of length does not matter to the chart", "[units][law]") {
  check_units([](Rng& rng, const World& world, double unit) {
    return in_chart<SplitChart<double>>(in_unit(random_estimate<Screw>(rng, world), unit));
  });
  check_units([](Rng& rng, const World& world, double unit) {
    return in_chart<ScrewChart<double>>(in_unit(random_estimate<Split>(rng, world), unit));
  });
}

TEST_CASE("The unit of length does not matter to the fusion of two estimates", "[units][law]") {
  const auto fused = [](Rng& rng, const World& world, double unit) {
    const auto a = random_estimate<Screw>(rng, world), error = random_estimate<Screw>(rng, world);
    const Screw b{a.pose * sample(Screw{Pose(), 0.1 * error.covariance}, rng), error.covariance};
    return fuse(in_unit(a, unit), in_unit(b, unit), {.tolerance = 1e-12});
  };
  check_units([&](Rng& rng, const World& world, double unit) {
    const auto result = fused(rng, world, unit);
    CHECK(result.converged);
    return result.density;
  });
}

TEST_CASE("The unit of length does not matter to a fusion with a certain coordinate", "[units][law]") {
  for (const double unit : kUnits) {
    CAPTURE(unit);
    Vector6<double> planar, wide;
    planar << 0, 0, 0.04, 100, 100, 0;
    wide << 0.09, 0.09, 0.09, 400, 400, 400;
    Vector6<double> apart;
    apart << 0.1, -0.2, 0.1, 3, 4, 5;
    const Screw a{Pose(), planar.asDiagonal()}, b{Pose::exp(apart), wide.asDiagonal()};
    const auto in_metres = fuse(a, b), scaled = fuse(in_unit(a, unit), in_unit(b, unit));
    CHECK(scaled.iterations == in_metres.iterations);
    REQUIRE(scaled.converged);
    CHECK(scaled.mahalanobis_squared == Approx(in_metres.mahalanobis_squared).epsilon(1e-9));
    CHECK(max_difference(in_unit(scaled.density.covariance, 1 / unit), in_metres.density.covariance) <=
          kTolerance * 100);
    CHECK(scaled.density.covariance(0, 0) == 0.0);
    CHECK(scaled.density.covariance(5, 5) == 0.0);
  }
}

TEST_CASE("The unit of length does not matter to fits of samples", "[units][law]") {
  Rng rng(3);
  constexpr int kSamples = 100;
  // On a line in space: the covariance is singular.
  for (const bool on_a_line : {false, true}) {
    Matrix<double, 8, kSamples> metres, scaled;
    Vector<double, kSamples> weights;
    const Pose mean = random_pose<double>(rng, 10.0);
    const Vector6<double> direction = random_twist<double>(rng, 0.2, 50.0);
    std::normal_distribution<double> normal;
    std::vector<Pose> poses;
    for (int k = 0; k < kSamples; ++k) {
      Vector6<double> xi = normal(rng) * direction;
      if (!on_a_line) xi += random_twist<double>(rng, 0.1, 20.0);
      poses.push_back(SplitChart<double>::retract(mean, xi));
      weights[k] = uniform<double>(rng, 0.5, 1.5);
    }
    for (const double unit : kUnits) {
      CAPTURE(on_a_line, unit);
      for (int k = 0; k < kSamples; ++k) {
        metres.col(k) = poses[static_cast<std::size_t>(k)].coeffs();
        scaled.col(k) = in_unit(poses[static_cast<std::size_t>(k)], unit).coeffs();
      }
      const auto a = fit_projected_gaussian(metres, weights), b = fit_projected_gaussian(scaled, weights);
      const Matrix6<double> back = in_unit(b.covariance(), 1 / unit);
      const Vector6<double> sigma = a.covariance().diagonal().cwiseSqrt();
      const Matrix6<double> change = back - a.covariance();
      CHECK(max_difference(sigma.cwiseInverse().asDiagonal() * change * sigma.cwiseInverse().asDiagonal(),
                           Matrix6<double>(Matrix6<double>::Zero())) <= 1e-7);
      CHECK(in_unit(b.pose(), 1 / unit).is_approx(a.pose(), 1e-9));
      if (on_a_line) continue;
      const auto match_a = moment_match(metres, weights), match_b = moment_match(scaled, weights);
      CHECK(difference(Screw{match_b.pose(), match_b.covariance()},
                       in_unit(Screw{match_a.pose(), match_a.covariance()}, unit)) <= kTolerance);
    }
  }
}

TEST_CASE("The unit of length does not matter to the mean of poses", "[units][law]") {
  Rng rng(5);
  constexpr int kPoses = 9;
  const Pose center = random_pose<double>(rng, 1e3);
  Matrix<double, 8, kPoses> metres, scaled;
  for (int k = 0; k < kPoses; ++k) metres.col(k) = nearby_pose(rng, center, 0.8, 100.0).coeffs();
  const Vector<double, kPoses> weights = Vector<double, kPoses>::Ones();
  const auto expected = mean(metres, weights);
  REQUIRE(expected.converged);
  for (const double unit : kUnits) {
    CAPTURE(unit);
    for (int k = 0; k < kPoses; ++k) {
      scaled.col(k) = in_unit(Pose::from_coefficients(metres.col(k)), unit).coeffs();
    }
    const auto result = mean(scaled, weights);
    REQUIRE(result.converged);
    const Vector6<double> difference = in_unit(result.pose, 1 / unit).boxminus(expected.pose);
    CHECK(difference.head<3>().norm() <= 1e-13);  // rad
    CHECK(difference.tail<3>().norm() <= 1e-10);  // m, of 1e3 m
  }
}

TEST_CASE("The unit of length does not matter to the reduction of a mixture", "[units][law]") {
  for (const auto criterion : {MergeCriterion::kRunnalls, MergeCriterion::kSymmetricKullbackLeibler}) {
    Rng rng(4);
    const auto mixture = random_mixture(rng, 12, random_pose<double>(rng), {.sigma_t = 10.0});
    const auto reduced = reduce(mixture, {.max_components = 4, .criterion = criterion});
    for (const double unit : kUnits) {
      CAPTURE(unit);
      std::vector<PoseMixture::Element> elements;
      for (const auto& [weight, density] : mixture) elements.push_back({weight, in_unit(density, unit)});
      const auto scaled =
          reduce(PoseMixture::normalized(std::move(elements)), {.max_components = 4, .criterion = criterion});
      REQUIRE(scaled.mixture.size() == reduced.mixture.size());
      CHECK(scaled.divergence == Approx(reduced.divergence).epsilon(1e-9));
      for (std::size_t i = 0; i < reduced.mixture.size(); ++i) {
        const auto expected = in_unit(reduced.mixture[i].density, unit);
        const auto& got = scaled.mixture[i].density;
        CHECK(scaled.mixture[i].weight == Approx(reduced.mixture[i].weight).epsilon(1e-9));
        CHECK(difference(Screw{got.pose(), got.covariance()},
                         Screw{expected.pose(), expected.covariance()}) <= kTolerance);
      }
    }
  }
}

TEST_CASE("Predicting by the identity fifty times changes nothing", "[units][predict]") {
  // A position known to 300 m does not excuse a mean that is off by .4 rad.
  Vector6<double> sigma;
  sigma << 0.1, 0.1, 0.5, 300, 300, 300;
  const Split start{Pose(), sigma.cwiseAbs2().asDiagonal()};
  Split x = start;
  for (int k = 0; k < 50; ++k) {
    x = predict(
        x, [](const Pose& pose) { return pose; }, Matrix6<double>(Matrix6<double>::Zero()));
  }
  CHECK(difference(x, start) <= kTolerance);
}
