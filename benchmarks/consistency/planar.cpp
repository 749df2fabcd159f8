// SPDX-License-Identifier: MIT
// Monte-Carlo study of an ambiguous measurement: the pose of a square pattern from the pixels of its corners
// in one image. Seen from afar, the pattern and its mirror image about the line of sight look the same.
// Prints a Markdown table of how often each update reports a pose with confidence although it is the wrong
// one.
//
//     consistency_planar [trials [first seed]]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <antipode/distributions/pose_charts.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/quadratic_update.hpp>

namespace consistency {
namespace {

using antipode::Matrix;
using antipode::Matrix6;
using antipode::UpdateStatus;
using antipode::Vector2;
using antipode::Vector3;
using antipode::Vector4;
using antipode::Vector6;
using Pose = antipode::DualQuaternion<double>;
using Pixel = antipode::NoisyMeasurement<double, 2>;
using Rng = std::mt19937_64;

/// A square pattern before a camera, and how well its pose is known.
struct World {
  double size_m, distance_m, focal_px, tilt_deg, rotation_sigma_rad, translation_sigma_m;
  bool camera_in_pattern = false;  ///< the state is the pose of the camera, not of the pattern
};

constexpr double kPixelSigma = 1.0;

/// The pixels of the corners, with the Jacobian in a chart that moves the pose by x exp(phi, rho).
struct Corners {
  double half_m, focal_px;
  bool camera_in_pattern;

  [[nodiscard]] Vector3<double> corner(std::size_t i) const {
    return {i % 3 == 0 ? -half_m : half_m, i < 2 ? -half_m : half_m, 0.0};
  }
  [[nodiscard]] std::optional<Vector2<double>> operator()(const Pose& x, std::size_t i) const {
    const Vector3<double> p = camera_in_pattern ? Vector3<double>(x.inverse() * corner(i)) : x * corner(i);
    if (p[2] < 0.05) return std::nullopt;
    return Vector2<double>(focal_px * p[0] / p[2], focal_px * p[1] / p[2]);
  }
  [[nodiscard]] std::optional<Vector2<double>> operator()(const Pose& x, std::size_t i,
                                                          Matrix<double, 2, 6>& J) const {
    const Vector3<double> p = camera_in_pattern ? Vector3<double>(x.inverse() * corner(i)) : x * corner(i);
    if (p[2] < 0.05) return std::nullopt;
    Matrix<double, 2, 3> J_p;
    J_p << focal_px / p[2], 0, -focal_px * p[0] / (p[2] * p[2]),  //
        0, focal_px / p[2], -focal_px * p[1] / (p[2] * p[2]);
    const antipode::Matrix3<double> R = x.rotation_matrix();
    Matrix<double, 3, 6> J_x;
    if (camera_in_pattern) {
      J_x << antipode::skew(p), -antipode::Matrix3<double>::Identity();
    } else {
      J_x << -R * antipode::skew(corner(i)), R;
    }
    J = J_p * J_x;
    return Vector2<double>(focal_px * p[0] / p[2], focal_px * p[1] / p[2]);
  }
};

/// A prior, and the pixels measured at a true pose that is as far from it as the prior says.
struct Trial {
  Pose truth;
  antipode::PoseGaussian<double> prior;
  std::vector<Pixel> pixels;
};

[[nodiscard]] Trial random_trial(const World& world, unsigned seed) {
  Rng rng(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const double azimuth = M_PI * uniform(rng), tilt = world.tilt_deg * M_PI / 180.0;
  Vector6<double> spin = Vector6<double>::Zero(), tilted = Vector6<double>::Zero();
  spin[2] = M_PI * uniform(rng);
  tilted.head<3>() = tilt * Vector3<double>(std::cos(azimuth), std::sin(azimuth), 0.0);
  const Vector3<double> centre(0.3 * world.distance_m * uniform(rng), 0.2 * world.distance_m * uniform(rng),
                               world.distance_m);
  const Pose T_camera_pattern = Pose::from_rotation_translation(Vector4<double>(1, 0, 0, 0), centre) *
                                Pose::exp(tilted) * Pose::exp(spin);
  Trial trial{.truth = world.camera_in_pattern ? T_camera_pattern.inverse() : T_camera_pattern,
              .prior = {},
              .pixels = {}};
  Vector6<double> sigma, error;
  sigma << Vector3<double>::Constant(world.rotation_sigma_rad),
      Vector3<double>::Constant(world.translation_sigma_m);
  for (double& entry : error) entry = normal(rng);
  trial.prior = {trial.truth.boxplus(-sigma.cwiseProduct(error)), sigma.cwiseAbs2().asDiagonal()};
  const Corners h{world.size_m / 2, world.focal_px, world.camera_in_pattern};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto z = h(trial.truth, i);
    trial.pixels.push_back({*z + kPixelSigma * Vector2<double>(normal(rng), normal(rng)),
                            kPixelSigma * kPixelSigma * antipode::Matrix<double, 2>::Identity()});
  }
  return trial;
}

/// A mode of prior times likelihood.
struct Top {
  Pose pose;
  double log_density = -std::numeric_limits<double>::infinity();   ///< without constants
  double log_evidence = -std::numeric_limits<double>::infinity();  ///< of the Gaussian about it
};

/// The log of prior times likelihood, without constants.
[[nodiscard]] double log_density(const Trial& trial, const Corners& h, const Pose& x) {
  const Vector6<double> y =
      x.boxminus(trial.prior.pose).cwiseQuotient(trial.prior.covariance.diagonal().cwiseSqrt());
  double sum = -0.5 * y.squaredNorm();
  for (std::size_t i = 0; i < trial.pixels.size(); ++i) {
    const auto z = h(x, i);
    if (!z) return -std::numeric_limits<double>::infinity();
    sum -= 0.5 * (trial.pixels[i].z - *z).squaredNorm() / (kPixelSigma * kPixelSigma);
  }
  return sum;
}

/// The top that Levenberg-Marquardt on prior and pixels reaches from x. The prior's part is differentiated
/// numerically.
[[nodiscard]] Top ascend(const Trial& trial, const Corners& h, Pose x) {
  Top top{x, log_density(trial, h, x)};
  double damping = 1e-3;
  Matrix6<double> H;
  for (int iteration = 0; iteration < 200 && damping < 1e9; ++iteration) {
    const Vector6<double> whitening = trial.prior.covariance.diagonal().cwiseSqrt().cwiseInverse();
    const Vector6<double> y = whitening.cwiseProduct(top.pose.boxminus(trial.prior.pose));
    Matrix6<double> J_y;
    for (int i = 0; i < 6; ++i) {
      constexpr double kStep = 1e-6;
      const Vector6<double> e = kStep * Vector6<double>::Unit(i);
      J_y.col(i) = whitening.cwiseProduct(top.pose.boxplus(e).boxminus(trial.prior.pose) -
                                          top.pose.boxplus(-e).boxminus(trial.prior.pose)) /
                   (2 * kStep);
    }
    H = J_y.transpose() * J_y;
    Vector6<double> g = -J_y.transpose() * y;
    for (std::size_t i = 0; i < trial.pixels.size(); ++i) {
      Matrix<double, 2, 6> J;
      const auto z = h(top.pose, i, J);
      if (!z) return top;
      H += J.transpose() * J / (kPixelSigma * kPixelSigma);
      g += J.transpose() * (trial.pixels[i].z - *z) / (kPixelSigma * kPixelSigma);
    }
    Matrix6<double> damped = H;
    damped.diagonal() *= 1.0 + damping;
    const Vector6<double> step = damped.ldlt().solve(g);
    const Pose next = top.pose.boxplus(step);
    const double found = log_density(trial, h, next);
    if (found >= top.log_density) {
      const bool settled = found - top.log_density < 1e-9;
      top.pose = next;
      top.log_density = found;
      damping = std::max(1e-9, damping / 5.0);
      if (settled) break;
    } else {
      damping *= 4.0;
    }
  }
  const double determinant = H.determinant();
  top.log_evidence = determinant > 0 ? top.log_density - 0.5 * std::log(determinant) : top.log_density;
  return top;
}

/// The tops of prior times likelihood, the highest first: reached from the truth, from the pose with the
/// normal of the pattern mirrored about the line of sight, and from draws of the prior.
[[nodiscard]] std::vector<Top> tops_of(const Trial& trial, const Corners& h, unsigned seed) {
  Rng rng(seed + 77'000'000);
  std::normal_distribution<double> normal;
  std::vector<Pose> starts{trial.truth};
  const Pose T_camera_pattern = h.camera_in_pattern ? trial.truth.inverse() : trial.truth;
  const Vector3<double> sight = T_camera_pattern.translation().normalized();
  const antipode::Matrix3<double> R = T_camera_pattern.rotation_matrix();
  const Vector3<double> normal_axis = R.col(2), axis = normal_axis.cross(sight);
  const double angle = 2.0 * std::atan2(axis.norm(), normal_axis.dot(sight));
  Vector6<double> turn = Vector6<double>::Zero();
  if (axis.norm() > 1e-9) turn.head<3>() = angle * (R.transpose() * axis.normalized());
  const Pose mirrored = T_camera_pattern * Pose::exp(turn);
  starts.push_back(h.camera_in_pattern ? mirrored.inverse() : mirrored);
  for (int k = 0; k < 6; ++k) {
    Vector6<double> error;
    for (double& entry : error) entry = normal(rng);
    starts.push_back(
        trial.prior.pose.boxplus(error.cwiseProduct(trial.prior.covariance.diagonal().cwiseSqrt())));
  }
  std::vector<Top> tops;
  for (const Pose& start : starts) {
    const Top top = ascend(trial, h, start);
    if (std::isfinite(top.log_density)) tops.push_back(top);
  }
  std::sort(tops.begin(), tops.end(),
            [](const Top& a, const Top& b) { return a.log_evidence > b.log_evidence; });
  return tops;
}

/// How an update ended over the trials of a world.
struct Outcomes {
  int converged = 0, wrong = 0, wrong_and_gated = 0, overlooked = 0, not_gaussian = 0, failed = 0;
  double nis_right = 0.0, nis_wrong = 0.0;
  long evaluations = 0;

  template <class Result>
  void add(const Result& result, const Trial& trial, const std::vector<Top>& tops) {
    using Chart = typename decltype(result.posterior)::Chart;
    evaluations += result.evaluations;
    if (result.status != UpdateStatus::kConverged) {
      ++(result.status == UpdateStatus::kNotGaussian ? not_gaussian : failed);
      return;
    }
    ++converged;
    const Eigen::LLT<Matrix6<double>> root(result.posterior.covariance);
    const auto distance2 = [&](const Pose& x) {
      return root.matrixL().solve(Chart::local(result.posterior.pose, x)).squaredNorm();
    };
    // The same top is within a few standard deviations: tops of an ambiguity are farther apart.
    double own = -std::numeric_limits<double>::infinity(), other = own;
    for (const Top& top : tops) {
      double& best = distance2(top.pose) < 9.0 ? own : other;
      best = std::max(best, top.log_evidence);
    }
    constexpr double kComparable = 3.0;  // a weight of 5 %
    constexpr double kGate = 42.7;       // of a NIS of eight degrees, exceeded by one of a million
    const bool is_wrong = other > own || distance2(trial.truth) > 30.0;
    overlooked += other > own - kComparable;
    wrong += is_wrong;
    wrong_and_gated += is_wrong && result.nis > kGate;
    (is_wrong ? nis_wrong : nis_right) += result.nis;
  }
};

void study(const World& world, unsigned trials, unsigned first_seed) {
  constexpr std::array kUpdates{"quadratic", "quadratic, split chart", "linearised", "Gauss-Newton"};
  std::array<Outcomes, kUpdates.size()> outcomes;
  int ambiguous = 0;
  const Corners h{world.size_m / 2, world.focal_px, world.camera_in_pattern};
  for (unsigned seed = first_seed; seed < first_seed + trials; ++seed) {
    const Trial trial = random_trial(world, seed);
    const auto tops = tops_of(trial, h, seed);
    for (const Top& top : tops) {
      if (top.pose.boxminus(tops[0].pose).head<3>().norm() < 0.05) continue;
      ambiguous += top.log_evidence > tops[0].log_evidence - 3.0;
      break;
    }
    const antipode::GaussianMeasurements likelihood(trial.pixels, h);
    const auto split = antipode::in_chart<antipode::SplitChart<double>>(trial.prior);
    outcomes[0].add(antipode::quadratic_update(trial.prior, likelihood), trial, tops);
    outcomes[1].add(antipode::quadratic_update(split, likelihood), trial, tops);
    outcomes[2].add(antipode::linearized_update(trial.prior, trial.pixels, h), trial, tops);
    outcomes[3].add(antipode::gauss_newton_update(trial.prior, trial.pixels, h), trial, tops);
  }
  for (std::size_t i = 0; i < kUpdates.size(); ++i) {
    const Outcomes& o = outcomes[i];
    const auto mean = [](double sum, int count) { return count > 0 ? sum / count : 0.0; };
    std::printf("| %.1f m at %.0f m, %.0f px, %.0f deg | %.1f rad, %.1f m%s | %d | %s | ", world.size_m,
                world.distance_m, world.focal_px, world.tilt_deg, world.rotation_sigma_rad,
                world.translation_sigma_m, world.camera_in_pattern ? ", of the camera" : "", ambiguous,
                kUpdates[i]);
    std::printf("%d | %d (%d) | %d | %d | %d | %.1f (%.1f) | %ld |\n", o.converged, o.wrong,
                o.wrong_and_gated, o.overlooked, o.not_gaussian, o.failed,
                mean(o.nis_right, o.converged - o.wrong), mean(o.nis_wrong, o.wrong),
                o.evaluations / static_cast<long>(trials));
  }
}

}  // namespace
}  // namespace consistency

int main(int argc, char** argv) {
  using consistency::World;
  const unsigned trials = argc > 1 ? static_cast<unsigned>(std::max(2, std::atoi(argv[1]))) : 300;
  const unsigned first_seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 0;
  const World worlds[] = {{0.2, 2, 800, 30, 0.1, 0.1},        {0.2, 2, 800, 30, 0.3, 0.1},
                          {0.2, 2, 800, 30, 0.6, 0.2},        {0.2, 2, 800, 30, 1.0, 0.5},
                          {0.2, 2, 800, 30, 1.5, 0.5},        {0.2, 2, 800, 0, 0.6, 0.2},
                          {0.2, 2, 800, 10, 0.6, 0.2},        {0.2, 2, 800, 60, 0.6, 0.2},
                          {0.2, 2, 800, 70, 1.0, 0.2},        {0.1, 3, 500, 40, 0.6, 0.3},
                          {0.5, 5, 800, 40, 0.6, 0.5},        {0.5, 10, 1000, 50, 1.0, 1.0},
                          {0.5, 1, 500, 30, 0.6, 0.2},        {0.5, 3, 1000, 20, 0.3, 0.2},
                          {0.2, 2, 800, 30, 0.3, 0.3, true},  {0.2, 2, 800, 30, 0.6, 1.0, true},
                          {0.2, 2, 800, 50, 1.0, 0.5, true},  {0.5, 5, 800, 40, 0.6, 2.0, true},
                          {0.5, 10, 1000, 60, 0.3, 3.0, true}};
  std::printf(
      "| pattern | prior | two comparable modes | update | converged | of these wrong (NIS above 42.7) | of "
      "these with an overlooked mode | not Gaussian | failed | mean NIS, right (wrong) | evaluations "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const World& world : worlds) consistency::study(world, trials, first_seed);
  return 0;
}
