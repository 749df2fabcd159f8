// SPDX-License-Identifier: MIT
#include "simulator/recording/imu.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "simulator/textures/random.hpp"
#include "simulator/world/path_spline.hpp"

namespace stereo_slam::simulator {
namespace {

void require_between(double least, double value, double most, const char* name) {
  if (!(value >= least && value <= most)) {
    throw std::invalid_argument(fmt::format("imu.{} must be in [{}, {}], not {}", name, least, most, value));
  }
}

Eigen::Vector3d normal(Random& random, double sigma) {
  Eigen::Vector3d v;
  for (double& entry : v) entry = sigma * random.normal() + 0.0;  // never -0, which files would show
  return v;
}

}  // namespace

void validate(const ImuSettings& settings) {
  require_between(10.0, settings.rate_hz, 10'000.0, "rate_hz");
  require_between(0.0, settings.gyroscope_noise, 1.0, "gyroscope_noise");
  require_between(0.0, settings.accelerometer_noise, 10.0, "accelerometer_noise");
  require_between(0.0, settings.gyroscope_walk, 1.0, "gyroscope_walk");
  require_between(0.0, settings.accelerometer_walk, 10.0, "accelerometer_walk");
  require_between(0.0, settings.gyroscope_bias, 1.0, "gyroscope_bias");
  require_between(0.0, settings.accelerometer_bias, 10.0, "accelerometer_bias");
  constexpr double kUnlimited = std::numeric_limits<double>::infinity();
  require_between(1e-3, settings.gyroscope_range, kUnlimited, "gyroscope_range");
  require_between(1e-3, settings.accelerometer_range, kUnlimited, "accelerometer_range");
  require_between(-1.0, settings.delay_s, 1.0, "delay_s");
}

std::vector<ImuReading> imu_readings(const CameraPath& path, double fps, const ImuSettings& settings,
                                     std::uint64_t seed) {
  const PathSpline spline(path, fps);
  const Eigen::Vector3d gravity(0.0, ImuSettings::kGravity, 0.0);
  constexpr std::uint64_t kStream = 900;  // of the random numbers; those of the images begin at 1000
  Random random(seed, kStream);
  Eigen::Vector3d gyroscope_bias = normal(random, settings.gyroscope_bias);
  Eigen::Vector3d accelerometer_bias = normal(random, settings.accelerometer_bias);
  const double root_rate = std::sqrt(settings.rate_hz);
  const auto count = static_cast<std::size_t>(std::floor(spline.duration_s() * settings.rate_hz + 1e-6)) + 1;
  std::vector<ImuReading> readings;
  readings.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double time_s = static_cast<double>(i) / settings.rate_hz;
    const BodyMotion motion = spline.at(time_s);
    const Eigen::Vector3d force = motion.T_world_body.linear().transpose() * (motion.acceleration - gravity);
    const Eigen::Vector3d w =
        motion.angular_velocity + gyroscope_bias + normal(random, settings.gyroscope_noise * root_rate);
    const Eigen::Vector3d a =
        force + accelerometer_bias + normal(random, settings.accelerometer_noise * root_rate);
    const double w_most = settings.gyroscope_range, a_most = settings.accelerometer_range;
    readings.push_back({time_s, w.cwiseMax(-w_most).cwiseMin(w_most), a.cwiseMax(-a_most).cwiseMin(a_most),
                        gyroscope_bias, accelerometer_bias});
    gyroscope_bias += normal(random, settings.gyroscope_walk / root_rate);
    accelerometer_bias += normal(random, settings.accelerometer_walk / root_rate);
  }
  return readings;
}

std::vector<ImuTruth> imu_truth(const CameraPath& path, double fps, const std::vector<ImuReading>& readings,
                                const ImuSettings& settings) {
  const PathSpline spline(path, fps);
  std::vector<ImuTruth> truth;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double time_s = static_cast<double>(i) / fps;
    const auto nearest = static_cast<std::size_t>(std::lround(time_s * settings.rate_hz));
    const ImuReading& reading = readings.at(std::min(nearest, readings.size() - 1));
    truth.push_back({spline.at(time_s).velocity, reading.gyroscope_bias, reading.accelerometer_bias});
  }
  return truth;
}

void write_imu_truth(std::ostream& stream, const std::vector<ImuTruth>& truth) {
  fmt::print(stream, "frame,vx_m_s,vy_m_s,vz_m_s,bwx_rad_s,bwy_rad_s,bwz_rad_s,bax_m_s2,bay_m_s2,baz_m_s2\n");
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const auto& [v, bw, ba] = truth[i];
    fmt::print(stream, "{},{},{},{},{},{},{},{},{},{}\n", i, v.x(), v.y(), v.z(), bw.x(), bw.y(), bw.z(),
               ba.x(), ba.y(), ba.z());
  }
}

void write_imu_rows(std::ostream& stream, const std::vector<ImuReading>& readings,
                    const ImuSettings& settings, std::int64_t begin_ns) {
  fmt::print(stream,
             "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],"
             "a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n");
  for (const ImuReading& reading : readings) {
    const Eigen::Vector3d &w = reading.angular_velocity, &a = reading.specific_force;
    fmt::print(stream, "{},{},{},{},{},{},{}\n",
               begin_ns + std::llround(1e9 * (reading.time_s + settings.delay_s)), w.x(), w.y(), w.z(), a.x(),
               a.y(), a.z());
  }
}

void write_imu_sensor(std::ostream& stream, const ImuSettings& settings) {
  fmt::print(
      stream,
      "sensor_type: imu\ncomment: simulated\nT_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: {}\n"
      "gyroscope_noise_density: {}  # rad/s/sqrt(Hz)\ngyroscope_random_walk: {}  # rad/s^2/sqrt(Hz)\n"
      "accelerometer_noise_density: {}  # m/s^2/sqrt(Hz)\naccelerometer_random_walk: {}  # m/s^3/sqrt(Hz)\n",
      settings.rate_hz, settings.gyroscope_noise, settings.gyroscope_walk, settings.accelerometer_noise,
      settings.accelerometer_walk);
}

}  // namespace stereo_slam::simulator
