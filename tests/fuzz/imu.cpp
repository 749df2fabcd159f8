// SPDX-License-Identifier: MIT
// The readers of an IMU's samples and of its description.
#include <cmath>

#include "fuzz/fuzz_files.hpp"
#include "fuzz/fuzz_target.hpp"
#include "stereo_slam/imu/imu_description.hpp"
#include "stereo_slam/imu/imu_samples_file.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace antipode::fuzz {
namespace {

using namespace stereo_slam;

/// Samples whose stamps increase, plausible each, and none but those of the rows.
void imu_csv(Bytes bytes) {
  const auto file = folder().write("imu.csv", bytes);
  attempt_to_read([&] {
    const auto [samples, faults] = read_imu_samples(file);
    require(samples.size() >= 2, "fewer than two samples");
    require(samples.size() + faults.unreadable + faults.repeated + faults.saturated == faults.records,
            "a row that is neither a sample nor counted");
    for (std::size_t i = 0; i < samples.size(); ++i) {
      require(is_plausible(samples[i]), "no reading of a sensor");
      require(std::abs(samples[i].stamp_ns) <= kLatestStamp_ns, "a stamp that wraps");
      require(i == 0 || samples[i - 1].stamp_ns < samples[i].stamp_ns, "stamps do not increase");
    }
    require((faults.gaps == 0) == (faults.longest_gap_ns == 0), "a gap without a length");
    (void)faults.texts();
  });
}

void imu_yaml(Bytes bytes) {
  const auto file = folder().write("imu.yaml", bytes);
  attempt_to_read([&] {
    const ImuDescription description = read_imu_description(file);
    const auto is_density = [](double value) { return std::isfinite(value) && value > 0.0; };
    require(is_density(description.noise.gyroscope) && is_density(description.noise.accelerometer) &&
                is_density(description.noise.gyroscope_bias_walk) &&
                is_density(description.noise.accelerometer_bias_walk),
            "no density of noise");
    require(!description.T_body_imu || description.T_body_imu->matrix().allFinite(), "a pose is not finite");
  });
}

}  // namespace

std::vector<Target> imu_targets() { return {{"imu_csv", imu_csv}, {"imu_yaml", imu_yaml}}; }

}  // namespace antipode::fuzz
