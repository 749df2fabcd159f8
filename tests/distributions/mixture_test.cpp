// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <numbers>

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/density.hpp>
#include <antipode/distributions/gaussian.hpp>
#include <antipode/distributions/mixture.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/reference.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

static_assert(Density<PoseMixture, DualQuaternion<double>>);

PoseMixture reference_mixture(const nlohmann::json& rows) {
  std::vector<PoseMixture::Element> elements;
  for (const auto& row : rows) {
    elements.push_back(
        {row.at("pi").get<double>(), PoseComponent(to_vector<4>(row.at("q")), to_vector<6>(row.at("mu")),
                                                   to_matrix<6>(row.at("Sigma")))});
  }
  return PoseMixture(std::move(elements));
}

double weight_sum(const PoseMixture& x) {
  double sum = 0.0;
  for (const auto& element : x) {
    CHECK(element.weight >= 0.0);
    sum += element.weight;
  }
  return sum;
}

/// Largest difference of the log densities at draws of the first.
template <class X>
double log_density_difference(const X& x, const X& y, unsigned seed) {
  Rng rng(seed);
  double difference = 0.0;
  for (int k = 0; k < 30; ++k) {
    const auto pose = x.sample(rng);
    difference = std::max(difference, std::abs(x.log_density(pose) - y.log_density(pose)));
  }
  return difference;
}

/// A component of someone else's: a number on the line that is known to lie in an interval.
struct Interval {
  using Scalar = double;
  double low, high;
  [[nodiscard]] double log_density(double x) const {
    return low <= x && x <= high ? -std::log(high - low) : -std::numeric_limits<double>::infinity();
  }
  template <class Engine>
  [[nodiscard]] double sample(Engine& rng) const {
    return std::uniform_real_distribution<double>(low, high)(rng);
  }
};

Fusion<Interval> fuse(const Interval& a, const Interval& b) {
  const Interval both{std::max(a.low, b.low), std::min(a.high, b.high)};
  const double overlap = std::max(0.0, both.high - both.low);
  return {both, std::log(overlap / (a.high - a.low) / (b.high - b.low)), 0.0, 0.0};
}

Interval compose(const Interval& a, const Interval& b) { return {a.low + b.low, a.high + b.high}; }

}  // namespace

TEST_CASE("Fused mixtures match the reference, with exact weights and with the paper's",
          "[mixture][reference]") {
  const auto reference = read_reference("projected_gaussian.json");
  for (const auto& row : reference.at("mixture_fuse")) {
    const PoseMixture a = reference_mixture(row.at("A")), b = reference_mixture(row.at("B"));
    const auto exact = fuse(a, b), paper = fuse(a, b, {.weights = FusionWeights::kPaper});
    // The reference leaves out the constant of the full sphere.
    CHECK(std::abs(exact.log_mass + std::numbers::ln2 - row.at("log_total").get<double>()) <= 1e-10);
    std::size_t k = 0;
    int rejected = 0;
    for (const auto& component : row.at("components")) {
      if (component.at("alpha").get<double>() == 0.0) {
        ++rejected;
        continue;
      }
      REQUIRE(k < exact.mixture.size());
      const auto& [weight, density] = exact.mixture[k];
      CHECK(std::abs(weight - component.at("weight").get<double>()) <= 1e-10);
      CHECK(std::abs(paper.mixture[k].weight - component.at("weight_paper_delta").get<double>()) <= 1e-10);
      CHECK(std::abs(std::abs(density.tangent_point().dot(to_vector<4>(component.at("q")))) - 1.0) <= 1e-13);
      CHECK(max_difference(density.mean(), to_vector<6>(component.at("mu"))) <= 1e-10);
      CHECK(max_difference(density.covariance(), to_matrix<6>(component.at("Sigma"))) <= 1e-10);
      ++k;
    }
    CHECK(k == exact.mixture.size());
    CHECK(exact.rejected_pairs == rejected);
  }
}

TEST_CASE("A fused mixture is the product by brute force", "[mixture][random]") {
  Rng rng(1);
  const auto pose = random_pose<double>(rng);
  const PoseMixture a = random_mixture(rng, 3, pose), b = random_mixture(rng, 2, pose);
  const auto fused = fuse(a, b);
  const auto expected = tangent_moments(fused.mixture, pose.rotation());

  // Draws of a, weighted by the density of b.
  constexpr int kDraws = 1000000;
  SampleMoments moments;
  double mass = 0.0, squares = 0.0;
  const PoseComponent chart(pose, Matrix6<double>::Identity());
  for (int k = 0; k < kDraws; ++k) {
    const auto x = a.sample(rng);
    const double weight = std::exp(b.log_density(x) - fused.log_mass);
    moments.add(weight, chart.coordinates(x) - expected.mean);
    mass += weight / kDraws;
    squares += weight * weight / kDraws;
  }
  CAPTURE(fused.linearization_bound);
  CHECK(std::abs(mass - 1.0) <= 4.0 * std::sqrt((squares - mass * mass) / kDraws));
  for (int i = 0; i < 6; ++i) {
    CHECK(std::abs(moments.mean()[i]) <= 4.0 * moments.mean_error()[i]);
    for (int j = 0; j <= i; ++j) {
      CHECK(std::abs(moments.covariance()(i, j) - expected.covariance(i, j)) <=
            4.0 * moments.covariance_error()(i, j));
    }
  }
}

TEST_CASE("A composed mixture is that of products of draws", "[mixture][random]") {
  Rng rng(2);
  const auto pose_a = random_pose<double>(rng), pose_b = random_pose<double>(rng);
  // The bias of the linearised mean is 3 sigma_u of its standard deviation: below the error of the draws.
  const Spread spread{.angle = 2e-3, .distance = 0.01, .sigma_u = 5e-4, .sigma_t = 2e-3};
  const PoseMixture a = random_mixture(rng, 3, pose_a, spread), b = random_mixture(rng, 2, pose_b, spread);
  const PoseMixture ab = compose(a, b);
  REQUIRE(ab.size() == 6);
  const auto pose = pose_a * pose_b;
  const auto expected = tangent_moments(ab, pose.rotation());
  constexpr int kDraws = 1000000;
  SampleMoments moments;
  const PoseComponent chart(pose, Matrix6<double>::Identity());
  for (int k = 0; k < kDraws; ++k) {
    moments.add(1.0, chart.coordinates(a.sample(rng) * b.sample(rng)) - expected.mean);
  }
  for (int i = 0; i < 6; ++i) {
    CHECK(std::abs(moments.mean()[i]) <= 4.0 * moments.mean_error()[i]);
    for (int j = 0; j <= i; ++j) {
      CHECK(std::abs(moments.covariance()(i, j) - expected.covariance(i, j)) <=
            4.0 * moments.covariance_error()(i, j));
    }
  }
}

TEST_CASE("Equal components in different tangent spaces are the single one", "[mixture][law]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_density_at(rng, random_pose<double>(rng), 1e-4, 0.1);
    const auto y = random_density_at(rng, nearby_pose(rng, x.pose(), 1e-4, 0.05), 1e-4, 0.1);
    const auto elsewhere = [&] { return nearby_pose(rng, x.pose(), 0.2, 0.0).rotation(); };
    const PoseMixture copies({{0.5, x}, {0.3, x.rebased(elsewhere())}, {0.2, with_flipped_sign(x)}});
    // See "A concentrated density looks the same from any tangent space".
    CHECK(log_density_difference(copies, PoseMixture(x), seed) <= 1e-2);
    CHECK(log_density_difference(fuse(copies, PoseMixture(y)).mixture, PoseMixture(fuse(x, y).density),
                                 seed) <= 1e-2);
    CHECK(std::abs(fuse(copies, PoseMixture(y)).log_mass - fuse(x, y).log_mass) <= 1e-2);
    CHECK(log_density_difference(compose(copies, y), PoseMixture(compose(x, y)), seed) <= 1e-2);
  }
}

TEMPLATE_TEST_CASE("Mixtures fuse in either order and whatever the signs", "[mixture][law]",
                   ProjectedGaussian<double>, PushForwardGaussian<double>) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto pose = random_pose<double>(rng);
    const auto a = random_mixture<TestType>(rng, 3, pose), b = random_mixture<TestType>(rng, 4, pose);
    std::vector<typename Mixture<TestType>::Element> flipped;
    for (const auto& [weight, density] : b) flipped.push_back({weight, with_flipped_sign(density)});
    const auto ab = fuse(a, b);
    for (const auto& other : {fuse(b, a), fuse(a, Mixture<TestType>(flipped))}) {
      CHECK(log_density_difference(ab.mixture, other.mixture, seed) <= 1e-9);
      CHECK(std::abs(ab.log_mass - other.log_mass) <= 1e-10);
      CHECK(ab.linearization_bound == Approx(other.linearization_bound));
    }
  }
}

TEST_CASE("The order of fusing mixtures matters no more than the bounds of linearisation say", "[mixture]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto pose = random_pose<double>(rng);
    const Spread spread{.angle = 0.15, .distance = 0.1, .sigma_u = seed % 2 ? 0.1 : 0.02, .sigma_t = 0.2};
    const auto a = random_mixture(rng, 2, pose, spread), b = random_mixture(rng, 3, pose, spread),
               c = random_mixture(rng, 2, pose, spread);
    const auto ab = fuse(a, b), bc = fuse(b, c);
    const auto ab_c = fuse(ab.mixture, c), a_bc = fuse(a, bc.mixture);
    const double bound =
        ab.linearization_bound + ab_c.linearization_bound + bc.linearization_bound + a_bc.linearization_bound;
    double squares = 0.0;
    constexpr int kDraws = 300;
    for (int k = 0; k < kDraws; ++k) {
      const auto x = ab_c.mixture.sample(rng);
      const double ratio = ab_c.mixture.log_density(x) - a_bc.mixture.log_density(x);
      squares += ratio * ratio / kDraws;
    }
    CHECK(std::sqrt(squares) <= bound);
    CHECK(std::abs(ab.log_mass + ab_c.log_mass - bc.log_mass - a_bc.log_mass) <= bound);
  }
}

TEST_CASE("Mixtures compose associatively, and with single and certain poses", "[mixture][law]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto a = random_mixture(rng, 2, random_pose<double>(rng));
    const auto b = random_mixture(rng, 2, random_pose<double>(rng));
    const auto c = random_density_at(rng, random_pose<double>(rng), 0.03, 0.1);
    const auto y = random_pose<double>(rng);
    CHECK(log_density_difference(compose(compose(a, b), c), compose(a, compose(b, c)), seed) <= 1e-9);
    CHECK(log_density_difference(compose(a, PoseMixture(c)), compose(a, c), seed) <= 1e-9);
    CHECK(log_density_difference(compose(c, a), compose(PoseMixture(c), a), seed) <= 1e-9);
    CHECK(log_density_difference(inverse(compose(a, y)), compose(y.inverse(), inverse(a)), seed) <= 1e-9);
    CHECK(log_density_difference(relative_pose(a, b), compose(inverse(a), b), seed) <= 1e-9);
    CHECK(weight_sum(compose(a, b)) == Approx(1.0).epsilon(1e-14));
  }
}

TEST_CASE("The gate rejects components too far apart and reports their weight", "[mixture]") {
  Rng rng(3);
  const auto pose = random_pose<double>(rng);
  const auto at = [&](double degrees) {  // of the quaternion; the rotation turns twice as far
    return random_density_at(rng, nearby_pose(rng, pose, degrees * std::numbers::pi / 90.0, 0.0), 0.1, 0.1);
  };
  const auto near = at(0.0), edge = at(18.75), far = at(40.0);
  const PoseMixture a(near), b({{0.5, near}, {0.3, edge}, {0.2, far}});
  const auto hard = fuse(a, b);
  CHECK(hard.mixture.size() == 1);
  CHECK(hard.rejected_pairs == 2);
  CHECK(hard.rejected_weight == Approx(0.5));
  CHECK(hard.log_mass == Approx(std::log(0.5) + fuse(near, near).log_mass));

  // Half way from 15 to 22.5 degrees, alpha = cos^2(45 degrees).
  const auto tapered = fuse(a, b, {.gate = PlausibilityGate::kTapered});
  REQUIRE(tapered.mixture.size() == 2);
  CHECK(tapered.rejected_weight == Approx(0.2));
  const double pair = std::log(0.3) + fuse(near, edge, {.max_angle = 0.5}).log_mass;
  CHECK(std::log(tapered.mixture[1].weight) + tapered.log_mass == Approx(std::log(0.5) + pair));
}

TEST_CASE("The paper's weights make a broad pair count as much as a precise one", "[mixture]") {
  Rng rng(4);
  const auto pose = random_pose<double>(rng);
  const Matrix6<double> I = Matrix6<double>::Identity();
  const PoseComponent precise(pose, 1e-6 * I), broad(pose, 1e-2 * I);
  const PoseMixture x({{0.5, precise}, {0.5, broad}});
  const auto paper = fuse(x, x, {.weights = FusionWeights::kPaper}), exact = fuse(x, x);
  CHECK(paper.mixture[0].weight == Approx(0.25));
  CHECK(paper.mixture[3].weight == Approx(0.25));
  CHECK(paper.log_mass == Approx(0.0).margin(1e-12));
  // Masses go with |4 pi Sigma|^-1/2: 10^12 : 1, up to the normalisers.
  CHECK(std::log10(exact.mixture[0].weight / exact.mixture[3].weight) == Approx(12.0).epsilon(0.01));
}

TEST_CASE("A mixture draws each component in proportion to its weight", "[mixture][random]") {
  Rng rng(5);
  const PoseMixture x({{0.7, random_density_at(rng, random_pose<double>(rng), 0.01, 0.01)},
                       {0.0, random_density_at(rng, random_pose<double>(rng), 0.01, 0.01)},
                       {0.3, random_density_at(rng, random_pose<double>(rng), 0.01, 0.01)}});
  constexpr int kDraws = 10000;
  std::array<int, 3> counts{};
  for (int k = 0; k < kDraws; ++k) {
    const auto pose = x.sample(rng);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto error = pose.boxminus(x[i].density.pose());
      counts[i] += error.norm() < 0.2 ? 1 : 0;
    }
  }
  CHECK(std::abs(counts[0] - 0.7 * kDraws) <= 5.0 * std::sqrt(0.21 * kDraws));
  CHECK(counts[1] == 0);
  CHECK(counts[0] + counts[2] == kDraws);
  CHECK(x.heaviest().weight == 0.7);
}

TEST_CASE("Any density can be mixed, fused and composed", "[mixture]") {
  const Mixture<Interval> x({{0.25, {0.0, 1.0}}, {0.75, {2.0, 4.0}}});
  CHECK(x.log_density(3.0) == Approx(std::log(0.375)));
  CHECK(x.log_density(1.5) == -std::numeric_limits<double>::infinity());
  const auto fused = fuse(x, Mixture<Interval>(Interval{0.5, 2.5}));
  REQUIRE(fused.mixture.size() == 2);
  CHECK(fused.mixture[0].weight == Approx(0.4));  // 0.25 * 0.5 / 2 against 0.75 * 0.5 / 4
  CHECK(fused.log_mass == Approx(std::log(0.0625 + 0.09375)));
  CHECK(compose(x, x).size() == 4);
  CHECK(contains(error_message([&] {
                   return fuse(x, Mixture<Interval>(Interval{5.0, 6.0}));
                 }),
                 "incompatible mixtures"));

  const Mixture<Gaussian<double, 2>> plane(Gaussian<double, 2>::standard());
  CHECK(plane.log_density(Vector2<double>(0, 0)) == Approx(-std::log(2.0 * std::numbers::pi)));
  Rng rng(6);
  const auto orientation = Bingham<double, 4>::from_mode_covariance(random_quaternion<double>(rng),
                                                                    0.01 * Matrix3<double>::Identity());
  const auto bingham = BinghamGaussian<double>::independent(orientation, Vector3<double>(1, 2, 3),
                                                            Matrix3<double>::Identity());
  const auto y = random_pose<double>(rng);
  const auto moved = compose(y, Mixture<BinghamGaussian<double>>(bingham));
  CHECK(moved[0].density.pose().is_approx(y * bingham.pose(), 1e-12));
}

TEST_CASE("Mixtures of the tightest and the widest components stay finite", "[mixture]") {
  Rng rng(7);
  const auto pose = random_pose<double>(rng);
  const Matrix6<double> I = Matrix6<double>::Identity();
  const PoseMixture x({{0.5, PoseComponent(pose, 1e-10 * I)}, {0.5, PoseComponent(pose, 1e7 * I)}});
  const auto far = nearby_pose(rng, pose, 0.3, 3.0);
  const PoseMixture y({{0.5, PoseComponent(far, 1e-10 * I)}, {0.5, PoseComponent(far, 1.0 * I)}});
  for (const auto& fused : {fuse(x, x), fuse(x, y)}) {
    CHECK(std::isfinite(fused.log_mass));
    CHECK(std::isfinite(fused.linearization_bound));
    CHECK(weight_sum(fused.mixture) == Approx(1.0).epsilon(1e-14));
    CHECK(std::isfinite(fused.mixture.log_density(pose)));
    for (const auto& element : fused.mixture) CHECK(element.density.covariance().allFinite());
  }
}

TEST_CASE("The density at a pose that is not a number is none", "[mixture]") {
  Rng rng(7);
  const auto mixture = random_mixture(rng, 3, random_pose<double>(rng));
  Vector<double, 8> coefficients = random_pose<double>(rng).coeffs();
  for (const int i : {1, 6}) {  // rotation, translation
    Vector<double, 8> broken = coefficients;
    broken[i] = std::nan("");
    CHECK(std::isnan(mixture.log_density(DualQuaternion<double>::unchecked(broken))));
  }
}

TEST_CASE("Invalid mixtures are refused", "[mixture][error]") {
  Rng rng(8);
  const auto x = random_density_at(rng, random_pose<double>(rng), 0.1, 0.1);
  using Elements = std::vector<PoseMixture::Element>;
  const auto message = [](const Elements& elements) {
    return error_message([&] { return PoseMixture(elements); });
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK(contains(message({}), "a mixture needs components"));
  CHECK(contains(message({{0.5, x}}), "do not sum to one, sum: 0.5"));
  CHECK(contains(message({{1.5, x}, {-0.5, x}}), "negative or not a number: -0.5"));
  CHECK(contains(message({{kNan, x}}), "negative or not a number"));
  CHECK(message({{0.5000001, x}, {0.5, x}}) == "nothing thrown");
  CHECK(contains(error_message([&] { return PoseMixture::normalized({{0.0, x}}); }), "sum: 0"));
  CHECK(PoseMixture::normalized({{3.0, x}, {1.0, x}})[0].weight == 0.75);

  const auto far = compose(DualQuaternion<double>::exp(random_twist<double>(rng, 2.0)), x);
  CHECK(contains(error_message([&] { return fuse(PoseMixture(x), PoseMixture(far)); }),
                 "incompatible mixtures"));
  CHECK_FALSE(try_fuse(PoseMixture(x), PoseMixture(far)).has_value());
}
