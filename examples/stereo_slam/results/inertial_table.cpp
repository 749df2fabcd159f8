// SPDX-License-Identifier: MIT
#include "stereo_slam/results/inertial_table.hpp"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

constexpr int kNumbers = InertialEstimate::kNumbers;

/// The fields of a frame for which `number(i)` and `covariance(i, j)` return texts.
template <class Number, class Covariance>
void write_fields(std::ostream& stream, const Number& number, const Covariance& covariance) {
  for (int i = 0; i < kNumbers; ++i) stream << ',' << number(i);
  for (int i = 0; i < kNumbers; ++i) {
    for (int j = i; j < kNumbers; ++j) stream << ',' << covariance(i, j);
  }
  stream << '\n';
}

void write_row(std::ostream& stream, const FrameResult& result) {
  const InertialEstimate& estimate = result.inertial;
  const bool known = estimate.phase == InertialPhase::kRunning;
  antipode::Vector<double, kNumbers> numbers;
  numbers << estimate.velocity, estimate.gravity, estimate.biases, estimate.delay_s;
  const auto text = [&](double value) { return known ? fmt::format("{:.9g}", value) : std::string(); };
  fmt::print(stream, "{},{}", format_seconds(result.stamp_ns), to_string(estimate.phase));
  write_fields(
      stream, [&](int i) { return text(numbers[i]); },
      [&](int i, int j) { return text(estimate.covariance(i, j)); });
}

}  // namespace

void write_inertial(std::ostream& stream, std::span<const FrameResult> results) {
  constexpr const char* kNames[kNumbers] = {"vx_m_s",   "vy_m_s",    "vz_m_s",    "gx_m_s2",   "gy_m_s2",
                                            "gz_m_s2",  "bwx_rad_s", "bwy_rad_s", "bwz_rad_s", "bax_m_s2",
                                            "bay_m_s2", "baz_m_s2",  "delay_s"};
  stream << "stamp_s,phase";
  write_fields(
      stream, [&](int i) { return kNames[i]; }, [](int i, int j) { return fmt::format("p_{}_{}", i, j); });
  for (const auto& result : results) write_row(stream, result);
}

}  // namespace stereo_slam
