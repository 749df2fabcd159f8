// SPDX-License-Identifier: MIT
// Monte-Carlo study of single pose updates: how close each filter comes to the best linearised estimator, and
// whether its covariance is as large as its error. Prints Markdown tables: of one measurement by a single
// sensor under wide priors (consistency_updates sensors [runs [name [first seed]]], altimeter say, "" for
// all), or of stereo landmarks (consistency_updates [runs]).
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <string_view>

#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "gauss_newton.hpp"
#include "sensors.hpp"
#include "stereo_slam/tracking/pose_likelihood.hpp"
#include "stereo_world.hpp"

namespace consistency {
namespace {

using antipode::Vector2;

constexpr double kPixelSigma = 0.5;
constexpr double kLandmarkShare = 0.3;  // of the covariance of one triangulation

/// A prior, a true pose drawn from it, and measurements of uncertain landmarks.
struct Scenario : PriorAndTruth {
  StereoCamera camera = kitti_camera();
  std::vector<PointMeasurement> measurements = {};
  std::vector<stereo_slam::Landmark> landmarks = {};
  std::vector<stereo_slam::Match> matches = {};
};

[[nodiscard]] Scenario random_scenario(unsigned seed, const PriorWidth& c, int count) {
  Rng rng(seed);
  Scenario s{PriorAndTruth(rng, c)};
  const Matrix3<double> R = stereo_slam::stereo_pixel_covariance(kPixelSigma);
  while (static_cast<int>(s.measurements.size()) < count) {
    const double depth = uniform(rng, 3.0, 45.0);
    const Vector3<double> z(uniform(rng, 0.0, s.camera.width_px), uniform(rng, 0.0, s.camera.height_px),
                            s.camera.fx * s.camera.baseline_m / depth);
    if (!s.camera.in_view(z)) continue;
    stereo_slam::Landmark landmark;
    landmark.T_reference_anchor = s.truth;
    landmark.covariance = kLandmarkShare * R;
    landmark.mean = z + draw_gaussian<3>(rng, landmark.covariance);
    stereo_slam::Match match;
    match.landmark = s.landmarks.size();
    match.z = z + draw_gaussian<3>(rng, R);
    match.R = R;
    // At the true pose, as in the last pass of a filter: what is studied is the update alone.
    match.predicted.landmark_part = kLandmarkShare * R;
    const Vector3<double> point = s.truth * s.camera.back_project(landmark.mean);
    s.measurements.push_back({point, match.z, match.predicted.landmark_part + R});
    s.landmarks.push_back(landmark);
    s.matches.push_back(match);
  }
  return s;
}

struct Outcome {
  PoseGaussian<double> posterior;
  long evaluations = 0;
  bool failed = false;  ///< and reported it
};

/// A log-likelihood that falls short of this by chance once in a million, for measurements of dimension 3.
[[nodiscard]] double lowest_plausible(std::size_t measurements) {
  const double dof = 3.0 * static_cast<double>(measurements);
  return -0.5 * (dof + 5.0 * std::sqrt(2.0 * dof) + 20.0);
}

struct Variant {
  const char* name;
  std::function<Outcome(const Scenario&, const stereo_slam::PoseLikelihood&)> update;
};

[[nodiscard]] std::vector<Variant> variants() {
  using Likelihood = stereo_slam::PoseLikelihood;
  const auto progressive = [](const auto& rule, double tau, bool keep_coupling) {
    return [=](const Scenario& s, const Likelihood& l) {
      const auto result = antipode::progressive_update(antipode::to_bingham_gaussian(s.prior), l, rule,
                                                       {.tau = tau, .keep_coupling = keep_coupling});
      return Outcome{antipode::to_pose_gaussian(result.posterior), result.evaluations};
    };
  };
  return {
      {"Gauss-Newton MAP",
       [](const Scenario& s, const Likelihood&) {
         return Outcome{gauss_newton(s.prior, s.measurements, s.camera, s.prior.pose), 0};
       }},
      {"paper (7 x 7, tau .02)", progressive(antipode::PaperPoseRule{}, 0.02, false)},
      {"degree-5 reweighting (tau .5)", progressive(antipode::RichPoseRule{}, 0.5, true)},
      {"quadratic",
       [](const Scenario& s, const Likelihood& l) {
         const auto result = antipode::quadratic_update(
             s.prior, l, {.min_log_likelihood = lowest_plausible(s.measurements.size())});
         // A filter keeps its prior when the update reports failure.
         const bool failed = result.status != antipode::UpdateStatus::kConverged;
         return Outcome{failed ? s.prior : result.posterior, result.evaluations, failed};
       }},
      {"linearised",
       [](const Scenario& s, const Likelihood&) {
         std::vector<antipode::NoisyMeasurement<double, 3>> measurements;
         measurements.reserve(s.measurements.size());
         for (const auto& m : s.measurements) measurements.push_back({m.z, m.S});
         const auto h = [&](const Pose& x, std::size_t i) {
           return s.camera.project(x.inverse() * s.measurements[i].point);
         };
         const auto result = antipode::linearized_update(s.prior, measurements, h);
         const bool failed = result.status != antipode::UpdateStatus::kConverged;
         return Outcome{failed ? s.prior : result.posterior, result.evaluations, failed};
       }},
  };
}

void study(const PriorWidth& c, int landmarks, int runs) {
  const auto filters = variants();
  std::vector<ErrorStatistics> errors(filters.size());
  std::vector<long> evaluations(filters.size(), 0), most(filters.size(), 0);
  std::vector<int> failures(filters.size(), 0);
  std::vector<std::vector<double>> times_us(filters.size());
  for (int run = 0; run < runs; ++run) {
    const Scenario s = random_scenario(static_cast<unsigned>(run), c, landmarks);
    for (std::size_t i = 0; i < filters.size(); ++i) {
      const auto start = std::chrono::steady_clock::now();
      const stereo_slam::PoseLikelihood likelihood(s.matches, {s.landmarks, s.camera},
                                                   std::numeric_limits<double>::infinity());
      const Outcome outcome = filters[i].update(s, likelihood);
      times_us[i].push_back(
          std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
      errors[i].add(outcome.posterior, s.truth);
      evaluations[i] += outcome.evaluations;
      failures[i] += outcome.failed;
      most[i] = std::max(most[i], outcome.evaluations);
    }
  }
  for (std::size_t i = 0; i < filters.size(); ++i) {
    std::nth_element(times_us[i].begin(), times_us[i].begin() + runs / 2, times_us[i].end());
    std::printf("| %s | %d | %s | %.4f | %.3f | %.3f | %.3f | %.3g | %d | %ld (%ld) | %.0f |\n", c.name,
                landmarks, filters[i].name, errors[i].rotation_rmse_deg(),
                100.0 * errors[i].translation_rmse_m(),
                errors[i].rotation_rmse_deg() / errors[0].rotation_rmse_deg(),
                errors[i].translation_rmse_m() / errors[0].translation_rmse_m(), errors[i].anees(),
                failures[i], evaluations[i] / runs, most[i], times_us[i][static_cast<std::size_t>(runs / 2)]);
  }
}

}  // namespace
}  // namespace consistency

int main(int argc, char** argv) {
  using namespace consistency;
  if (argc > 1 && std::string_view(argv[1]) == "sensors") {
    Trials trials;
    if (argc > 2) trials.count = static_cast<unsigned>(std::max(2, std::atoi(argv[2])));
    if (argc > 4) trials.first_seed = static_cast<unsigned>(std::atoi(argv[4]));
    study_sensors(trials, argc > 3 ? argv[3] : "");
    return 0;
  }
  const int runs = argc > 1 ? std::max(2, std::atoi(argv[1])) : 100;
  const PriorWidth cases[] = {{"tight: 0.2 deg, 6 cm", 0.2, 0.06},
                              {"weak: 2 deg, 50 cm", 2.0, 0.5},
                              {"very weak: 8 deg, 1 m", 8.0, 1.0},
                              {"hardly any: 25 deg, 2 m", 25.0, 2.0}};
  std::printf("%d runs each; 95 %% band of the ANEES 6 +- %.2f\n\n", runs, anees_band(runs));
  std::printf(
      "| prior | landmarks | update | rotation RMSE (deg) | translation RMSE (cm) | rotation / GN | "
      "translation / GN | "
      "ANEES | gave up | likelihood calls, mean (most) | median us "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const PriorWidth& c : cases) {
    for (const int landmarks : {30, 100, 300}) study(c, landmarks, runs);
  }
  return 0;
}
