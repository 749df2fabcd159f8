// SPDX-License-Identifier: MIT
// The filters on the stereo camera of KITTI, beside what a hand-written filter would do: for a pose,
// Gauss-Newton with analytic Jacobians; for a landmark, the extended Kalman filter. Inputs vary over 16
// random scenes.
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Cholesky>

#include <antipode/filters/predict.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/unscented_update.hpp>
#include <antipode/geometry/quaternion.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"

namespace antipode::test {
namespace {

using Catch::Benchmark::Chronometer;
using Pose = DualQuaternion<double>;

constexpr std::size_t kScenes = 16;
constexpr std::size_t at(int i) { return static_cast<std::size_t>(i) % kScenes; }

/// The likelihood of a StereoScene for all poses at once: landmark by landmark, the poses side by side in
/// registers.
struct BatchedStereo {
  StereoScene<double> scene;

  template <int Count>
  void operator()(const Matrix<double, 8, Count>& poses, Vector<double, Count>& values) const {
    using Lane = Eigen::Array<double, Count, 1>;
    std::array<std::array<Lane, 4>, 3> T;  // T_camera_world, row by row
    for (int k = 0; k < Count; ++k) {
      const Pose T_camera_world = Pose::unchecked(poses.col(k)).inverse();
      const Matrix3<double> R = T_camera_world.rotation_matrix();
      const Vector3<double> t = T_camera_world.translation();
      for (std::size_t i = 0; i < 3; ++i) {
        const int row = static_cast<int>(i);
        for (std::size_t j = 0; j < 3; ++j) T[i][j][k] = R(row, static_cast<int>(j));
        T[i][3][k] = t[row];
      }
    }
    const auto& camera = scene.camera;
    const Vector3<double> inverse_sigma = scene.sigma.cwiseInverse();
    Lane sum = Lane::Zero();
    for (std::size_t l = 0; l < scene.landmarks.size(); ++l) {
      const Vector3<double>& p = scene.landmarks[l];
      const Vector3<double>& z = scene.measurements[l];
      const auto coordinate = [&](std::size_t i) -> Lane {
        return T[i][0] * p[0] + T[i][1] * p[1] + T[i][2] * p[2] + T[i][3];
      };
      const Lane depth = coordinate(2);
      const Lane inverse_depth = depth.max(0.1).inverse();
      const Lane u = (camera.fx * coordinate(0) * inverse_depth + (camera.cx - z[0])) * inverse_sigma[0];
      const Lane v = (camera.fy * coordinate(1) * inverse_depth + (camera.cy - z[1])) * inverse_sigma[1];
      const Lane d = (camera.fx * camera.baseline * inverse_depth - z[2]) * inverse_sigma[2];
      sum += (depth < 0.1).select(Lane::Constant(100.0), 0.5 * (u.square() + v.square() + d.square()));
    }
    values = -sum;
  }
};

/// d z / d xi of a point seen from x exp(xi), and the point in the camera.
struct Linearized {
  Vector3<double> z;
  Matrix3<double> J_point;
  Matrix<double, 3, 6> J_pose;

  Linearized(const StereoModel<double>& camera, const Pose& T_camera_world, const Vector3<double>& p_world) {
    const Vector3<double> p = T_camera_world * p_world;
    const double iz = 1.0 / p[2];
    z << camera.fx * p[0] * iz + camera.cx, camera.fy * p[1] * iz + camera.cy,
        camera.fx * camera.baseline * iz;
    J_point << camera.fx * iz, 0.0, -camera.fx * p[0] * iz * iz,  //
        0.0, camera.fy * iz, -camera.fy * p[1] * iz * iz,         //
        0.0, 0.0, -camera.fx * camera.baseline * iz * iz;
    J_pose << J_point * skew(p), -J_point;
  }
};

/// Maximum of the posterior by Gauss-Newton, with its covariance.
[[nodiscard]] PoseGaussian<double> gauss_newton(const PoseGaussian<double>& prior,
                                                const StereoScene<double>& scene, int iterations) {
  const Matrix6<double> information = prior.covariance.inverse();
  const Vector3<double> weights = scene.sigma.cwiseAbs2().cwiseInverse();
  Pose x = prior.pose;
  Matrix6<double> H;
  for (int i = 0; i < iterations; ++i) {
    H = information;
    Vector6<double> g = information * prior.pose.boxminus(x);
    const Pose T_camera_world = x.inverse();
    for (std::size_t l = 0; l < scene.landmarks.size(); ++l) {
      const Linearized h(scene.camera, T_camera_world, scene.landmarks[l]);
      const Matrix<double, 6, 3> J_weighted = h.J_pose.transpose() * weights.asDiagonal();
      H += J_weighted * h.J_pose;
      g += J_weighted * (scene.measurements[l] - h.z);
    }
    x = x.boxplus(H.llt().solve(g));
  }
  return {x, H.inverse()};
}

/// Scenes with a prior of 0.6 degrees and 10 cm around the truth.
struct Scenes {
  std::array<PoseGaussian<double>, kScenes> priors;
  std::vector<BinghamGaussian<double>> densities;
  std::array<BatchedStereo, kScenes> likelihoods;

  explicit Scenes(int landmarks) {
    for (std::size_t k = 0; k < kScenes; ++k) {
      Rng rng(k);
      priors[k] = {random_pose<double>(rng), pose_covariance<double>(0.01, 0.1)};
      densities.push_back(to_bingham_gaussian(priors[k]));
      likelihoods[k].scene = StereoScene<double>::random(rng, draw(rng, priors[k]), landmarks);
    }
  }
};

TEST_CASE("Prediction", "[benchmark][filters]") {
  const Scenes in(1);
  const auto motion = Pose::exp(Vector6<double>(0.0, 0.02, 0.0, 0.0, 0.0, 1.0));
  const PoseGaussian<double> noise{{}, pose_covariance<double>(0.001, 0.02)};
  const auto noise_density = to_bingham_gaussian(noise);
  BENCHMARK_ADVANCED("predict: closed form")(Chronometer meter) {
    meter.measure([&](int i) { return predict_closed_form(in.priors[at(i)], motion, noise); });
  };
  BENCHMARK_ADVANCED("predict: 49 x 49 pairs")(Chronometer meter) {
    meter.measure(
        [&](int i) { return predict(in.densities[at(i)], motion, noise_density, PaperPoseRule{}); });
  };
  BENCHMARK_ADVANCED("predict: 57 x 57 pairs")(Chronometer meter) {
    meter.measure(
        [&](int i) { return predict(in.densities[at(i)], motion, noise_density, JointPoseRule{}); });
  };
  BENCHMARK_ADVANCED("predict: 225 x 225 pairs")(Chronometer meter) {
    meter.measure([&](int i) { return predict(in.densities[at(i)], motion, noise_density, RichPoseRule{}); });
  };
}

TEST_CASE("Pose update", "[benchmark][filters]") {
  constexpr PaperPoseRule kPaperRule{BinghamBaseRule{}, UnscentedRule<3>{.kappa = 0.5}};
  const int landmarks = GENERATE(30, 300);
  const Scenes in(landmarks);
  const std::string with = " with " + std::to_string(landmarks) + " landmarks";
  BENCHMARK_ADVANCED("57 likelihoods" + with)(Chronometer meter) {
    const auto samples = sample(JointPoseRule{}, in.densities[0]);
    Vector<double, JointPoseRule::kCount> values;
    meter.measure([&](int i) {
      in.likelihoods[at(i)](samples.points, values);
      return values[0];
    });
  };
  BENCHMARK_ADVANCED("Gauss-Newton, 4 iterations" + with)(Chronometer meter) {
    meter.measure([&](int i) { return gauss_newton(in.priors[at(i)], in.likelihoods[at(i)].scene, 4); });
  };
  BENCHMARK_ADVANCED("quadratic_update" + with)(Chronometer meter) {
    meter.measure([&](int i) { return quadratic_update(in.priors[at(i)], in.likelihoods[at(i)]); });
  };
  BENCHMARK_ADVANCED("progressive_update, 15 x 15 points, tau 0.5" + with)(Chronometer meter) {
    meter.measure([&](int i) {
      return progressive_update(in.densities[at(i)], in.likelihoods[at(i)], RichPoseRule{});
    });
  };
  BENCHMARK_ADVANCED("progressive_update, 57 points, tau 0.5" + with)(Chronometer meter) {
    meter.measure([&](int i) {
      return progressive_update(in.densities[at(i)], in.likelihoods[at(i)], JointPoseRule{});
    });
  };
  BENCHMARK_ADVANCED("progressive_update as in the paper, 7 x 7 points, tau 0.05" + with)(Chronometer meter) {
    meter.measure([&](int i) {
      return progressive_update(in.densities[at(i)], in.likelihoods[at(i)], kPaperRule,
                                {.tau = 0.05, .keep_coupling = false});
    });
  };
}

TEST_CASE("Landmark update", "[benchmark][filters]") {
  const Scenes in(1);
  const Matrix3<double> R = Vector3<double>(0.25, 0.25, 0.5).asDiagonal();
  const auto landmark = [&](std::size_t k) {
    return Gaussian<double, 3>(in.likelihoods[k].scene.landmarks[0], 0.04 * Matrix3<double>::Identity());
  };
  const auto& camera = in.likelihoods[0].scene.camera;
  const auto z = [&](std::size_t k) { return in.likelihoods[k].scene.measurements[0]; };

  BENCHMARK_ADVANCED("landmark: extended Kalman filter, known pose")(Chronometer meter) {
    meter.measure([&](int i) {
      const auto prior = landmark(at(i));
      const Pose T_camera_world = in.priors[at(i)].pose.inverse();
      const Linearized h(camera, T_camera_world, prior.mean());
      const Matrix3<double> J = h.J_point * T_camera_world.rotation_matrix();
      const Matrix3<double> S = J * prior.covariance() * J.transpose() + R;
      const Matrix3<double> K = S.llt().solve(J * prior.covariance()).transpose();
      return Gaussian<double, 3>(prior.mean() + K * (z(at(i)) - h.z),
                                 prior.covariance() - K * S * K.transpose());
    });
  };
  BENCHMARK_ADVANCED("landmark: projection for the gate, known pose")(Chronometer meter) {
    meter.measure([&](int i) { return project_gaussian(landmark(at(i)), in.priors[at(i)].pose, camera); });
  };
  BENCHMARK_ADVANCED("landmark: unscented, known pose, 1 iteration")(Chronometer meter) {
    meter.measure([&](int i) {
      return unscented_update(landmark(at(i)), in.priors[at(i)].pose, camera, {z(at(i)), R},
                              {.iterations = 1});
    });
  };
  BENCHMARK_ADVANCED("landmark: unscented, known pose, 2 iterations")(Chronometer meter) {
    meter.measure([&](int i) {
      return unscented_update(landmark(at(i)), in.priors[at(i)].pose, camera, {z(at(i)), R});
    });
  };
  BENCHMARK_ADVANCED("landmark: unscented, 49 poses, 1 iteration")(Chronometer meter) {
    const auto poses = sample(PaperPoseRule{}, in.densities[0]);
    const auto prior =
        Gaussian<double, 3>(in.likelihoods[0].scene.landmarks[0], 0.04 * Matrix3<double>::Identity());
    meter.measure([&] { return unscented_update(prior, poses, camera, {z(0), R}, {.iterations = 1}); });
  };
  BENCHMARK_ADVANCED("landmark: unscented, 57 poses, 2 iterations")(Chronometer meter) {
    const auto poses = sample(JointPoseRule{}, in.densities[0]);
    const auto prior =
        Gaussian<double, 3>(in.likelihoods[0].scene.landmarks[0], 0.04 * Matrix3<double>::Identity());
    meter.measure([&] { return unscented_update(prior, poses, camera, {z(0), R}); });
  };
}

}  // namespace
}  // namespace antipode::test
