// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/LU>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>

#include "filters/models.hpp"
#include "support/reference.hpp"

/// Posteriors known by quadrature (tests/data/progressive_update.json), and how far a filter is from them.
namespace antipode::test {

/// Moments of the true posterior.
struct TruePosterior {
  Matrix4<double> scatter;
  Vector3<double> mean_translation;
  Matrix3<double> translation_covariance;
  double log_evidence;
};

/// Errors of the mean in standard deviations of the truth, and geometric means of the variances over the true
/// ones.
struct Score {
  double rotation_error;
  double translation_error;
  double rotation_variance_ratio;
  double translation_variance_ratio;
};

struct ProgressiveCase {
  std::string name;
  bool weak_prior;  ///< about 25 degrees
  BinghamGaussian<double> prior;
  AnyLogLikelihood<double> log_likelihood;
  TruePosterior truth;
  nlohmann::json other_implementation;  ///< scores and steps of an independent implementation, by variant

  [[nodiscard]] Score score(const BinghamGaussian<double>& posterior) const {
    const auto eigen = detail::symmetric_eigen<double, 4>(truth.scatter);
    const Vector3<double> omega = eigen.values.head<3>();
    const Vector3<double> rotation = (eigen.vectors.transpose() * posterior.orientation().mode()).head<3>();
    const Vector3<double> translation = posterior.mean_translation() - truth.mean_translation;
    const Vector3<double> ratios = posterior.orientation().second_moments().head<3>().cwiseQuotient(omega);
    return {std::sqrt(rotation.cwiseAbs2().cwiseQuotient(omega).sum()),
            detail::solve_lower(*detail::cholesky_factor(truth.translation_covariance), translation).norm(),
            std::cbrt(ratios.prod()),
            std::cbrt(posterior.translation_covariance().determinant() /
                      truth.translation_covariance.determinant())};
  }
};

[[nodiscard]] inline std::vector<Vector3<double>> to_points(const nlohmann::json& rows) {
  std::vector<Vector3<double>> points;
  for (const auto& row : rows) points.push_back(to_vector<3>(row));
  return points;
}

/// l = q^T C q - (H t - y)^T R^-1 (H t - y)/2.
[[nodiscard]] inline AnyLogLikelihood<double> exact_product_likelihood(const nlohmann::json& parameters) {
  const Matrix4<double> C = to_matrix<4>(parameters.at("Cq"));
  const Matrix3<double> H = to_matrix<3>(parameters.at("H"));
  const Matrix3<double> information = to_matrix<3>(parameters.at("R")).inverse();
  const Vector3<double> y = to_vector<3>(parameters.at("y"));
  return [=](const DualQuaternion<double>& x) {
    const Vector3<double> error = H * x.translation() - y;
    return x.rotation().dot(C * x.rotation()) - 0.5 * error.dot(information * error);
  };
}

/// l = -sum_j |x^-1 l_j - y_j|^2/2 in the norm of R_j^-1.
[[nodiscard]] inline AnyLogLikelihood<double> point_likelihood(const nlohmann::json& parameters) {
  const auto landmarks = to_points(parameters.at("landmarks"));
  const auto y = to_points(parameters.at("y"));
  std::vector<Matrix3<double>> information;
  for (const auto& R : parameters.at("R")) information.push_back(to_matrix<3>(R).inverse());
  return [=](const DualQuaternion<double>& x) {
    double sum = 0.0;
    for (std::size_t j = 0; j < landmarks.size(); ++j) {
      const Vector3<double> error = x.inverse() * landmarks[j] - y[j];
      sum -= 0.5 * error.dot(information[j] * error);
    }
    return sum;
  };
}

/// The same with a stereo camera; all measurements have the same, diagonal R. A landmark behind the camera
/// costs 100.
[[nodiscard]] inline AnyLogLikelihood<double> stereo_likelihood(const nlohmann::json& parameters) {
  const auto& camera = parameters.at("camera");
  StereoScene<double> scene;
  scene.camera = {camera.at("fx"), camera.at("fy"), camera.at("cx"), camera.at("cy"), camera.at("b")};
  scene.landmarks = to_points(parameters.at("landmarks"));
  scene.measurements = to_points(parameters.at("z"));
  scene.sigma = to_matrix<3>(parameters.at("R")).diagonal().cwiseSqrt();
  scene.behind = -100.0;
  return scene;
}

[[nodiscard]] inline std::vector<ProgressiveCase> progressive_cases() {
  const auto file = read_reference("progressive_update.json");
  std::vector<ProgressiveCase> cases;
  if (file.at("cases").size() != 9) throw std::runtime_error("expected 9 cases in progressive_update.json");
  for (const auto& entry : file.at("cases")) {
    const std::string type = entry.at("type");
    const auto& prior = entry.at("prior");
    const auto& parameters = entry.at("likelihood");
    const auto& truth = entry.at("truth");
    const auto orientation =
        Bingham<double, 4>::from_parameters(to_matrix<4>(prior.at("M")), to_vector<4>(prior.at("z")));
    cases.push_back({.name = type + " " + std::to_string(cases.size()),
                     .weak_prior = orientation.second_moments()[2] > 0.04,
                     .prior = BinghamGaussian<double>::independent(orientation, to_vector<3>(prior.at("mu")),
                                                                   to_matrix<3>(prior.at("Sigma"))),
                     .log_likelihood = type == "exact_product"     ? exact_product_likelihood(parameters)
                                       : type == "point_landmarks" ? point_likelihood(parameters)
                                                                   : stereo_likelihood(parameters),
                     .truth = {to_matrix<4>(truth.at("scatter")), to_vector<3>(truth.at("t_mean")),
                               to_matrix<3>(truth.at("t_cov")), truth.at("log_evidence")},
                     .other_implementation = entry.at("prototype_scores")});
  }
  return cases;
}

}  // namespace antipode::test
