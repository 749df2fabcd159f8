// SPDX-License-Identifier: MIT
#include <limits>
#include <numbers>

#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/testing/laws.hpp>

#include "geometry/antipode_of.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

constexpr unsigned kPoseSeed = 2;
constexpr int kPoseTrials = 200;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

static_assert(LieGroup<DualQuaternion<double>>);
static_assert(LieGroup<DualQuaternion<float>>);
static_assert(sizeof(DualQuaternion<float>) == 8 * sizeof(float));

TEMPLATE_TEST_CASE("Poses obey the laws of a Lie group", "[dual_quaternion][law]", float, double) {
  using Pose = DualQuaternion<TestType>;
  Rng rng(kPoseSeed);
  CAPTURE(kPoseSeed);
  for (const double angle : {0.0, 1e-8, 1e-3, 0.1, 1.0, 3.0}) {
    for (int trial = 0; trial < kPoseTrials; ++trial) {
      const Pose x = random_pose<TestType>(rng), y = random_pose<TestType>(rng),
                 z = random_pose<TestType>(rng);
      // Every law compares a few products of numbers up to 10; log is as well conditioned as 1/|w|^0 there.
      const double tolerance = 400 * kEpsilon<TestType>;
      const auto report =
          testing::check_lie_group_laws(x, y, z, random_twist<TestType>(rng, angle), tolerance);
      CAPTURE(angle, x, y, z, report);
      CHECK(report);
    }
  }
}

TEMPLATE_TEST_CASE("A point moves as by Eigen's isometry", "[dual_quaternion][law]", float, double) {
  using Pose = DualQuaternion<TestType>;
  Rng rng(kPoseSeed);
  CAPTURE(kPoseSeed);
  for (int trial = 0; trial < kPoseTrials; ++trial) {
    const Pose a = random_pose<TestType>(rng), b = random_pose<TestType>(rng);
    const Vector3<TestType> v = random_matrix<TestType, 3, 1>(rng, 10);
    const double tolerance = 100 * kEpsilon<TestType>;  // numbers up to 30
    CHECK(max_difference(a * v, a.isometry() * v) <= tolerance);
    CHECK(max_difference(a * v, rotate(a.rotation(), v) + a.translation()) <= tolerance);
    CHECK(max_difference((a * b) * v, a * (b * v)) <= tolerance);
    CHECK(max_difference((a * b).isometry().matrix(), (a.isometry() * b.isometry()).matrix()) <= tolerance);
    CHECK(max_difference(a.inverse().isometry().matrix(), a.isometry().inverse().matrix()) <= tolerance);
    CHECK(Pose::from_isometry(a.isometry()).is_approx(a, TestType(tolerance)));
    CHECK(Pose::from_matrix(a.rotation_matrix(), a.translation()).is_approx(a, TestType(tolerance)));
  }
}

TEMPLATE_TEST_CASE("Only the total conjugate moves points", "[dual_quaternion]", float, double) {
  using Pose = DualQuaternion<TestType>;
  Rng rng(kPoseSeed);
  CAPTURE(kPoseSeed);
  for (int trial = 0; trial < kPoseTrials; ++trial) {
    const Pose x = random_pose<TestType>(rng);
    const Vector3<TestType> v = random_matrix<TestType, 3, 1>(rng);
    Vector8<TestType> embedded = Vector8<TestType>::Unit(0);
    embedded.template tail<3>() = v;
    const Pose point = Pose::unchecked(embedded);
    const auto moved_by = [&](const Pose& conjugate_of_x) {
      return Vector3<TestType>((x * point * conjugate_of_x).dual().template tail<3>());
    };
    const double tolerance = 64 * kEpsilon<TestType>;
    CHECK(max_difference(moved_by(x.total_conjugate()), x * v) <= tolerance);
    CHECK(max_difference(moved_by(x.quaternion_conjugate()), x.rotation_matrix() * v) <= tolerance);
    CHECK(x.dual_conjugate().dual() == -x.dual());
    CHECK(x.inverse().coeffs() == x.quaternion_conjugate().coeffs());
  }
}

TEMPLATE_TEST_CASE("No result depends on the sign of a pose", "[dual_quaternion][law]", float, double) {
  using Pose = DualQuaternion<TestType>;
  Rng rng(kPoseSeed);
  CAPTURE(kPoseSeed);
  for (int trial = 0; trial < kPoseTrials; ++trial) {
    Pose x = random_pose<TestType>(rng);
    const Pose y = random_pose<TestType>(rng);
    const Vector3<TestType> v = random_matrix<TestType, 3, 1>(rng);
    if (trial % 4 == 0) {  // half a turn, where w = 0 leaves the sign to the axis
      x = Pose::from_rotation_translation(Vector4<TestType>::Unit(1 + trial % 3), x.translation());
    }
    const Pose minus_x = antipode_of(x);
    CHECK(x * v == minus_x * v);
    CHECK(x.translation() == minus_x.translation());
    CHECK(x.rotation_matrix() == minus_x.rotation_matrix());
    CHECK(x.adjoint() == minus_x.adjoint());
    CHECK(x.log() == minus_x.log());
    CHECK(x.canonical().coeffs() == minus_x.canonical().coeffs());
    CHECK(x.boxminus(y) == minus_x.boxminus(antipode_of(y)));
    CHECK(x.boxminus(y) == minus_x.boxminus(y));
    CHECK(x.is_approx(minus_x, TestType(0)));
  }
}

TEMPLATE_TEST_CASE("exp and log of poses are inverse up to pi", "[dual_quaternion][law]", float, double) {
  using Pose = DualQuaternion<TestType>;
  Rng rng(kPoseSeed);
  CAPTURE(kPoseSeed);
  const double near_pi = std::numbers::pi - 100 * kEpsilon<TestType>;
  for (const double angle : {0.0, 1e-30, 1e-12, 1e-8, 1e-4, 0.0999, 0.1001, 1.0, 2.0, 3.0, 3.14, near_pi}) {
    for (int trial = 0; trial < kPoseTrials; ++trial) {
      const Vector6<TestType> xi = random_twist<TestType>(rng, angle, 10);
      const Pose x = Pose::exp(xi);
      CAPTURE(angle, xi.transpose(), x.log().transpose());
      CHECK(max_difference(x.log().template head<3>(), xi.template head<3>()) <=
            8 * kEpsilon<TestType> * angle);
      CHECK(max_difference(x.log(), xi) <= 200 * kEpsilon<TestType>);  // |rho| <= 17
      CHECK(max_difference(x.translation(), so3_left_jacobian(xi.template head<3>()) *
                                                xi.template tail<3>()) <= 200 * kEpsilon<TestType>);
    }
  }
}

TEST_CASE("exp is a one-parameter group, beyond pi too", "[dual_quaternion][law]") {
  Rng rng(kPoseSeed);
  CAPTURE(kPoseSeed);
  for (int trial = 0; trial < kPoseTrials; ++trial) {
    const Vector6<double> xi = random_twist<double>(rng, uniform<double>(rng, 0, 6), 3);
    const double s = uniform<double>(rng, -3, 3), t = uniform<double>(rng, -3, 3);
    const auto product = DualQuaternion<double>::exp(s * xi) * DualQuaternion<double>::exp(t * xi);
    CHECK(product.is_approx(DualQuaternion<double>::exp((s + t) * xi), 100 * kEpsilon<double>));
  }
}

TEMPLATE_TEST_CASE("The composition is three quaternion products", "[dual_quaternion][law]", float, double) {
  Rng rng(11);
  constexpr double tolerance = 8 * kEpsilon<TestType>;
  for (int trial = 0; trial < 100; ++trial) {
    const auto x = random_pose<TestType>(rng), y = random_pose<TestType>(rng);
    const auto product = x * y;
    const Vector4<TestType> p = product.dual();
    const Vector4<TestType> expected =
        hamilton_product(x.rotation(), y.dual()) + hamilton_product(x.dual(), y.rotation());
    CHECK(max_difference(product.rotation(), hamilton_product(x.rotation(), y.rotation())) <= tolerance);
    const double size = static_cast<double>(x.dual().norm() + y.dual().norm());
    CHECK(max_difference(p, expected) <= tolerance * (1.0 + size));
  }
}

TEMPLATE_TEST_CASE("Renormalising removes the drift of a million products", "[dual_quaternion]", float,
                   double) {
  using Pose = DualQuaternion<TestType>;
  Rng rng(kPoseSeed);
  CAPTURE(kPoseSeed);
  Pose x;
  for (int k = 0; k < 1000000; ++k) {
    x = x * Pose::exp(random_twist<TestType>(rng, 0.1, 0.1));
    if (k % 100 == 0) {
      x = x.renormalized();
    }
  }
  x = x.renormalized();
  CHECK(std::abs(static_cast<double>(x.real().norm()) - 1) <= 2 * kEpsilon<TestType>);
  CHECK(std::abs(static_cast<double>(x.real().dot(x.dual()))) <=
        4 * kEpsilon<TestType> * static_cast<double>(x.dual().norm()));
}

TEST_CASE("A view reads and writes memory it does not own", "[dual_quaternion]") {
  Rng rng(kPoseSeed);
  const auto x = random_pose<double>(rng), y = random_pose<double>(rng);
  alignas(16) double memory[9] = {};
  DualQuaternionView<double> view(memory + 1);  // unaligned on purpose
  const ConstDualQuaternionView<double> reader(static_cast<const double*>(memory + 1));

  view = x;
  CHECK(reader.coeffs() == x.coeffs());
  view = reader * y;
  CHECK(reader.coeffs() == (x * y).coeffs());
  CHECK((y * view).coeffs() == (y * (x * y)).coeffs());
  CHECK(view.log() == (x * y).log());

  alignas(16) double other_memory[8];
  DualQuaternionView<double> other(other_memory);
  other = view;  // copies the pose, not the pointer
  view = y;
  CHECK(other.coeffs() == (x * y).coeffs());
  const DualQuaternion<double> owned = view;
  CHECK(owned.coeffs() == y.coeffs());
}

TEST_CASE("Poses convert between scalar types", "[dual_quaternion]") {
  Rng rng(kPoseSeed);
  const auto x = random_pose<double>(rng);
  CHECK(x.cast<float>().cast<double>().is_approx(x, kEpsilon<float>));
  CHECK(x.cast<double>().coeffs() == x.coeffs());
}

TEST_CASE("A default pose is the identity, and poses print as rotation and translation",
          "[dual_quaternion]") {
  std::ostringstream text;
  text << DualQuaternion<double>();
  CHECK(text.str() == "{q: [1 0 0 0], t: [0 0 0]}");
  CHECK(DualQuaternion<double>().coeffs() == DualQuaternion<double>::identity().coeffs());
}

TEMPLATE_TEST_CASE("A printed position reads back as the same numbers", "[dual_quaternion]", float, double) {
  using Scalar = TestType;
  // UTM coordinates: six digits would lose everything below ten metres.
  const Vector3<Scalar> utm(Scalar(691234.0625), Scalar(5335876.4321), Scalar(0.1));
  const auto x =
      DualQuaternion<Scalar>::from_rotation_translation(Vector4<Scalar>(Scalar(0.6), 0, 0, Scalar(0.8)), utm);
  std::ostringstream text;
  text << x;
  std::istringstream numbers(text.str().substr(text.str().find("t: [") + 4));
  for (int i = 0; i < 3; ++i) {
    Scalar read{};
    numbers >> read;
    CHECK(read == x.translation()[i]);
  }
  text << DualQuaternion<Scalar>::unchecked(
      Vector8<Scalar>::Constant(std::numeric_limits<Scalar>::quiet_NaN()));
  CHECK(text.str().find("nan") != std::string::npos);
}

TEST_CASE("Coefficients slightly off the Study quadric are projected onto it", "[dual_quaternion]") {
  Rng rng(kPoseSeed);
  CAPTURE(kPoseSeed);
  for (int trial = 0; trial < kPoseTrials; ++trial) {
    const auto x = random_pose<double>(rng);
    const Vector8<double> off = x.coeffs() + 1e-7 * random_matrix<double, 8, 1>(rng);
    const auto y = DualQuaternion<double>::from_coefficients(off);
    CHECK(std::abs(y.real().norm() - 1) <= 2 * kEpsilon<double>);
    CHECK(std::abs(y.real().dot(y.dual())) <= 8 * kEpsilon<double>);
    CHECK(y.is_approx(x, 1e-6));
  }
}

TEST_CASE("Invalid poses are refused with their value", "[dual_quaternion][error]") {
  using Pose = DualQuaternion<double>;
  const Vector4<double> one = Vector4<double>::Unit(0);
  Vector8<double> off_quadric = Vector8<double>::Unit(0);
  off_quadric[4] = 0.01;

  CHECK(error_message([&] { return Pose::from_coefficients(2 * Vector8<double>::Unit(0)); }) ==
        "not a unit dual quaternion [q; p]: [2; 0; 0; 0; 0; 0; 0; 0]");
  CHECK(contains(error_message([&] { return Pose::from_coefficients(off_quadric); }), "0.01"));
  CHECK(contains(error_message([&] { return Pose::from_coefficients(Vector8<double>::Constant(kNan)); }),
                 "nan"));
  CHECK(error_message([&] {
          return Pose::from_rotation_translation(one, Vector3<double>(1, kInfinity, 3));
        }) == "translation is not finite: [1; inf; 3]");
  CHECK_THROWS_AS(Pose::from_rotation_translation(1.1 * one, Vector3<double>::Zero()), std::invalid_argument);
  CHECK_THROWS_AS(Pose::from_matrix(Matrix3<double>::Ones(), Vector3<double>::Zero()), std::invalid_argument);
  CHECK_THROWS_AS(Pose::unchecked(Vector8<double>::Zero()).renormalized(), std::invalid_argument);
  CHECK_THROWS_AS(DualQuaternion<float>::unchecked(Vector8<float>::Zero()).renormalized(),
                  std::invalid_argument);
  CHECK_THROWS_AS(Pose::unchecked(Vector8<double>::Constant(kInfinity)).renormalized(),
                  std::invalid_argument);
}

TEST_CASE("A twist with one entry that is not finite is refused, whichever it is",
          "[dual_quaternion][error]") {
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    for (int i = 0; i < 6; ++i) {
      for (const double others : {0.0, 1.0}) {
        Vector6<double> xi = Vector6<double>::Constant(others);
        xi[i] = bad;
        CAPTURE(xi.transpose());
        CHECK_THROWS_AS(DualQuaternion<double>::exp(xi), std::invalid_argument);
        CHECK_THROWS_AS(DualQuaternion<double>().boxplus(xi), std::invalid_argument);
      }
    }
  }
}

TEST_CASE("A pose with NaN is never approximately another", "[dual_quaternion][error]") {
  const auto bad = DualQuaternion<double>::unchecked(Vector8<double>::Constant(kNan));
  CHECK_FALSE(bad.is_approx(bad, 1.0));
  CHECK_FALSE(bad.is_approx(DualQuaternion<double>(), 1.0));
  CHECK_FALSE(bad.log().allFinite());
}

TEMPLATE_TEST_CASE("A cloud of points moves like each of them", "[dual_quaternion]", float, double) {
  Rng rng(1);
  const auto x = random_pose<TestType>(rng);
  const double tolerance = 10 * kEpsilon<TestType> * (1.0 + static_cast<double>(x.translation().norm()));
  const Matrix<TestType, 3, 7> fixed = random_matrix<TestType, 3, 7>(rng);
  const Eigen::Matrix<TestType, 3, Eigen::Dynamic> cloud = fixed;
  const auto moved_fixed = act(x, fixed);
  const auto moved_cloud = act(x, cloud);
  static_assert(decltype(moved_fixed)::ColsAtCompileTime == 7);
  REQUIRE(moved_cloud.cols() == 7);
  for (int k = 0; k < 7; ++k) {
    const Vector3<TestType> expected = x * fixed.col(k);
    CHECK(max_difference(expected, Vector3<TestType>(moved_fixed.col(k))) <= tolerance);
    CHECK(max_difference(expected, Vector3<TestType>(moved_cloud.col(k))) <= tolerance);
  }
  // Expressions, maps and clouds of no points.
  CHECK(max_difference(Matrix<TestType, 3, 7>(act(x, TestType(2) * fixed)),
                       Matrix<TestType, 3, 7>(act(x, (fixed + fixed).eval()))) == 0.0);
  CHECK(act(x, cloud.leftCols(0)).cols() == 0);
}

}  // namespace
}  // namespace antipode::test
