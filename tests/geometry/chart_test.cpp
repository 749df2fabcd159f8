// SPDX-License-Identifier: MIT
#include <numbers>
#include <tuple>

#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/extended_pose.hpp>
#include <antipode/testing/laws.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

template <class Scalar>
using PoseAndVelocity = ProductChart<SplitChart<Scalar>, VectorChart<Scalar, 3>>;

/// A vector of the chart with the rotation first; the rest has entries in [-3, 3].
template <class C>
[[nodiscard]] Vector<typename C::Scalar, C::kDim> random_vector(Rng& rng, double angle) {
  using Scalar = typename C::Scalar;
  Vector<Scalar, C::kDim> a = random_matrix<Scalar, C::kDim, 1>(rng, 3.0);
  a.template head<3>() = random_twist<Scalar>(rng, angle).template head<3>();
  return a;
}

template <class Scalar>
[[nodiscard]] ExtendedPose<Scalar> random_extended_pose(Rng& rng) {
  return {random_pose<Scalar>(rng), random_matrix<Scalar, 3, 1>(rng, 3.0)};
}

template <class C>
[[nodiscard]] typename C::Point random_point(Rng& rng) {
  using Scalar = typename C::Scalar;
  if constexpr (std::same_as<typename C::Point, DualQuaternion<Scalar>>) {
    return random_pose<Scalar>(rng);
  } else if constexpr (std::same_as<typename C::Point, ExtendedPose<Scalar>>) {
    return random_extended_pose<Scalar>(rng);
  } else {
    return {random_pose<Scalar>(rng), random_matrix<Scalar, 3, 1>(rng)};
  }
}

}  // namespace

TEMPLATE_TEST_CASE("Charts obey their laws", "[chart][law]", ScrewChart<double>, SplitChart<double>,
                   SplitChart<float>, PoseAndVelocity<double>, ExtendedPoseChart<double>) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    for (const double angle : {0.0, 1e-8, 0.3, 2.0, 3.1}) {
      CAPTURE(seed, angle);
      Rng rng(seed);
      const auto x = random_point<TestType>(rng);
      const auto y = random_point<TestType>(rng);
      const auto a = random_vector<TestType>(rng, angle);
      const auto b = random_vector<TestType>(rng, 1.0);
      const double tolerance = 200 * kEpsilon<typename TestType::Scalar>;
      CHECK(testing::check_chart_laws<TestType>(x, y, a, b, tolerance));
    }
  }
}

TEST_CASE("The split chart moves the position in the parent's axes", "[chart]") {
  Rng rng(1);
  const auto x = random_pose<double>(rng);
  const auto xi = random_twist<double>(rng, 0.7);
  const auto y = SplitChart<double>::retract(x, xi);
  CHECK(max_difference(y.translation(), x.translation() + xi.tail<3>()) <= 1e-14);
  Vector6<double> turn = xi;
  turn.tail<3>().setZero();
  CHECK(max_difference(y.rotation_matrix(), x.boxplus(turn).rotation_matrix()) <= 1e-14);
}

TEST_CASE("Charts do not see the sign of a pose and end at half a turn", "[chart]") {
  Rng rng(2);
  const auto x = random_pose<double>(rng), y = random_pose<double>(rng);
  const auto antipode = DualQuaternion<double>::unchecked(-y.coeffs());
  CHECK(max_difference(SplitChart<double>::local(x, y), SplitChart<double>::local(x, antipode)) == 0.0);
  CHECK(SplitChart<double>::contains(random_twist<double>(rng, std::numbers::pi - 1e-9)));
  CHECK_FALSE(SplitChart<double>::contains(random_twist<double>(rng, std::numbers::pi + 1e-9)));
  Vector<double, 9> a = Vector<double, 9>::Zero();
  a[1] = 4.0;
  CHECK_FALSE(PoseAndVelocity<double>::contains(a));
}

TEST_CASE("Extended poses are a group with its adjoint", "[chart][law]") {
  for (unsigned seed = 0; seed < 40; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_extended_pose<double>(rng), y = random_extended_pose<double>(rng),
               z = random_extended_pose<double>(rng);
    const auto xi = random_vector<ExtendedPoseChart<double>>(rng, 1.5);
    const auto distance = [](const auto& a, const auto& b) { return (a.inverse() * b).log().norm(); };
    CHECK(distance((x * y) * z, x * (y * z)) <= 1e-12);
    CHECK(distance(x * x.inverse(), ExtendedPose<double>{}) <= 1e-12);
    CHECK(distance(ExtendedPose<double>::exp(x.log()), x) <= 1e-12);
    const Vector<double, 9> moved = x.adjoint() * xi;
    CHECK(distance(x * ExtendedPose<double>::exp(xi) * x.inverse(), ExtendedPose<double>::exp(moved)) <=
          1e-11);
  }
}

TEST_CASE("Points that are not finite are refused with the value", "[chart][error]") {
  const Vector3<double> broken(0, std::nan(""), 0);
  CHECK(contains(error_message([&] {
                   PoseAndVelocity<double>::require_finite({DualQuaternion<double>::identity(), broken});
                 }),
                 "vector of the state is not finite: [0; nan; 0]"));
  for (Eigen::Index i = 0; i < 9; ++i) {
    Vector<double, 9> xi = Vector<double, 9>::Zero();
    xi[i] = std::nan("");
    CHECK(
        contains(error_message([&] { (void)ExtendedPose<double>::exp(xi); }), "extended pose is not finite"));
  }
}
