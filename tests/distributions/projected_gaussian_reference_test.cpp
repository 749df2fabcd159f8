// SPDX-License-Identifier: MIT
// Projected Gaussians against values computed with 35 digits (tests/data/projected_gaussian.json).
#include <cmath>
#include <numbers>

#include <antipode/distributions/detail/hemisphere_mass.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/distributions/projected_gaussian_operations.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/reference.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using PoseDensity = ProjectedGaussian<double>;
using nlohmann::json;

const json& reference() {
  static const json values = read_reference("projected_gaussian.json");
  return values;
}

PoseDensity density(const json& row, const char* q, const char* mu, const char* Sigma) {
  return PoseDensity(to_vector<4>(row.at(q)), to_vector<6>(row.at(mu)), to_matrix<6>(row.at(Sigma)));
}

/// Entries relative to the largest one.
template <class A, class B>
double error(const A& value, const B& expected) {
  return max_difference(value, expected) / (1e-300 + static_cast<double>(expected.cwiseAbs().maxCoeff()));
}

double rotation_error(const Vector4<double>& q, const Vector4<double>& expected) {
  return (q - (q.dot(expected) < 0.0 ? -1.0 : 1.0) * expected).norm();
}

void check_density(const PoseDensity& value, const json& row, const char* q, const char* mu,
                   const char* Sigma, double tolerance) {
  CHECK(rotation_error(value.tangent_point(), to_vector<4>(row.at(q))) <= tolerance);
  CHECK(error(value.mean(), to_vector<6>(row.at(mu))) <= tolerance);
  CHECK(error(value.covariance(), to_matrix<6>(row.at(Sigma))) <= tolerance);
}

}  // namespace

TEST_CASE("The mass on a hemisphere is accurate to ten digits from certain to nearly uniform",
          "[reference]") {
  for (const json& row : reference().at("normaliser")) {
    Vector3<double> m;
    Matrix3<double> Sigma;
    for (std::size_t i = 0; i < 3; ++i) {
      m[static_cast<int>(i)] = row.at("mu").at(i);
      for (std::size_t j = 0; j < 3; ++j) {
        Sigma(static_cast<int>(i), static_cast<int>(j)) = row.at("Sigma").at(i).at(j);
      }
    }
    CAPTURE(m.transpose(), Sigma);
    const double expected = row.at("C_half").get<double>();
    CHECK(std::abs(detail::hemisphere_mass<double>(m, Sigma) / expected - 1.0) <= 1e-12);
    CHECK(std::abs(detail::tilted_moments<double>(m, Sigma).hemisphere_mass / expected - 1.0) <= 1e-12);
  }
}

TEST_CASE("Second moments of the renormalised density are those of the tilted Gaussian", "[reference]") {
  for (const json& row : reference().at("tilted_moments")) {
    const auto moments =
        detail::tilted_moments<double>(Vector3<double>::Zero(), to_matrix<3>(row.at("Sigma_uu")));
    CHECK(error(moments.second_moment, to_matrix<3>(row.at("E_uuT"))) <= 1e-12);
    CHECK(moments.mean.norm() == 0.0);
  }
}

TEST_CASE("Central projection and its inverse match the reference", "[reference]") {
  for (const json& row : reference().at("projection")) {
    const Vector4<double> q0 = to_vector<4>(row.at("q0"));
    CHECK(rotation_error(detail::central_projection<double>(q0, to_vector<3>(row.at("u"))),
                         to_vector<4>(row.at("q"))) <= 1e-14);
    const auto u = detail::tangent_coordinates<double>(q0, to_vector<4>(row.at("q_in")));
    REQUIRE(u.has_value());
    CHECK(error(*u, to_vector<3>(row.at("u_back"))) <= 1e-13);
  }
}

TEST_CASE("Both densities match the reference", "[reference]") {
  for (const json& row : reference().at("density")) {
    const PoseDensity x = density(row, "q0", "mu", "Sigma");
    const auto pose = DualQuaternion<double>::from_rotation_translation(to_vector<4>(row.at("q")),
                                                                        to_vector<3>(row.at("t")));
    CHECK(error(x.coordinates(pose), to_vector<6>(row.at("tangent"))) <= 1e-12);
    CHECK(std::abs(x.log_density(pose) - row.at("log_pdf_renormalised_S3").get<double>()) <= 1e-10);
    CHECK(std::abs(PushForwardGaussian<double>(x).log_density(pose) -
                   row.at("log_pdf_pushforward_S3").get<double>()) <= 1e-10);
  }
}

TEST_CASE("A change of tangent space matches the reference", "[reference]") {
  for (const json& row : reference().at("rebase")) {
    const auto moved = density(row, "q1", "mu", "Sigma").rebased(to_vector<4>(row.at("q3")));
    check_density(moved, row, "q3", "mu3", "Sigma3", 1e-11);
    const detail::ChartChange<double> f(to_vector<4>(row.at("q1")), to_vector<4>(row.at("q3")));
    const Vector3<double> u = to_vector<6>(row.at("mu")).head<3>();
    CHECK(error(f.jacobian(u), to_matrix<3>(row.at("J_rot"))) <= 1e-11);
  }
}

TEST_CASE("Centring at the mode matches the reference", "[reference]") {
  for (const json& row : reference().at("pg0")) {
    const auto centered = density(row, "q", "mu", "Sigma").centered();
    check_density(centered, row, "q4", "mu4", "Sigma4", 1e-11);
    CHECK(centered.is_centered());
  }
}

TEST_CASE("Fusion and the mass of the product match the reference", "[reference]") {
  for (const json& row : reference().at("fuse")) {
    const auto a = density(row, "q1", "mu1", "Sigma1"), b = density(row, "q2", "mu2", "Sigma2");
    const auto fused = fuse(a, b);
    check_density(fused.density, row, "q4", "mu4", "Sigma4", 1e-10);
    CHECK(std::abs(std::log(fused.density.hemisphere_mass()) - row.at("logC_half_4").get<double>()) <= 1e-10);
    const double log_mass = row.at("log_c12").get<double>() + row.at("logC_half_3").get<double>() -
                            row.at("logC_half_31").get<double>() - row.at("logC_half_32").get<double>() -
                            std::numbers::ln2;
    CHECK(std::abs(fused.log_mass - log_mass) <= 1e-10);
  }
}

TEST_CASE("Composition matches the reference", "[reference]") {
  for (const json& row : reference().at("compose")) {
    const auto a = density(row, "q2", "mu2", "Sigma2"), b = density(row, "q1", "mu1", "Sigma1");
    // The reference stays in the tangent space of q2 q1; linearisations of one map at one point agree.
    check_density(compose(a, b).rebased(to_vector<4>(row.at("q3"))), row, "q3", "mu3", "Sigma3", 1e-11);
  }
}
