// SPDX-License-Identifier: MIT
#include <numbers>

#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/interpolation.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/reference.hpp"

// Every row of tests/data/dual_quaternion.json: computed with mpmath at 35 to 45 digits, independently of
// this library. The 8-vectors of the file are unit to 1e-16 and of either sign.

namespace antipode::test {
namespace {

using Pose = DualQuaternion<double>;
constexpr double kTolerance = 1e-12;

const nlohmann::json& rows(const std::string& group) {
  static const nlohmann::json file = read_reference("dual_quaternion.json");
  return file.at(group);
}

Pose pose(const nlohmann::json& list) { return Pose::unchecked(to_vector<8>(list)); }

/// The largest difference relative to the largest number.
template <class A, class B>
double relative_difference(const A& a, const B& b) {
  return max_difference(a, b) / std::max(1.0, b.cwiseAbs().maxCoeff());
}

TEST_CASE("Composition agrees with the reference", "[dual_quaternion][reference]") {
  for (const auto& row : rows("compose")) {
    const Pose xy = pose(row["x"]) * pose(row["y"]);
    CHECK(xy.is_approx(pose(row["xy"]), kTolerance));
    CHECK(relative_difference(xy.translation(), to_vector<3>(row["translation"])) <= kTolerance);
  }
}

TEST_CASE("The inverse agrees with the reference", "[dual_quaternion][reference]") {
  for (const auto& row : rows("inverse")) {
    const Pose inverse = pose(row["x"]).inverse();
    CHECK(inverse.is_approx(pose(row["inv"]), kTolerance));
    CHECK(relative_difference(inverse.translation(), to_vector<3>(row["translation"])) <= kTolerance);
  }
}

TEST_CASE("Moved points agree with the reference", "[dual_quaternion][reference]") {
  for (const auto& row : rows("point")) {
    CHECK(relative_difference(pose(row["x"]) * to_vector<3>(row["p"]), to_vector<3>(row["xp"])) <=
          kTolerance);
  }
}

TEST_CASE("The adjoint agrees with the reference", "[dual_quaternion][reference]") {
  for (const auto& row : rows("adjoint")) {
    const Matrix6<double> Ad = pose(row["x"]).adjoint();
    CHECK(relative_difference(Ad, to_matrix<6>(row["Ad"])) <= kTolerance);
    CHECK(relative_difference(Ad * to_vector<6>(row["xi"]), to_vector<6>(row["Ad_xi"])) <= kTolerance);
  }
}

TEST_CASE("The three conjugates agree with the reference", "[dual_quaternion][reference]") {
  for (const auto& row : rows("conjugates")) {
    const Pose x = pose(row["x"]);
    CHECK(x.quaternion_conjugate().coeffs() == to_vector<8>(row["quat"]));
    CHECK(x.dual_conjugate().coeffs() == to_vector<8>(row["dual"]));
    CHECK(x.total_conjugate().coeffs() == to_vector<8>(row["total"]));
  }
}

TEST_CASE("Renormalisation agrees with the reference", "[dual_quaternion][reference]") {
  for (const auto& row : rows("renormalise")) {
    CHECK(pose(row["y"]).renormalized().is_approx(pose(row["x"]), kTolerance));
  }
}

TEST_CASE("exp agrees with the reference from 0 to pi", "[dual_quaternion][reference]") {
  for (const auto& row : rows("exp")) {
    Vector6<double> xi;
    xi << to_vector<3>(row["phi"]), to_vector<3>(row["rho"]);
    CAPTURE(xi.transpose());
    CHECK(Pose::exp(xi).is_approx(pose(row["x"]), kTolerance));
    CHECK(relative_difference(Pose::exp(xi).translation(), to_vector<3>(row["translation"])) <= kTolerance);
  }
}

TEST_CASE("log agrees with the reference from 0 to pi", "[dual_quaternion][reference]") {
  for (const auto& row : rows("log")) {
    Vector6<double> xi;
    xi << to_vector<3>(row["phi"]), to_vector<3>(row["rho"]);
    const double to_pi = std::numbers::pi - xi.head<3>().norm();
    CAPTURE(xi.transpose(), to_pi);
    // Near pi the rounding of the input alone turns the axis: 1e-9 there.
    CHECK(relative_difference(pose(row["x"]).log(), xi) <= (to_pi < 1e-3 ? 1e-9 : kTolerance));
  }
}

TEST_CASE("ScLERP agrees with the reference", "[interpolation][reference]") {
  for (const auto& row : rows("sclerp")) {
    const Pose z = sclerp(pose(row["x"]), pose(row["y"]), row["tau"].get<double>());
    CAPTURE(row.dump());
    CHECK(z.is_approx(pose(row["z"]), kTolerance));
    CHECK(relative_difference(z.translation(), to_vector<3>(row["translation"])) <= kTolerance);
  }
}

}  // namespace
}  // namespace antipode::test
