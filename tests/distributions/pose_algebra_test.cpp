// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <antipode/distributions/pose_algebra.hpp>
#include <antipode/distributions/pose_gaussian_queries.hpp>

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
    const auto narrow = [](const Density& density) {
      return Density{density.pose, 1e-4 * density.covariance};
    };
    const Density a = narrow(x), b = narrow(y), c = narrow(z);
    // What is left out is of sixth order, 1e-12 beside variances of 1e-4, with lever arms of up to ten
    // metres.
    CHECK(distance(compose(compose(a, b), c), compose(a, compose(b, c))) <= 1e-7);
    CHECK(distance(compose_first_order(compose_first_order(x, y), z),
                   compose_first_order(x, compose_first_order(y, z))) <= 1e-12);
    CHECK(distance(relative_pose_first_order(x, y), compose_first_order(inverse(x), y)) <= 1e-12);
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

TEST_CASE("Closed forms and sigma points have the mean of wide, correlated poses", "[algebra]") {
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
  const Density first_order = compose_first_order(x, y_of_x, cross);
  std::array<Pose, kSamples> poses;
  for (Pose& pose : poses) {
    const Pose a = draw(rng, x);
    pose = a * y.pose.boxplus(shuffle * a.boxminus(x.pose));
  }
  const Density truth = detail::chart_moments<Density>(
      poses[0], poses, Vector<double, int{kSamples}>::Constant(1.0 / double{kSamples}).eval());
  const double noise = std::sqrt(truth.covariance.trace() / kSamples);
  const auto error = [&](const Density& density) { return density.pose.boxminus(truth.pose).norm(); };
  CHECK(error(first_order) > 3.0 * noise);
  CHECK(error(sampled) < 0.3 * error(first_order));
  CHECK(error(compose(x, y_of_x, cross)) < 0.3 * error(first_order));
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

TEST_CASE("A covariance of which only one triangle is set is refused by products and inverses",
          "[algebra][error]") {
  const Density good{Pose(), Matrix6<double>::Identity()};
  for (const auto& [row, column] : {std::pair{0, 4}, std::pair{4, 0}}) {
    CAPTURE(row);
    Density triangle = good;
    triangle.covariance(row, column) = 0.25;
    const auto check_refused = [](const auto& f) {
      const auto message = error_message(f);
      CHECK(contains(message, "pose covariance is not finite or not symmetric: ["));
      CHECK(contains(message, "0.25"));
    };
    check_refused([&] { return inverse(triangle); });
    const std::vector<std::pair<Density, Density>> pairs = {{triangle, good}, {good, triangle}};
    for (const auto& pair : pairs) {
      const auto& [x, y] = pair;
      check_refused([&, &x = x, &y = y] { return compose(x, y); });
      check_refused([&, &x = x, &y = y] { return relative_pose(x, y); });
      check_refused([&, &x = x, &y = y] { return compose_first_order(x, y); });
      check_refused([&, &x = x, &y = y] { return relative_pose_first_order(x, y); });
    }
    // Both triangles, one of them with rounding errors.
    triangle.covariance(column, row) = 0.25 * (1.0 + 1e-12);
    CHECK_NOTHROW((void)compose(triangle, good));
    CHECK_NOTHROW((void)relative_pose_first_order(good, triangle));
  }
}

TEST_CASE("A difference of two poses with nearly the same error is symmetric", "[algebra][law]") {
  // What is left of their covariances is so small that rounding errors of these would be large beside it.
  Rng rng(4);
  const Matrix6<double> P = 1e4 * random_covariance<double, 6>(rng);
  const Density x{random_pose<double>(rng), P};
  const Density y{x.pose * Pose::exp(random_twist<double>(rng, 0.1, 0.1)),
                  P + 1e-6 * Matrix6<double>::Identity()};
  for (const Density& z : {relative_pose_first_order(x, y, P), relative_pose(x, y, P)}) {
    CHECK(z.covariance == z.covariance.transpose());
  }
}

namespace {

/// Errors of poses that are narrow along some axes and wide along others, with a lever arm between two poses.
struct UnevenWorld {
  Vector6<double> sigma;  // rad, m
  double lever_m;

  [[nodiscard]] Density x() const { return {Pose(), sigma.cwiseAbs2().asDiagonal()}; }
  [[nodiscard]] Density y() const {
    const Vector4<double> q =
        lever_m > 0.0 ? Vector4<double>(0.9, 0.1, -0.2, 0.3) : Vector4<double>(1, 0, 0, 0);
    return {Pose::from_rotation_translation(q.normalized(), lever_m * Vector3<double>(0.8, 0.5, -0.33)),
            sigma.cwiseAbs2().asDiagonal()};
  }
};

[[nodiscard]] std::vector<UnevenWorld> uneven_worlds() {
  const auto world = [](double phi_x, double phi_y, double phi_z, double rho_x, double rho, double lever_m) {
    return UnevenWorld{(Vector6<double>() << phi_x, phi_y, phi_z, rho_x, rho, rho).finished(), lever_m};
  };
  return {world(0.3, 0.3, 0.001, 0.01, 0.01, 0),   world(0.3, 0.3, 0.001, 0.01, 0.01, 10),
          world(0.3, 0.3, 0.001, 1, 1, 10),        world(0.3, 0.3, 0.001, 10, 0.01, 5),
          world(0.1, 0.1, 0.001, 0.01, 0.01, 0),   world(0.1, 0.1, 0.001, 0.01, 0.01, 100),
          world(0.5, 0.05, 0.05, 0.01, 0.01, 10),  world(0.5, 0.05, 0.05, 10, 0.01, 10),
          world(0.3, 0.001, 0.001, 0.01, 0.01, 10)};
}

/// The mean NEES of `draw()`s of poses.
template <class Estimate, class Draw>
[[nodiscard]] double anees(const Estimate& estimate, int count, const Draw& draw_pose) {
  double sum = 0.0;
  for (int k = 0; k < count; ++k) sum += nees(estimate, draw_pose());
  return sum / count;
}

}  // namespace

// A product of two errors of .3 rad is .06 rad along the third axis, sixty times its own error. The bounds of
// the following tests are six standard errors of 10000 chi-squares, .21, and .1 for what is of higher order.

TEST_CASE("A product knows what two wide axes do to a narrow one", "[algebra][random]") {
  for (const UnevenWorld& world : uneven_worlds()) {
    CAPTURE(world.sigma.transpose(), world.lever_m);
    const Density x = world.x(), y = world.y();
    Rng rng(7);
    const auto product = [&] {
      const Pose left = draw(rng, x);
      return left * draw(rng, y);
    };
    CHECK(std::abs(anees(compose(x, y), 10000, product) - 6.0) <= 0.31);
  }
}

TEST_CASE("A product does not lose a third axis to the first two and a wide position", "[algebra][random]") {
  // The position along y moves by [phi, [phi, rho]] only: counted up to twice.
  const UnevenWorld world{(Vector6<double>() << 0.3, 0.3, 0.001, 10, 0.01, 0.01).finished(), 0.0};
  const Density x = world.x(), y = world.y();
  Rng rng(8);
  const double mean = anees(compose(x, y), 10000, [&] {
    const Pose left = draw(rng, x);
    return left * draw(rng, y);
  });
  CHECK(mean <= 6.31);
  CHECK(mean >= 5.5);
}

TEST_CASE("Sigma points that are exact to degree 5 know it, too", "[algebra][random]") {
  for (const UnevenWorld& world : {uneven_worlds()[0], uneven_worlds()[4]}) {
    const Density x = world.x(), y = world.y();
    Rng rng(9);
    const auto product = [](const Pose& a, const Pose& b) { return a * b; };
    const auto sampled =
        propagate(Degree5Rule<12>{}, x, y, Matrix6<double>(Matrix6<double>::Zero()), product);
    CHECK(std::abs(anees(sampled, 10000,
                         [&] {
                           const Pose left = draw(rng, x);
                           return left * draw(rng, y);
                         }) -
                   6.0) <= 0.31);
    CHECK((sampled.covariance - compose(x, y).covariance).norm() <= 0.03 * sampled.covariance.norm());
  }
}

TEST_CASE("A difference of poses with a common wide error is consistent", "[algebra][random]") {
  auto worlds = uneven_worlds();
  worlds.pop_back();  // its third order is counted for independent poses only
  for (const UnevenWorld& world : worlds) {
    CAPTURE(world.sigma.transpose(), world.lever_m);
    const Density x = world.x();
    // y = x z, and its error is that of x but for a tenth of it.
    const Density y{world.y().pose, 1.01 * x.covariance};
    Rng rng(10);
    const Density own{Pose(), 0.01 * x.covariance};
    CHECK(anees(relative_pose(x, y, x.covariance), 10000, [&] {
            const Vector6<double> a = draw(rng, Density{Pose(), x.covariance}).log();
            const Vector6<double> b = a + draw(rng, own).log();
            return x.pose.boxplus(a).inverse() * y.pose.boxplus(b);
          }) <= 6.31);
  }
}

TEST_CASE("Unknown rotations leave a product finite and positions as wide as they are", "[algebra]") {
  for (const double variance : {1.0, 10.0, 1e6, 1e12}) {
    CAPTURE(variance);
    Vector6<double> unknown, known;
    unknown << variance, variance, variance, 0.01, 0.01, 0.01;
    known << 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4;
    const Density x{Pose(), unknown.asDiagonal()}, y{Pose(), known.asDiagonal()};
    for (const Density& product : {compose(x, y), compose(y, x), compose(x, x)}) {
      Rng rng(11);
      CHECK(draw(rng, product).coeffs().allFinite());
      CHECK(product.covariance(0, 0) >= 0.1 * variance);
      CHECK(product.covariance(3, 3) <= 4.0 * (0.01 + 0.01));
      CHECK(max_difference(product.covariance, product.covariance.transpose()) == 0.0);
    }
  }
}

TEST_CASE("Products in single precision are those in double precision", "[algebra]") {
  for (const UnevenWorld& world : uneven_worlds()) {
    const Density x = world.x(), y = world.y();
    const auto single = [](const Density& density) {
      return PoseGaussian<float>{
          DualQuaternion<float>::from_coefficients(density.pose.coeffs().cast<float>().eval()),
          density.covariance.cast<float>()};
    };
    const Matrix6<double> expected = compose(x, y).covariance;
    const Matrix6<float> product = compose(single(x), single(y)).covariance;
    for (int i = 0; i < 6; ++i)
      CHECK(static_cast<double>(product(i, i)) == Approx(expected(i, i)).epsilon(1e-3));
  }
}
