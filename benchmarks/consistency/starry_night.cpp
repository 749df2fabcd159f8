// SPDX-License-Identifier: MIT
// The filters on a recorded sequence: a hand-held stereo camera with a gyro and a velocity over twenty known
// landmarks, the truth from motion capture (University of Toronto, AER1513 "Starry Night"). Its pixel noise
// of 6 to 12 px separates good filters from bad ones. Prints a Markdown table.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <antipode/filters/pose_filter.hpp>

#include "error_state_ekf.hpp"
#include "stereo_world.hpp"

namespace consistency {
namespace {

using Pixels = Eigen::Vector4d;  // u_left, v_left, u_right, v_right

struct Camera {
  Matrix3<double> R_camera_vehicle;
  Vector3<double> camera_in_vehicle;
  double fu, fv, cu, cv, b;

  [[nodiscard]] Vector3<double> in_camera(const Pose& T_world_vehicle, const Vector3<double>& p_world) const {
    return R_camera_vehicle * (T_world_vehicle.inverse() * p_world - camera_in_vehicle);
  }
  [[nodiscard]] std::optional<Pixels> project(const Pose& T_world_vehicle,
                                              const Vector3<double>& p_world) const {
    const Vector3<double> p = in_camera(T_world_vehicle, p_world);
    if (p[2] <= 0.05) return std::nullopt;
    const double v = fv * p[1] / p[2] + cv;
    return Pixels(fu * p[0] / p[2] + cu, v, fu * (p[0] - b) / p[2] + cu, v);
  }
  /// d project / d xi for T_world_vehicle exp(xi)
  [[nodiscard]] Eigen::Matrix<double, 4, 6> jacobian(const Pose& T_world_vehicle,
                                                     const Vector3<double>& p_world) const {
    const Vector3<double> p = in_camera(T_world_vehicle, p_world);
    const double w = 1.0 / p[2];
    Eigen::Matrix<double, 4, 3> projection;
    projection << fu * w, 0, -fu * p[0] * w * w,  //
        0, fv * w, -fv * p[1] * w * w,            //
        fu * w, 0, -fu * (p[0] - b) * w * w,      //
        0, fv * w, -fv * p[1] * w * w;
    Eigen::Matrix<double, 3, 6> motion;
    motion << antipode::skew(Vector3<double>(T_world_vehicle.inverse() * p_world)),
        -Matrix3<double>::Identity();
    return projection * R_camera_vehicle * motion;
  }
};

struct Step {
  Pose motion;  ///< T_before_now
  Matrix6<double> motion_covariance;
  Pose truth;  ///< T_world_vehicle
  std::vector<std::size_t> landmarks;
  std::vector<Pixels> measurements;
};

struct Recording {
  Camera camera;
  std::vector<Vector3<double>> landmarks;
  std::vector<Step> steps;
  Eigen::Matrix4d independent_noise;  ///< the variances that come with the recording
  Eigen::Matrix4d correlated_noise;   ///< of the residuals at the truth: their variances are the same
  Eigen::Matrix4d inflated_noise;     ///< the same, made larger for their correlation from step to step
};

/// The numbers of a CSV file's rows, without the header.
[[nodiscard]] std::vector<std::vector<double>> read_rows(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  std::vector<std::vector<double>> rows;
  std::string line, entry;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream entries(line);
    rows.emplace_back();
    while (std::getline(entries, entry, ',')) rows.back().push_back(std::stod(entry));
  }
  return rows;
}

/// name,values separated by spaces
[[nodiscard]] std::map<std::string, std::vector<double>> read_constants(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  std::map<std::string, std::vector<double>> constants;
  std::string line, name;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream entries(line);
    std::getline(entries, name, ',');
    for (double value; entries >> value;) constants[name].push_back(value);
  }
  return constants;
}

[[nodiscard]] Vector3<double> vector3(const std::vector<double>& row, std::size_t first) {
  return {row.at(first), row.at(first + 1), row.at(first + 2)};
}

using Constants = std::map<std::string, std::vector<double>>;

[[nodiscard]] Camera camera_from(const Constants& constants) {
  const auto scalar = [&](const char* name) { return constants.at(name).at(0); };
  Camera camera;
  camera.R_camera_vehicle =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(constants.at("C_c_v").data());
  camera.camera_in_vehicle = vector3(constants.at("rho_v_c_v"), 0);
  camera.fu = scalar("fu");
  camera.fv = scalar("fv");
  camera.cu = scalar("cu");
  camera.cv = scalar("cv");
  camera.b = scalar("b");
  return camera;
}

/// The ground truth of every step and the odometry that leads to it.
[[nodiscard]] std::vector<Step> read_steps(const std::string& path, const Constants& constants) {
  Vector6<double> rate_variance;
  rate_variance << vector3(constants.at("w_var"), 0), vector3(constants.at("v_var"), 0);
  std::vector<Step> steps;
  const auto rows = read_rows(path);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    Step step;
    const double dt = k == 0 ? 0.0 : rows[k][0] - rows[k - 1][0];
    const auto& before = rows[k == 0 ? 0 : k - 1];
    Vector6<double> twist;
    twist << vector3(before, 7), vector3(before, 10);
    step.motion = Pose::exp(dt * twist);
    step.motion_covariance = (dt * dt * rate_variance).asDiagonal();
    // C_vi, inertial to vehicle, is the transpose of the rotation by the vector.
    Vector6<double> turn;
    turn << vector3(rows[k], 1), Vector3<double>::Zero();
    step.truth = Pose::from_rotation_translation(Pose::exp(turn).rotation(), vector3(rows[k], 4));
    steps.push_back(step);
  }
  return steps;
}

/// Adds the measurements to the steps, and estimates their noise from the errors at the ground truth.
void read_measurements(const std::string& path, Recording& r) {
  r.correlated_noise.setZero();
  Pixels lagged = Pixels::Zero(), squared = Pixels::Zero();
  std::map<std::size_t, std::pair<std::size_t, Pixels>> last;  // step and error, by landmark
  int count = 0;
  for (const auto& row : read_rows(path)) {
    const auto k = static_cast<std::size_t>(row.at(0));
    Step& step = r.steps.at(k);
    step.landmarks.push_back(static_cast<std::size_t>(row.at(1)));
    step.measurements.emplace_back(row.at(2), row.at(3), row.at(4), row.at(5));
    const Pixels error = step.measurements.back() -
                         r.camera.project(step.truth, r.landmarks.at(step.landmarks.back())).value();
    r.correlated_noise += error * error.transpose();
    ++count;
    auto& [last_step, last_error] = last[step.landmarks.back()];
    if (k > 0 && last_step == k - 1) {
      lagged += error.cwiseProduct(last_error);
      squared += error.cwiseAbs2();
    }
    last_step = k;
    last_error = error;
  }
  r.correlated_noise /= count;
  // N errors of an autoregressive process average out like N (1 - rho)/(1 + rho) independent ones.
  const Eigen::Array4d rho = lagged.cwiseQuotient(squared).array();
  const Pixels inflation = ((1.0 + rho) / (1.0 - rho)).sqrt();
  r.inflated_noise = inflation.asDiagonal() * r.correlated_noise * inflation.asDiagonal();
}

[[nodiscard]] Recording read_recording(const std::string& folder) {
  const auto constants = read_constants(folder + "/constants.csv");
  Recording r;
  r.camera = camera_from(constants);
  for (const auto& row : read_rows(folder + "/landmarks.csv")) r.landmarks.push_back(vector3(row, 1));
  r.steps = read_steps(folder + "/truth_and_odometry.csv", constants);
  const auto& y_var = constants.at("y_var");
  r.independent_noise = Eigen::Map<const Eigen::Vector4d>(y_var.data()).asDiagonal();
  read_measurements(folder + "/measurements.csv", r);
  return r;
}

struct Score {
  ErrorStatistics errors;
  int failures = 0;  ///< updates that did not converge
};

template <class Filter>
void run(const Recording& r, const Eigen::Matrix4d& R, const PoseGaussian<double>& start, Score& score) {
  constexpr bool kEkf = std::is_same_v<Filter, ErrorStateEkf>;
  Filter filter(start);
  for (std::size_t k = 0; k < r.steps.size(); ++k) {
    const Step& step = r.steps[k];
    if (k > 0) filter.predict(step.motion, {Pose::identity(), step.motion_covariance});
    if (!step.measurements.empty()) {
      const auto landmark = [&](std::size_t i) { return r.landmarks[step.landmarks[i]]; };
      std::vector<antipode::NoisyMeasurement<double, 4>> noisy;
      noisy.reserve(step.measurements.size());
      for (const Pixels& z : step.measurements) noisy.push_back({z, R});
      const antipode::GaussianMeasurements measurements(
          noisy, [&](const Pose& x, std::size_t i) { return r.camera.project(x, landmark(i)); }, -1e4);
      if constexpr (kEkf) {
        filter.update(measurements,
                      [&](const Pose& x, std::size_t i) { return r.camera.jacobian(x, landmark(i)); });
      } else {
        score.failures += filter.update(measurements).status != antipode::UpdateStatus::kConverged;
      }
    }
    score.errors.add(filter.belief(), step.truth);
  }
}

struct Case {
  const char* name;
  double rotation_sigma_deg, translation_sigma_m;  ///< of the start
  const Eigen::Matrix4d& R;
};

template <class Filter>
void study(const char* name, const Recording& r, const Case& c, unsigned runs) {
  const Matrix6<double> covariance =
      isotropic_covariance(c.rotation_sigma_deg * M_PI / 180.0, c.translation_sigma_m);
  Score score;
  for (unsigned seed = 0; seed < runs; ++seed) {
    Rng rng(seed);
    run<Filter>(r, c.R, {r.steps.front().truth.boxplus(draw_gaussian<6>(rng, covariance)), covariance},
                score);
  }
  std::printf("| %s | %s | %.3f | %.2f | %.2f | %d |\n", c.name, name, score.errors.rotation_rmse_deg(),
              100.0 * score.errors.translation_rmse_m(), score.errors.anees(), score.failures);
}

}  // namespace
}  // namespace consistency

int main(int argc, char** argv) {
  using namespace consistency;
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s FOLDER [RUNS], with the folder of constants.csv and the like\n", argv[0]);
    return 1;
  }
  const unsigned runs = argc > 2 ? static_cast<unsigned>(std::max(1, std::atoi(argv[2]))) : 5;
  try {
    const Recording r = read_recording(argv[1]);
    std::printf("%zu steps, %u starts each\n\n", r.steps.size(), runs);
    std::printf(
        "| start, noise | filter | rotation RMSE (deg) | position RMSE (cm) | ANEES (6) | updates that "
        "failed |\n"
        "|---|---|---|---|---|---|\n");
    for (const Case& c : {Case{"0.5 deg, 1 cm; variances as recorded", 0.5, 0.01, r.independent_noise},
                          Case{"20 deg, 50 cm; variances as recorded", 20.0, 0.5, r.independent_noise},
                          Case{"0.5 deg, 1 cm; left and right correlated", 0.5, 0.01, r.correlated_noise},
                          Case{"0.5 deg, 1 cm; steps correlated, too", 0.5, 0.01, r.inflated_noise}}) {
      study<ErrorStateEkf>("error-state EKF", r, c, runs);
      study<antipode::PaperPoseFilter<double>>("paper", r, c, runs);
      study<antipode::RichPoseFilter<double>>("degree-5 reweighting", r, c, runs);
      study<antipode::LinearizedPoseFilter<double>>("linearised", r, c, runs);
      study<antipode::QuadraticPoseFilter<double>>("quadratic (default)", r, c, runs);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "starry_night: %s\n", error.what());
    return 1;
  }
  return 0;
}
