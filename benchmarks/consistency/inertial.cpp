// SPDX-License-Identifier: MIT
//
// A real IMU against the ground truth of its recording (EuRoC layout, with velocities and biases): how large
// its noise is, and whether predictions over given times are as wrong as their covariance says. Prints
// Markdown tables.
//
//   consistency_inertial MH_05_difficult/mav0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <iostream>
#include <limits>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <antipode/detail/cholesky.hpp>
#include <antipode/sensors/inertial_propagation.hpp>

namespace {

using namespace antipode;
using Sample = ImuSample<double>;
using Navigation = ExtendedPose<double, 3>;

/// A row of state_groundtruth_estimate0/data.csv.
struct Truth {
  std::int64_t stamp_ns = 0;
  Navigation state;
  Vector6<double> biases = Vector6<double>::Zero();
};

/// The numbers of a CSV file with `columns` columns and one line of heading: stamps, and the others.
[[nodiscard]] std::vector<std::pair<std::int64_t, std::vector<double>>> read_csv(const std::string& path,
                                                                                 std::size_t columns) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::vector<std::pair<std::int64_t, std::vector<double>>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::string field;
    std::getline(fields, field, ',');
    const std::int64_t stamp_ns = std::stoll(field);
    std::vector<double> numbers;
    while (std::getline(fields, field, ',')) numbers.push_back(std::stod(field));
    if (numbers.size() + 1 < columns)
      throw std::runtime_error(path + " has a row with too few numbers: " + line);
    rows.emplace_back(stamp_ns, std::move(numbers));
  }
  return rows;
}

[[nodiscard]] std::vector<Sample> read_samples(const std::string& folder) {
  std::vector<Sample> samples;
  for (const auto& [stamp_ns, n] : read_csv(folder + "/imu0/data.csv", 7)) {
    samples.push_back({stamp_ns, {n[0], n[1], n[2]}, {n[3], n[4], n[5]}});
  }
  return samples;
}

[[nodiscard]] std::vector<Truth> read_truth(const std::string& folder) {
  std::vector<Truth> rows;
  for (const auto& [stamp_ns, n] : read_csv(folder + "/state_groundtruth_estimate0/data.csv", 17)) {
    Truth row{.stamp_ns = stamp_ns, .state = {}, .biases = {}};
    row.state.pose = DualQuaternion<double>::from_rotation_translation(
        Vector4<double>(n[3], n[4], n[5], n[6]).normalized(), Vector3<double>(n[0], n[1], n[2]));
    row.state.velocity = Vector3<double>(n[7], n[8], n[9]);
    row.state.vectors = Vector3<double>(0, 0, -9.81);
    row.biases << n[10], n[11], n[12], n[13], n[14], n[15];
    rows.push_back(row);
  }
  return rows;
}

/// What predictions miss over one duration: of phi [rad], nu [m/s] and rho [m].
struct Misses {
  int count = 0;
  std::array<double, 3> squares{};  ///< sums over the predictions
  std::array<double, 3> nees{};     ///< likewise, of each part alone: 3 on average if the covariance is right

  [[nodiscard]] double rms(std::size_t part) const { return std::sqrt(squares[part] / (3 * count)); }
  [[nodiscard]] double mean_nees(std::size_t part) const { return nees[part] / count; }
};

/// Predictions from the true state and biases over one duration after the other.
[[nodiscard]] Misses predict(const std::vector<Sample>& samples, const std::vector<Truth>& truth,
                             double duration_s, const ImuNoise<double>& noise) {
  constexpr std::int64_t kStampError_ns = 1000;
  const auto duration_ns = static_cast<std::int64_t>(std::llround(1e9 * duration_s));
  Misses misses;
  std::size_t first = 0;
  for (std::size_t from = 0, to = 0; to < truth.size(); from = to) {
    const std::int64_t begin_ns = truth[from].stamp_ns;
    while (to < truth.size() && truth[to].stamp_ns < begin_ns + duration_ns - kStampError_ns) ++to;
    if (to == truth.size()) break;
    while (first + 1 < samples.size() && samples[first + 1].stamp_ns <= begin_ns) ++first;
    const auto motion = integrate_imu(std::span(samples).subspan(first), {begin_ns, truth[to].stamp_ns},
                                      truth[from].biases, noise, {.max_gap_s = 1.0});
    const auto error = truth[to].state.boxminus(motion(truth[from].state));
    for (std::size_t part = 0; part < 3; ++part) {
      const int row = 3 * static_cast<int>(part);
      const Vector3<double> e = error.segment<3>(row);
      const auto L = detail::cholesky_factor<double, 3>(motion.noise.block<3, 3>(row, row));
      if (!L) throw std::runtime_error("the covariance of a prediction is singular");
      misses.squares[part] += e.squaredNorm();
      misses.nees[part] += detail::solve_lower<double, 3, 1>(*L, e).squaredNorm();
    }
    ++misses.count;
  }
  return misses;
}

/// Allan deviation over one sampling interval, as a density, of the quietest second: of gyroscope and
/// accelerometer.
[[nodiscard]] std::array<double, 2> densities_at_rest(const std::vector<Sample>& samples, double interval_s) {
  const auto second = static_cast<std::size_t>(std::lround(1.0 / interval_s));
  std::array<double, 2> least{std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::infinity()};
  for (std::size_t begin = 0; begin + second < samples.size(); begin += second) {
    std::array<double, 2> sum{};
    for (std::size_t i = begin; i < begin + second; ++i) {
      sum[0] += (samples[i + 1].angular_velocity - samples[i].angular_velocity).squaredNorm();
      sum[1] += (samples[i + 1].specific_force - samples[i].specific_force).squaredNorm();
    }
    for (std::size_t k = 0; k < 2; ++k) {
      least[k] = std::min(least[k], std::sqrt(sum[k] / (6.0 * static_cast<double>(second)) * interval_s));
    }
  }
  return least;
}

constexpr std::array kDurations_s{0.005, 0.02, 0.05, 0.2, 0.5, 1.0, 2.0, 5.0};

void print_densities(const std::vector<Sample>& samples, const std::vector<Truth>& truth) {
  std::printf(
      "Misses as densities, rms / sqrt(duration):\n\n| duration, s | phi, rad/s/sqrt(Hz) | "
      "nu, m/s^2/sqrt(Hz) | rho, m/sqrt(s) |\n|---|---|---|---|\n");
  for (const double duration_s : kDurations_s) {
    const Misses m = predict(samples, truth, duration_s, {1e-4, 1e-3, 1e-5, 1e-4});
    const double root = std::sqrt(duration_s);
    std::printf("| %g | %.2e | %.4f | %.4f |\n", duration_s, m.rms(0) / root, m.rms(1) / root,
                m.rms(2) / root);
  }
}

void print_nees(const char* name, const ImuNoise<double>& noise, const std::vector<Sample>& samples,
                const std::vector<Truth>& truth) {
  std::printf(
      "\nNEES with %s (3 each if the covariance is right):\n\n| duration, s | predictions | phi | nu | rho "
      "|\n|---|---|---|---|---|\n",
      name);
  for (const double duration_s : {0.05, 0.5, 2.0}) {
    const Misses m = predict(samples, truth, duration_s, noise);
    std::printf("| %g | %d | %.2f | %.2f | %.2f |\n", duration_s, m.count, m.mean_nees(0), m.mean_nees(1),
                m.mean_nees(2));
  }
}

/// How wrong a prediction through a gap is, in which the readings are interpolated.
void print_gaps(const std::vector<Sample>& samples, const std::vector<Truth>& truth) {
  std::printf("\nPredictions through a gap, rms:\n\n| gap, ms | phi, mrad | nu, m/s |\n|---|---|---|\n");
  for (const std::size_t every : {1U, 2U, 4U, 6U, 10U, 20U, 40U}) {
    std::vector<Sample> kept;
    for (std::size_t i = 0; i < samples.size(); i += every) kept.push_back(samples[i]);
    const double gap_s = 0.005 * static_cast<double>(every);
    const Misses m = predict(kept, truth, gap_s, {1e-4, 1e-3, 1e-5, 1e-4});
    std::printf("| %g | %.2f | %.3f |\n", 1e3 * gap_s, 1e3 * m.rms(0), m.rms(1));
  }
}

void study(const std::string& folder) {
  const auto samples = read_samples(folder);
  const auto truth = read_truth(folder);
  const auto [gyroscope, accelerometer] = densities_at_rest(samples, 0.005);
  std::printf(
      "Densities of the quietest second: gyroscope %.2e rad/s/sqrt(Hz), accelerometer %.2e "
      "m/s^2/sqrt(Hz)\n\n",
      gyroscope, accelerometer);
  print_densities(samples, truth);
  print_nees("the densities of the data sheet", {1.6968e-4, 2e-3, 1.9393e-5, 3e-3}, samples, truth);
  print_nees("the densities of this flight", {1.7e-4, 0.029, 1.2e-4, 3e-3}, samples, truth);
  print_gaps(samples, truth);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr
        << "usage: consistency_inertial MAV0   (the folder with imu0 and state_groundtruth_estimate0)\n";
    return EXIT_FAILURE;
  }
  try {
    study(argv[1]);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return EXIT_FAILURE;
  }
}
