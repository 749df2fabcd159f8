// SPDX-License-Identifier: MIT
#include "simulator/world/ride.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "simulator/textures/random.hpp"

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

/// Smooth random function of time with unit variance.
class Waves {
 public:
  explicit Waves(Random& random) {
    constexpr double kSlowest_Hz = 0.8;
    constexpr double kFastest_Hz = 3.0;
    constexpr double kBand_Hz = (kFastest_Hz - kSlowest_Hz) / kCount;
    for (std::size_t i = 0; i < kCount; ++i) {
      const double begin = kSlowest_Hz + kBand_Hz * static_cast<double>(i);
      waves_[i] = {random.uniform(begin, begin + kBand_Hz), random.uniform()};
    }
  }

  [[nodiscard]] double at(double time_s) const {
    double sum = 0.0;
    for (const auto& [frequency_Hz, phase] : waves_)
      sum += std::sin(2.0 * std::numbers::pi * (frequency_Hz * time_s + phase));
    return std::sqrt(2.0 / kCount) * sum;
  }

 private:
  static constexpr std::size_t kCount = 12;
  struct Wave {
    double frequency_Hz;
    double phase;  ///< in turns
  };
  std::array<Wave, kCount> waves_{};
};

}  // namespace

CameraPath on_bad_road(const CameraPath& path, const Ride& ride, double fps, std::uint64_t seed) {
  constexpr std::uint64_t kStream = 79;
  if (!(ride.bounce_m > 0.0)) return path;
  Random random(seed, kStream);
  const Waves bounce(random);
  const Waves pitch(random);
  const Waves roll(random);
  CameraPath result;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double time_s = static_cast<double>(i) / fps;
    result.push_back(path[i] * Eigen::Translation3d(0.0, ride.bounce_m * bounce.at(time_s), 0.0) *
                     Eigen::AngleAxisd(ride.pitch_rad() * pitch.at(time_s), Vector3d::UnitX()) *
                     Eigen::AngleAxisd(ride.roll_rad() * roll.at(time_s), Vector3d::UnitZ()));
  }
  return result;
}

}  // namespace stereo_slam::simulator
