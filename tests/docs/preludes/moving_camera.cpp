// SPDX-License-Identifier: MIT
// What README's block needs, around it, and whether its estimates are as good as they claim.
#include <cmath>
#include <cstdint>
#include <iostream>
#include <random>
#include <sstream>
#include <streambuf>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "moving_camera.includes.hpp"
#include "support/catch.hpp"

namespace {

using antipode::DualQuaternion;
using antipode::Matrix6;
using antipode::PoseGaussian;
using antipode::Vector3;
using antipode::Vector6;

constexpr int kFrames = 60;
constexpr int kLandmarks = 60;

/// Pixels of a stereo pair: column and row in the left image, and disparity.
Vector3<double> project(const Vector3<double>& p_camera) {
  constexpr double kFocal_px = 700.0, kBaseline_m = 0.5;
  return Vector3<double>(p_camera[0], p_camera[1], kBaseline_m) * (kFocal_px / p_camera[2]);
}

struct Frame {
  DualQuaternion<double> T_before_now;
  std::vector<std::pair<Vector3<double>, Vector3<double>>>
      matches;  ///< landmark in the world, and its pixels
};

/// A camera that drives one metre a frame in a gentle turn, among landmarks that it knows.
struct Drive {
  PoseGaussian<double> start;
  Matrix6<double> Q = Matrix6<double>::Zero();
  double variance = 1.0;  ///< of a pixel
  std::vector<Frame> frames;
  DualQuaternion<double> last_T_world_camera;
};

Drive drive_of(std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&](double rotation_rad, double translation_m) {
    Vector6<double> xi;
    for (int i = 0; i < 6; ++i) xi[i] = (i < 3 ? rotation_rad : translation_m) * normal(rng);
    return xi;
  };
  const auto diagonal = [](double rotation_rad, double translation_m) {
    Vector6<double> variances;
    variances << Vector3<double>::Constant(rotation_rad * rotation_rad),
        Vector3<double>::Constant(translation_m * translation_m);
    return Matrix6<double>(variances.asDiagonal());
  };

  Drive drive;
  DualQuaternion<double> T_world_camera;
  drive.start = {T_world_camera.boxplus(draw(0.01, 0.1)), diagonal(0.01, 0.1)};
  drive.Q = diagonal(0.002, 0.02);
  Vector6<double> step;
  step << 0.0, 0.02, 0.0, 0.0, 0.0, 1.0;
  for (int k = 0; k < kFrames; ++k) {
    T_world_camera = T_world_camera * DualQuaternion<double>::exp(step);
    Frame frame{DualQuaternion<double>::exp(step).boxplus(draw(0.002, 0.02)), {}};
    std::uniform_real_distribution<double> sideways(-8.0, 8.0), ahead(8.0, 30.0);
    for (int i = 0; i < kLandmarks; ++i) {
      const Vector3<double> p_camera(sideways(rng), 0.3 * sideways(rng), ahead(rng));
      const Vector3<double> noise(normal(rng), normal(rng), normal(rng));
      frame.matches.emplace_back(T_world_camera * p_camera, project(p_camera) + noise);
    }
    drive.frames.push_back(std::move(frame));
  }
  drive.last_T_world_camera = T_world_camera;
  return drive;
}

/// A chi-square quantile by Wilson and Hilferty; accurate to a per cent at a hundred degrees of freedom.
double chi_square_quantile(double dof, double normal_quantile) {
  const double c = 2.0 / (9.0 * dof);
  return dof * std::pow(1.0 - c + normal_quantile * std::sqrt(c), 3);
}

/// Runs README's block; what it printed goes to `printed`.
PoseGaussian<double> run_block(const Drive& drive, std::ostream& printed) {
  const auto& start = drive.start;
  const auto& Q = drive.Q;
  const auto& variance = drive.variance;
  const auto& frames = drive.frames;
  std::streambuf* const console = std::cout.rdbuf(printed.rdbuf());
#include "moving_camera.inc"
  std::cout.rdbuf(console);
  return filter.belief();
}

TEST_CASE("The filter of the README follows a moving camera within its covariance", "[docs]") {
  constexpr int kSeeds = 20;
  double nees_sum = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    CAPTURE(seed);
    const Drive drive = drive_of(seed);
    std::stringstream printed;
    const PoseGaussian<double> belief = run_block(drive, printed);

    int poses = 0;
    for (std::string line; std::getline(printed, line);) poses += line.starts_with("{q: ");
    CHECK(poses == kFrames);  // every update converged

    const Vector6<double> error = drive.last_T_world_camera.boxminus(belief.pose);
    CHECK(belief.covariance.diagonal().tail<3>().maxCoeff() < 0.05 * 0.05);
    nees_sum += error.dot(belief.covariance.ldlt().solve(error));
  }
  constexpr double kNormalQuantile99 = 2.576;
  const double dof = 6.0 * kSeeds;
  CHECK(nees_sum > chi_square_quantile(dof, -kNormalQuantile99));
  CHECK(nees_sum < chi_square_quantile(dof, kNormalQuantile99));
}

}  // namespace
