// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/kitti_oxts.hpp"

#include <cmath>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/stamps/calendar.hpp"

namespace stereo_slam {
namespace {

/// The first six numbers of a packet.
struct OxtsPacket {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double yaw_rad = 0.0;
};

OxtsPacket read_packet(const std::filesystem::path& file) {
  constexpr std::size_t kNeeded = 6;
  constexpr double kMostLatitude_deg = 85.0;  // of a Mercator projection
  constexpr double kMostLongitude_deg = 360.0;
  constexpr double kMostAltitude_m = 1e5;
  const auto lines = read_text_lines(file);
  const auto numbers = lines.empty() ? std::nullopt : parse_numbers(lines.front().text);
  if (!numbers || numbers->size() < kNeeded)
    fail(file, "is no packet of the OXTS: 30 numbers, of which the first are lat lon alt roll pitch yaw");
  const auto& n = *numbers;
  if (!(std::abs(n[0]) <= kMostLatitude_deg && std::abs(n[1]) <= kMostLongitude_deg &&
        std::abs(n[2]) <= kMostAltitude_m))
    fail(file, "has the position {} deg, {} deg, {} m, which is none on a road", n[0], n[1], n[2]);
  return {n[0], n[1], n[2], n[3], n[4], n[5]};
}

/// `scale` is the cosine of the first latitude.
Eigen::Isometry3d pose_of(const OxtsPacket& packet, double scale) {
  constexpr double kEarthRadius_m = 6378137.0;
  constexpr double kPi = std::numbers::pi;
  const double x_m = scale * kEarthRadius_m * packet.longitude_deg * kPi / 180.0;
  const double y_m = scale * kEarthRadius_m * std::log(std::tan((90.0 + packet.latitude_deg) * kPi / 360.0));
  Eigen::Isometry3d T_earth_imu = Eigen::Isometry3d::Identity();
  T_earth_imu.translation() << x_m, y_m, packet.altitude_m;
  T_earth_imu.linear() = (Eigen::AngleAxisd(packet.yaw_rad, Eigen::Vector3d::UnitZ()) *
                          Eigen::AngleAxisd(packet.pitch_rad, Eigen::Vector3d::UnitY()) *
                          Eigen::AngleAxisd(packet.roll_rad, Eigen::Vector3d::UnitX()))
                             .toRotationMatrix();
  return T_earth_imu;
}

}  // namespace

std::optional<std::int64_t> stamp_of_date(std::string_view text) {
  constexpr std::string_view kPattern = "0000-00-00 00:00:00";
  constexpr std::size_t kDecimals = 9;
  constexpr std::string_view kDigits = "0123456789";
  if (text.size() < kPattern.size()) return std::nullopt;
  std::string digits;
  for (std::size_t i = 0; i < kPattern.size(); ++i) {
    const bool is_digit = kDigits.find(text[i]) != std::string_view::npos;
    if (is_digit != (kPattern[i] == '0') || (!is_digit && text[i] != kPattern[i])) return std::nullopt;
    if (is_digit) digits += text[i];
  }
  const auto seconds = seconds_of_date(digits);
  std::string_view fraction = text.substr(kPattern.size());
  if (!fraction.empty()) fraction.remove_prefix(1);
  const bool has_point = text.size() == kPattern.size() || text[kPattern.size()] == '.';
  if (!seconds || !has_point || fraction.find_first_not_of(kDigits) != std::string_view::npos)
    return std::nullopt;
  std::int64_t nanoseconds = 0;
  for (std::size_t i = 0; i < kDecimals; ++i)
    nanoseconds = 10 * nanoseconds + (i < fraction.size() ? fraction[i] - '0' : 0);
  return *seconds * 1'000'000'000 + nanoseconds;
}

std::map<std::size_t, std::int64_t> read_kitti_stamps(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) fail(file, "missing; it holds the date and time of one image a line");
  std::map<std::size_t, std::int64_t> stamps_ns;
  for (const auto& line : read_text_lines(file)) {
    const auto last = line.text.find_last_not_of(" \t");
    const auto stamp_ns = stamp_of_date(std::string_view(line.text).substr(0, last + 1));
    if (!stamp_ns) {
      fail_at(file, line.number, "'{}' is no date and time such as 2011-09-26 13:02:25.964389445", line.text);
    }
    stamps_ns[static_cast<std::size_t>(line.number) - 1] = *stamp_ns;
  }
  return stamps_ns;
}

OxtsPoses read_oxts(const std::filesystem::path& folder) {
  OxtsPoses poses;
  double scale = 0.0;
  Eigen::Isometry3d T_first_earth = Eigen::Isometry3d::Identity();
  for (const auto& [index, stamp_ns] : read_kitti_stamps(folder / "timestamps.txt")) {
    const auto file = folder / "data" / fmt::format("{:010}.txt", index);
    if (!std::filesystem::exists(file)) continue;  // a packet was lost
    if (!poses.stamps_ns.empty() && stamp_ns <= poses.stamps_ns.back()) {
      ++poses.out_of_order;
      continue;
    }
    const OxtsPacket packet = read_packet(file);
    if (scale == 0.0) {
      scale = std::cos(packet.latitude_deg * std::numbers::pi / 180.0);
      T_first_earth = pose_of(packet, scale).inverse();
    }
    poses.stamps_ns.push_back(stamp_ns);
    poses.T_world_imu.push_back(T_first_earth * pose_of(packet, scale));
  }
  if (poses.stamps_ns.empty()) fail(folder, "contains no packets data/0000000000.txt ... with a time");
  return poses;
}

}  // namespace stereo_slam
