// SPDX-License-Identifier: MIT
// Projection, back-projection and update of landmarks against reference values.
#include <cmath>
#include <string>

#include <antipode/detail/cholesky.hpp>
#include <antipode/filters/unscented_update.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/reference.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using PoseModel = AnyPairModel<double>;

/// Agreement with values of 17 digits, relative to the largest entry.
template <int Cols>
void check_reference(const Matrix<double, 3, Cols>& value, const Matrix<double, 3, Cols>& reference) {
  CHECK(max_difference(value, reference) <=
        1e-9 * max_difference(reference, Matrix<double, 3, Cols>::Zero()));
}

/// Agreement of an update with all its reference values.
template <class Update>
void check_reference_update(const Update& update, const nlohmann::json& entry) {
  const Vector3<double> z = to_vector<3>(entry.at("z"));
  CHECK((z - update.innovation - to_vector<3>(entry.at("zhat"))).norm() <= 1e-9 * z.norm());
  check_reference(update.innovation_covariance, to_matrix<3>(entry.at("S")));
  check_reference(update.cross_covariance, to_matrix<3>(entry.at("S_lz")));
  check_reference(update.gain, to_matrix<3>(entry.at("K")));
  check_reference(update.posterior.mean(), to_vector<3>(entry.at("l_new")));
  check_reference(update.posterior.covariance(), to_matrix<3>(entry.at("P_new")));
}

/// The cases of a kind, of which there must be so many.
[[nodiscard]] nlohmann::json cases(const std::string& kind, std::size_t count) {
  auto result = read_reference("landmark_update.json").at(kind);
  REQUIRE(result.size() == count);
  return result;
}
[[nodiscard]] StereoModel<double> camera_of(const nlohmann::json& entry) {
  const auto& camera = entry.at("camera");
  return {camera.at("fx"), camera.at("fy"), camera.at("cx"), camera.at("cy"), camera.at("b")};
}
[[nodiscard]] Pose pose_of(const nlohmann::json& entry) {
  return Pose::from_rotation_translation(to_vector<4>(entry.at("q")), to_vector<3>(entry.at("t")));
}
[[nodiscard]] Gaussian<double, 3> landmark_of(const nlohmann::json& entry) {
  return {to_vector<3>(entry.at("l")), to_matrix<3>(entry.at("P"))};
}

/// Distance of the means in standard deviations of the truth, and of the covariances as a geometric mean
/// ratio.
struct LandmarkScore {
  double error;
  double variance_ratio;

  LandmarkScore(const Gaussian<double, 3>& estimate, const nlohmann::json& truth) {
    const Matrix3<double> L = detail::cholesky_factor(to_matrix<3>(truth.at("P"))).value();
    const Vector3<double> e = estimate.mean() - to_vector<3>(truth.at("l_mean"));
    error = detail::solve_lower(L, e).norm();
    const Matrix3<double>& F = estimate.sqrt_factor();
    variance_ratio = std::pow(F(0, 0) * F(1, 1) * F(2, 2) / (L(0, 0) * L(1, 1) * L(2, 2)), 2.0 / 3.0);
  }
};

}  // namespace

TEST_CASE("The camera of these tests is that of the reference values", "[unscented][reference]") {
  for (const auto& entry : cases("projection", 8)) {
    const StereoModel<double> camera = camera_of(entry);
    const auto z = camera(pose_of(entry), to_vector<3>(entry.at("l")));
    REQUIRE(z.has_value());
    check_reference(*z, to_vector<3>(entry.at("z")));
    check_reference(camera.back_project(pose_of(entry), *z), to_vector<3>(entry.at("l_back")));
  }
}

TEST_CASE("A measurement back-projects with its covariance", "[unscented][reference]") {
  for (const auto& entry : cases("init", 8)) {
    const StereoModel<double> camera = camera_of(entry);
    const PoseModel back_project = [&](const Pose& x, const Vector3<double>& z) {
      return camera.back_project(x, z);
    };
    const Gaussian<double, 3> measured(to_vector<3>(entry.at("z")), to_matrix<3>(entry.at("R")));
    const auto landmark = project_gaussian(measured, pose_of(entry), back_project, entry.at("kappa"));
    REQUIRE(landmark.has_value());
    check_reference(landmark->mean, to_vector<3>(entry.at("l_ut")));
    check_reference(landmark->covariance, to_matrix<3>(entry.at("P_ut")));
  }
}

TEST_CASE("A landmark projects with its covariance", "[unscented][reference]") {
  for (const auto& entry : cases("alg3", 16)) {
    const PoseModel h = camera_of(entry);
    const auto projected = project_gaussian(landmark_of(entry), pose_of(entry), h, entry.at("kappa"));
    REQUIRE(projected.has_value());
    check_reference(projected->mean, to_vector<3>(entry.at("zhat")));
    check_reference(projected->covariance, to_matrix<3>(entry.at("Sigma_zhat")));
    check_reference<3>(projected->covariance + to_matrix<3>(entry.at("R")), to_matrix<3>(entry.at("S")));
  }
}

TEST_CASE("One iteration at a known pose is the unscented Kalman filter", "[unscented][reference]") {
  for (const auto& entry : cases("alg4_fixed_pose", 16)) {
    const PoseModel h = camera_of(entry);
    const Vector3<double> z = to_vector<3>(entry.at("z"));
    const auto result =
        unscented_update(landmark_of(entry), pose_of(entry), h, {z, to_matrix<3>(entry.at("R"))},
                         {.kappa = entry.at("kappa"), .iterations = 1});
    CHECK(result.status == UnscentedUpdateStatus::kUpdated);
    CHECK(result.iterations == 1);
    check_reference_update(result, entry);
    const Matrix3<double> S_root = detail::cholesky_factor(to_matrix<3>(entry.at("S"))).value();
    CHECK(result.nis == Approx(detail::solve_lower(S_root, result.innovation).squaredNorm()).epsilon(1e-9));
  }
}

TEST_CASE("One iteration with samples of the pose takes all pairs", "[unscented][reference]") {
  for (const auto& entry : cases("alg4_uncertain_pose", 8)) {
    const PoseModel h = camera_of(entry);
    const auto density = BinghamGaussian<double>::independent(
        Bingham<double, 4>::from_parameters(to_matrix<4>(entry.at("M")), to_vector<4>(entry.at("z4"))),
        to_vector<3>(entry.at("mu_t")), to_matrix<3>(entry.at("Sigma_t")));
    const PaperPoseRule rule{BinghamBaseRule{.lambda = entry.at("lam")},
                             UnscentedRule<3>{.kappa = entry.at("kappa_t")}};
    const auto poses = sample(rule, density);
    const Vector3<double> z = to_vector<3>(entry.at("z"));
    const auto update = [&](int iterations) {
      return unscented_update(landmark_of(entry), poses, h, {z, to_matrix<3>(entry.at("R"))},
                              {.kappa = entry.at("kappa_l"), .iterations = iterations});
    };
    const auto result = update(1);
    check_reference_update(result, entry);
    // The true posterior is itself known to 0.0074 sigma.
    const LandmarkScore iterated(update(2).posterior, entry.at("truth"));
    CHECK(iterated.error <= 0.2);
    CHECK(std::abs(iterated.variance_ratio - 1.0) <= 0.035);
    // Gating sees the pose's uncertainty.
    const auto gate = project_gaussian(landmark_of(entry), poses, h, entry.at("kappa_l"));
    REQUIRE(gate.has_value());
    check_reference<3>(gate->covariance + to_matrix<3>(entry.at("R")), to_matrix<3>(entry.at("S")));
  }
}

TEST_CASE("A second iteration reaches the true posterior of a wide prior", "[unscented][reference]") {
  for (const auto& entry : cases("alg4_fixed_pose", 16)) {
    const PoseModel h = camera_of(entry);
    const auto score = [&](int iterations) {
      const auto result = unscented_update(landmark_of(entry), pose_of(entry), h,
                                           {to_vector<3>(entry.at("z")), to_matrix<3>(entry.at("R"))},
                                           {.kappa = entry.at("kappa"), .iterations = iterations});
      CHECK(result.iterations == iterations);
      return LandmarkScore(result.posterior, entry.at("truth"));
    };
    CHECK(score(2).error <= score(1).error);
    CHECK(score(2).error <= 0.21);
    CHECK(std::abs(score(2).variance_ratio - 1.0) <= 0.01);
    CHECK(score(3).error <= 0.21);
    CHECK(std::abs(score(3).variance_ratio - 1.0) <= 0.035);
  }
}

TEST_CASE("A landmark in inverse depth projects like the point it stands for", "[unscented][reference]") {
  const auto file = read_reference("landmark_update.json");
  for (std::size_t i = 0; i < file.at("inverse_depth").size(); ++i) {
    const auto& entry = file.at("inverse_depth").at(i);
    const auto& projection = file.at("projection").at(i);
    const StereoModel<double> camera = camera_of(projection);
    const Vector3<double> anchor = to_vector<3>(entry.at("anchor"));
    const PoseModel h = [&](const Pose& x, const Vector3<double>& y) {
      const double theta = y[0], phi = y[1], rho = y[2];
      const Vector3<double> ray(std::cos(phi) * std::sin(theta), -std::sin(phi),
                                std::cos(phi) * std::cos(theta));
      return camera(x, anchor + ray / rho);
    };
    const Vector3<double> mean(entry.at("theta").get<double>(), entry.at("phi").get<double>(),
                               entry.at("rho").get<double>());
    const Gaussian<double, 3> y(mean, Matrix3<double>::Zero());
    const auto direct = camera(pose_of(projection), to_vector<3>(entry.at("l")));
    const auto projected = project_gaussian(y, pose_of(projection), h);
    REQUIRE(direct.has_value() == projected.has_value());
    if (direct) check_reference(projected->mean, *direct);
  }
}
