// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include <antipode/distributions/pose_algebra.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Density = PoseGaussian<double>;

/// Two correlated poses.
struct Pair {
  Density x, y;
  Matrix6<double> cross;
  Matrix<double, 12> joint;

  /// Standard deviations of up to about sigma rad and sigma m.
  static Pair random(Rng& rng, double sigma) {
    const Matrix<double, 12> joint = sigma * sigma * random_covariance<double, 12>(rng, 0.1);
    return {{random_pose<double>(rng), joint.topLeftCorner<6, 6>()},
            {random_pose<double>(rng), joint.bottomRightCorner<6, 6>()},
            joint.topRightCorner<6, 6>(),
            joint};
  }

  [[nodiscard]] std::pair<Pose, Pose> draw(Rng& rng) const {
    std::normal_distribution<double> normal;
    Vector<double, 12> g;
    for (double& entry : g) entry = normal(rng);
    const Vector<double, 12> ab = detail::cholesky_factor(joint).value() * g;
    return {x.pose.boxplus(ab.head<6>()), y.pose.boxplus(ab.tail<6>())};
  }
};

/// How far the densities are apart, relative to the covariance and in standard deviations.
[[nodiscard]] double distance(const Density& a, const Density& b) {
  const double covariance = (a.covariance - b.covariance).norm() / b.covariance.norm();
  return covariance + a.pose.boxminus(b.pose).norm() / std::sqrt(b.covariance.trace());
}

}  // namespace

TEST_CASE("Products, inverses and differences have the moments of their samples", "[algebra]") {
  constexpr int kSamples = 20000;
  constexpr double kTolerance = 0.05;  // Monte-Carlo noise of 6 x 6 entries
  Rng rng(1);
  for (int trial = 0; trial < 3; ++trial) {
    CAPTURE(trial);
    const Pair pair = Pair::random(rng, 0.02);
    const Density product = compose(pair.x, pair.y, pair.cross);
    const Density inverted = inverse(pair.x);
    const Density between = relative_pose(pair.x, pair.y, pair.cross);
    Density sampled_product{product.pose, Matrix6<double>::Zero()};
    Density sampled_inverse{inverted.pose, Matrix6<double>::Zero()};
    Density sampled_between{between.pose, Matrix6<double>::Zero()};
    const auto add = [&](const Pose& pose, Density& density) {
      const Vector6<double> xi = pose.boxminus(density.pose);
      density.covariance += xi * xi.transpose() / kSamples;
    };
    for (int k = 0; k < kSamples; ++k) {
      const auto [x, y] = pair.draw(rng);
      add(x * y, sampled_product);
      add(x.inverse(), sampled_inverse);
      add(x.inverse() * y, sampled_between);
    }
    CHECK(distance(product, sampled_product) <= kTolerance);
    CHECK(distance(inverted, sampled_inverse) <= kTolerance);
    CHECK(distance(between, sampled_between) <= kTolerance);
  }
}

TEST_CASE("A pose relative to itself is certain", "[algebra][law]") {
  Rng rng(2);
  const Density x{random_pose<double>(rng), random_covariance<double, 6>(rng)};
  const Density z = relative_pose(x, x, x.covariance);
  CHECK(z.pose.log().norm() <= 1e-14);
  CHECK(z.covariance.norm() <= 1e-13 * x.covariance.norm());
}

TEST_CASE("Inverting twice and composing in any grouping changes nothing", "[algebra][law]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto random = [&] { return Density{random_pose<double>(rng), random_covariance<double, 6>(rng)}; };
    const Density x = random(), y = random(), z = random();
    CHECK(distance(inverse(inverse(x)), x) <= 1e-12);
    CHECK(distance(compose(compose(x, y), z), compose(x, compose(y, z))) <= 1e-12);
    CHECK(distance(inverse(compose(x, y)), compose(inverse(y), inverse(x))) <= 1e-12);
    CHECK(distance(relative_pose(x, y), compose(inverse(x), y)) <= 1e-12);
  }
}

TEST_CASE("Sigma points agree with the closed forms for concentrated poses", "[algebra]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Pair pair = Pair::random(rng, 1e-4);
    const CubatureRule<12> rule;
    const auto product = [](const Pose& x, const Pose& y) { return x * y; };
    const auto between = [](const Pose& x, const Pose& y) { return x.inverse() * y; };
    CHECK(distance(propagate(rule, pair.x, pair.y, pair.cross, product),
                   compose(pair.x, pair.y, pair.cross)) <= 1e-2);
    CHECK(distance(propagate(rule, pair.x, pair.y, pair.cross, between),
                   relative_pose(pair.x, pair.y, pair.cross)) <= 1e-2);
    CHECK(distance(propagate(CubatureRule<6>{}, pair.x, [](const Pose& x) { return x.inverse(); }),
                   inverse(pair.x)) <= 1e-2);
  }
}

TEST_CASE("Sigma points are more accurate than the closed form for wide, correlated poses", "[algebra]") {
  // The product of two correlated errors does not have the mean zero.
  constexpr std::size_t kSamples = 10000;
  Rng rng(3);
  const Matrix6<double> P = 0.09 * random_covariance<double, 6>(rng, 0.1);
  const Density x{random_pose<double>(rng), P};
  const Density y{random_pose<double>(rng), P};
  Matrix6<double> shuffle = Matrix6<double>::Zero();  // b is a, with its axes exchanged
  for (int i = 0; i < 6; ++i) shuffle(i, i < 3 ? (i + 1) % 3 : 3 + (i + 1) % 3) = 1.0;
  const Density y_of_x{y.pose, shuffle * P * shuffle.transpose()};
  const Matrix6<double> cross = P * shuffle.transpose();

  const auto product = [](const Pose& a, const Pose& b) { return a * b; };
  const Density sampled = propagate(CubatureRule<12>{}, x, y_of_x, cross, product);
  const Density closed = compose(x, y_of_x, cross);
  std::array<Pose, kSamples> poses;
  for (Pose& pose : poses) {
    const Pose a = draw(rng, x);
    pose = a * y.pose.boxplus(shuffle * a.boxminus(x.pose));
  }
  const Density truth = detail::chart_moments<Density>(
      poses[0], poses, Vector<double, int{kSamples}>::Constant(1.0 / double{kSamples}).eval());
  const double noise = std::sqrt(truth.covariance.trace() / kSamples);
  const auto error = [&](const Density& density) { return density.pose.boxminus(truth.pose).norm(); };
  CHECK(error(closed) > 3.0 * noise);
  CHECK(error(sampled) < 0.3 * error(closed));
}

TEST_CASE("Variances of zero are accepted, negative ones are not", "[algebra]") {
  const Density certain{Pose::identity(), Matrix6<double>::Zero()};
  const auto square = [](const Pose& x) { return x * x; };
  CHECK(propagate(CubatureRule<6>{}, certain, square).covariance.isZero());
  Matrix6<double> negative = Matrix6<double>::Identity();
  negative(5, 5) = -1.0;
  CHECK(error_message([&] {
          (void)propagate(CubatureRule<6>{}, Density{Pose::identity(), negative}, square);
        }).starts_with("pose covariance has a negative eigenvalue"));
  // More correlated than possible.
  const Density y{Pose::identity(), Matrix6<double>::Identity()};
  CHECK(error_message([&] {
          (void)propagate(CubatureRule<12>{}, y, y, Matrix6<double>(2.0 * Matrix6<double>::Identity()),
                          [](const Pose& a, const Pose& b) { return a * b; });
        }).starts_with("joint covariance of two states has a negative eigenvalue"));
}
