// SPDX-License-Identifier: MIT
// Monte-Carlo study of single pose updates with wrong matches: how close each comes to an update that knows
// which measurements are wrong, and whether its covariance is as large as its error. Prints a Markdown table:
// consistency_outliers [runs [first seed]].
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <vector>

#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/robust_likelihood.hpp>

#include "gauss_newton.hpp"
#include "stereo_world.hpp"

namespace consistency {
namespace {

constexpr double kPixelSigma = 0.5;

/// A prior, a true pose drawn from it, and stereo measurements of known points, a share of them anywhere in
/// the image and at any distance from 3 to 45 m.
struct Scenario : PriorAndTruth {
  StereoCamera camera = kitti_camera();
  std::vector<PointMeasurement> measurements = {};
  std::vector<PointMeasurement> good = {};
};

[[nodiscard]] Vector3<double> anywhere(Rng& rng, const StereoCamera& camera) {
  for (;;) {
    const Vector3<double> z(uniform(rng, 0.0, camera.width_px), uniform(rng, 0.0, camera.height_px),
                            camera.fx * camera.baseline_m / uniform(rng, 3.0, 45.0));
    if (camera.in_view(z)) return z;
  }
}

[[nodiscard]] Scenario random_scenario(unsigned seed, const PriorWidth& c, int count, double share) {
  Rng rng(seed);
  Scenario s{PriorAndTruth(rng, c)};
  const Matrix3<double> R = stereo_slam::stereo_pixel_covariance(kPixelSigma);
  for (int i = 0; i < count; ++i) {
    const Vector3<double> z = anywhere(rng, s.camera);
    const bool wrong = uniform(rng, 0.0, 1.0) < share;
    const Vector3<double> measured = wrong ? anywhere(rng, s.camera) : z + draw_gaussian<3>(rng, R);
    s.measurements.push_back({s.truth * s.camera.back_project(z), measured, R});
    if (!wrong) s.good.push_back(s.measurements.back());
  }
  return s;
}

/// What an update of a scenario came to; nothing if it reported failure.
using Outcome = std::optional<PoseGaussian<double>>;

struct Variant {
  const char* name;
  std::function<Outcome(const Scenario&)> update;
};

[[nodiscard]] auto model_of(const Scenario& s) {
  return
      [&s](const Pose& x, std::size_t i) { return s.camera.project(x.inverse() * s.measurements[i].point); };
}

[[nodiscard]] std::vector<antipode::NoisyMeasurement<double, 3>> measurements_of(const Scenario& s) {
  std::vector<antipode::NoisyMeasurement<double, 3>> all;
  for (const auto& m : s.measurements) all.push_back({m.z, m.S});
  return all;
}

[[nodiscard]] Outcome settled(const antipode::PoseUpdateResult<double>& result) {
  if (result.status != antipode::UpdateStatus::kConverged) return std::nullopt;
  return result.posterior;
}

template <class Noise>
[[nodiscard]] std::function<Outcome(const Scenario&)> robust(const Noise& noise) {
  return [=](const Scenario& s) {
    const antipode::RobustMeasurements likelihood(measurements_of(s), model_of(s), noise);
    return settled(antipode::quadratic_update(s.prior, likelihood));
  };
}

[[nodiscard]] std::function<Outcome(const Scenario&)> weighted(antipode::RobustWeight weight) {
  return [=](const Scenario& s) {
    return settled(antipode::linearized_update(s.prior, measurements_of(s), model_of(s),
                                               {.max_iterations = 20, .robust = weight}));
  };
}

[[nodiscard]] std::vector<Variant> variants() {
  using antipode::Contamination, antipode::RobustWeight, antipode::StudentT;
  return {{"knows the outliers",
           [](const Scenario& s) { return gauss_newton(s.prior, s.good, s.camera, s.truth); }},
          {"quadratic, Student-t (4)", robust(StudentT<double>{})},
          {"quadratic, Student-t (1)", robust(StudentT<double>{1.0})},
          {"quadratic, contamination", robust(Contamination<double>{})},
          {"linearised, Cauchy weights", weighted(RobustWeight::kCauchy)},
          {"linearised, Huber weights", weighted(RobustWeight::kHuber)},
          {"linearised, Gaussian", weighted(RobustWeight::kNone)}};
}

/// One row of the table per variant.
void study(const PriorWidth& c, int count, double share, int runs, unsigned first_seed) {
  const auto all = variants();
  std::vector<ErrorStatistics> errors(all.size());
  std::vector<int> failures(all.size()), lost(all.size());
  std::vector<ErrorStatistics> best(all.size());  // of the same runs
  for (int run = 0; run < runs; ++run) {
    const Scenario s = random_scenario(first_seed + static_cast<unsigned>(run), c, count, share);
    const auto oracle = *all[0].update(s);
    for (std::size_t v = 0; v < all.size(); ++v) {
      const Outcome outcome = all[v].update(s);
      if (!outcome) {
        ++failures[v];
        continue;
      }
      errors[v].add(*outcome, s.truth);
      best[v].add(oracle, s.truth);
      lost[v] += nees(*outcome, s.truth) > 30.0 ? 1 : 0;
    }
  }
  for (std::size_t v = 0; v < all.size(); ++v) {
    std::printf("| %s | %.0f %% | %d | %s | %.2f | %.2f | %.3g | %d | %d |\n", c.name, 100.0 * share, count,
                all[v].name, errors[v].rotation_rmse_deg() / best[v].rotation_rmse_deg(),
                errors[v].translation_rmse_m() / best[v].translation_rmse_m(), errors[v].anees(), lost[v],
                failures[v]);
  }
}

}  // namespace
}  // namespace consistency

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 100;
  const unsigned first_seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1;
  std::printf(
      "| prior | outliers | landmarks | update | rotation / best | translation / best | ANEES | NEES > 30 | "
      "failed "
      "|\n|---|---|---|---|---|---|---|---|---|\n");
  for (const consistency::PriorWidth& c : {consistency::PriorWidth{"0.2 deg, 6 cm", 0.2, 0.06},
                                           consistency::PriorWidth{"2 deg, 50 cm", 2.0, 0.5}}) {
    for (const double share : {0.0, 0.1, 0.2, 0.4}) {
      for (const int count : {4, 10, 30, 100, 300}) consistency::study(c, count, share, runs, first_seed);
    }
  }
}
