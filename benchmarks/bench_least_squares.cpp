// SPDX-License-Identifier: MIT
// A pose by known landmarks of which some are outliers: robust_least_squares beside Ceres on the same problem
// (the same loss, analytic derivatives, a dense solver, the covariance too), and beside gauss_newton_update,
// which takes no outliers. Inputs vary over 16 random scenes.
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <ceres/ceres.h>

#include <antipode/ceres/pose_manifold.hpp>
#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/robust_least_squares.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"

namespace antipode::test {
namespace {

using Catch::Benchmark::Chronometer;
using Pose = DualQuaternion<double>;
using Poses = ScrewChart<double>;

constexpr std::size_t kScenes = 16;
constexpr std::size_t at(int i) { return static_cast<std::size_t>(i) % kScenes; }
constexpr CauchyLoss<double> kLoss{};
constexpr LeastSquaresOptions<double> kOptions{.check_modes = false};

/// A scene with a pose near the truth, one landmark in ten of which is measured anywhere.
struct OutlierScene {
  PoseGaussian<double> prior;
  StereoScene<double> scene;
  StereoWithJacobian h;
  std::vector<NoisyMeasurement<double, 3>> measurements;
  Matrix3<double> S_inverse;

  OutlierScene(std::size_t seed, int landmarks) {
    Rng rng(seed);
    prior = prior_at_random_pose(rng, 0.01, 0.1);
    const Pose truth = draw(rng, prior);
    scene = StereoScene<double>::random(rng, truth, landmarks);
    const auto elsewhere = StereoScene<double>::random(rng, truth, landmarks);
    for (std::size_t i = 0; i < scene.measurements.size(); i += 10) {
      scene.measurements[i] = elsewhere.measurements[i];
    }
    h = {scene.camera, scene.landmarks};
    measurements = measurements_of(scene);
    S_inverse = scene.sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  }

  template <int Considered>
  [[nodiscard]] double estimate() const {
    const auto model = [this](const Pose& x, auto& sums) {
      Matrix<double, 3, 6> J;
      for (std::size_t i = 0; i < measurements.size(); ++i) {
        const auto z = h(x, i, J);
        if (!z) {
          sums.miss(3);
        } else if constexpr (Considered == 0) {
          sums.add(Vector3<double>(measurements[i].z - *z), S_inverse, J);
        } else {
          const auto K = Matrix<double, 3, Considered>::Constant(0.01 * static_cast<double>(i % 7));
          sums.add(Vector3<double>(measurements[i].z - *z), S_inverse, J, Matrix<double, 3, Considered>(K));
        }
      }
    };
    return robust_least_squares<Poses, Considered>(prior.pose, model, kLoss, kOptions).covariance.trace();
  }
};

/// The whitened residual of a landmark, with its derivative by the eight numbers of a pose: that by the right
/// perturbation, times the inverse of the manifold's plus_jacobian.
class LandmarkCost : public ceres::SizedCostFunction<3, 8> {
 public:
  LandmarkCost(const OutlierScene& problem, std::size_t index) : problem_(&problem), index_(index) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Vector8<double>> coefficients(parameters[0]);
    const Pose x = Pose::unchecked(coefficients);
    Matrix<double, 3, 6> J;
    const auto z = problem_->h(x, index_, J);
    if (!z) return false;
    const Vector3<double> inverse_sigma = problem_->scene.sigma.cwiseInverse();
    Eigen::Map<Vector3<double>>(residuals, 3) =
        inverse_sigma.cwiseProduct(*z - problem_->measurements[index_].z);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Matrix<double, 6, 8, Eigen::RowMajor> by_coefficients;
    PoseManifold{}.MinusJacobian(parameters[0], by_coefficients.data());
    Eigen::Map<Eigen::Matrix<double, 3, 8, Eigen::RowMajor>> result(jacobians[0]);
    result = inverse_sigma.asDiagonal() * J * by_coefficients;
    return true;
  }

 private:
  const OutlierScene* problem_;
  std::size_t index_;
};

[[nodiscard]] double estimate_with_ceres(const OutlierScene& scene) {
  Vector8<double> x = scene.prior.pose.coeffs();
  ceres::Problem problem;
  problem.AddParameterBlock(x.data(), 8, new PoseManifold);
  for (std::size_t i = 0; i < scene.measurements.size(); ++i)
    problem.AddResidualBlock(new LandmarkCost(scene, i), new ceres::CauchyLoss(kLoss.scale), x.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  ceres::Covariance::Options dense;
  dense.algorithm_type = ceres::DENSE_SVD;
  dense.num_threads = 1;
  ceres::Covariance covariance(dense);
  const std::vector<std::pair<const double*, const double*>> blocks{{x.data(), x.data()}};
  if (!covariance.Compute(blocks, &problem)) return 0.0;
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> P;
  covariance.GetCovarianceBlockInTangentSpace(x.data(), x.data(), P.data());
  return P.trace();
}

}  // namespace

TEST_CASE("A pose by landmarks with outliers", "[benchmark][least-squares]") {
  for (const int landmarks : {30, 300}) {
    std::vector<OutlierScene> scenes;
    for (std::size_t k = 0; k < kScenes; ++k) scenes.emplace_back(k, landmarks);
    const std::string with = " with " + std::to_string(landmarks) + " landmarks";
    BENCHMARK_ADVANCED("robust_least_squares" + with)(Chronometer meter) {
      meter.measure([&](int i) { return scenes[at(i)].estimate<0>(); });
    };
    BENCHMARK_ADVANCED("robust_least_squares, 12 considered parameters" + with)(Chronometer meter) {
      meter.measure([&](int i) { return scenes[at(i)].estimate<12>(); });
    };
    BENCHMARK_ADVANCED("gauss_newton_update" + with)(Chronometer meter) {
      meter.measure([&](int i) {
        const auto& scene = scenes[at(i)];
        return gauss_newton_update(scene.prior, scene.measurements, scene.h, {.check_modes = false}).nis;
      });
    };
    BENCHMARK_ADVANCED("Ceres" + with)(Chronometer meter) {
      meter.measure([&](int i) { return estimate_with_ceres(scenes[at(i)]); });
    };
  }
}

}  // namespace antipode::test
