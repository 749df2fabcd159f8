// SPDX-License-Identifier: MIT
#include "stereo_slam/io/trajectory_io.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

/// Largest deviation of R R' from the identity, or of a quaternion's norm from 1; admits files with three
/// digits.
constexpr double kRotationTolerance = 1e-2;

void check_position(const Eigen::Vector3d& t) {
  constexpr double kFarthest_m = 1e9;  // larger values are not metres, and computations may overflow
  if (!(t.cwiseAbs().maxCoeff() <= kFarthest_m)) {
    throw std::runtime_error(
        fmt::format("the position is {:.3g} m away; positions are in metres, up to {:.0e}",
                    t.cwiseAbs().maxCoeff(), kFarthest_m));
  }
}

Eigen::Isometry3d pose_from_matrix(std::span<const double> row_major_3x4) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.affine() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(row_major_3x4.data());
  check_position(T.translation());
  const Eigen::Matrix3d R = T.linear();
  const double defect = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(defect <= kRotationTolerance) || R.determinant() < 0.0) {
    throw std::runtime_error("the left 3x3 block is not a rotation matrix");
  }
  return T;
}

Eigen::Isometry3d pose_from_quaternion(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) {
  if (!(std::abs(q.norm() - 1.0) <= kRotationTolerance)) {
    throw std::runtime_error(fmt::format("the quaternion has length {:.6g}, not 1", q.norm()));
  }
  check_position(t);
  return Eigen::Translation3d(t) * q.normalized();
}

std::size_t columns(TrajectoryFormat format) { return format == TrajectoryFormat::kKitti ? 12 : 8; }

TrajectoryFormat detect_format(const std::string& line) {
  const auto count = split_fields(line).size();
  const bool commas = line.find(',') != std::string::npos;
  const auto numbers = parse_numbers(line);
  const bool begins_with_stamp = commas && numbers && std::abs(numbers->front()) > 2.0;
  if (count == 12 && !begins_with_stamp) return TrajectoryFormat::kKitti;
  if (commas && count >= 8) return TrajectoryFormat::kEuroc;
  if (count == 8) return TrajectoryFormat::kTum;
  throw std::runtime_error(
      fmt::format("{} fields are neither KITTI (12), TUM (8) nor EuRoC (8 or more, commas)", count));
}

std::int64_t parse_stamp(TrajectoryFormat format, std::string_view field) {
  if (format == TrajectoryFormat::kTum) {
    if (const auto stamp_ns = parse_seconds(field)) return *stamp_ns;
    throw std::runtime_error(fmt::format("'{}' is not a stamp in seconds", field));
  }
  if (const auto stamp_ns = parse_nanoseconds(field)) return *stamp_ns;
  throw std::runtime_error(fmt::format("'{}' is not a stamp in whole nanoseconds", field));
}

/// Whether numbers of a line have decimal commas: there are commas between digits, and blanks without a comma
/// between fields.
bool has_decimal_commas(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  constexpr std::string_view kDigits = "0123456789";
  const auto is_one_of = [&](std::size_t at, std::string_view characters) {
    return at < text.size() && characters.find(text[at]) != std::string_view::npos;
  };
  bool comma = false;
  bool blank = false;
  for (std::size_t i = 1; i < text.size(); ++i) {
    const bool after_digit = is_one_of(i - 1, kDigits);
    comma = comma || (text[i] == ',' && after_digit && is_one_of(i + 1, kDigits));
    if (!after_digit || !is_one_of(i, kBlanks)) continue;
    const auto next = text.find_first_not_of(kBlanks, i);
    blank = blank || (next != std::string_view::npos && text[next] != ',' && text[next] != '\r');
  }
  return comma && blank;
}

/// The numbers of a line. Throws std::runtime_error if a field is none.
std::vector<double> numbers_of(const std::string& text) {
  if (auto numbers = parse_numbers(text)) return std::move(*numbers);
  const auto fields = split_fields(text);
  const auto wrong =
      std::find_if(fields.begin(), fields.end(), [](auto field) { return !parse_numbers(field); });
  throw std::runtime_error(fmt::format("'{}' is not a finite number", *wrong));
}

void append_line(Trajectory& trajectory, const std::string& text) {
  if (has_decimal_commas(text))
    throw std::runtime_error("its numbers have decimal commas; write them with decimal points");
  const auto fields = split_fields(text);
  const auto wanted = columns(trajectory.format);
  const bool more_may_follow = trajectory.format == TrajectoryFormat::kEuroc;
  if (fields.size() < wanted || (fields.size() > wanted && !more_may_follow)) {
    throw std::runtime_error(
        fmt::format("{} fields, but {} has {}", fields.size(), to_string(trajectory.format), wanted));
  }
  const std::vector<double> n = numbers_of(text);
  if (trajectory.format == TrajectoryFormat::kKitti) {
    trajectory.poses.push_back(pose_from_matrix(n));
    return;
  }
  const auto stamp_ns = parse_stamp(trajectory.format, fields[0]);
  if (!trajectory.stamps_ns.empty() && stamp_ns < trajectory.stamps_ns.back()) {
    throw std::runtime_error(fmt::format("stamp {} is earlier than the one before", fields[0]));
  }
  const bool scalar_first = trajectory.format == TrajectoryFormat::kEuroc;
  const auto q =
      scalar_first ? Eigen::Quaterniond(n[4], n[5], n[6], n[7]) : Eigen::Quaterniond(n[7], n[4], n[5], n[6]);
  trajectory.poses.push_back(pose_from_quaternion(q, {n[1], n[2], n[3]}));
  trajectory.stamps_ns.push_back(stamp_ns);
}

}  // namespace

std::string_view to_string(TrajectoryFormat format) noexcept {
  switch (format) {
    case TrajectoryFormat::kKitti:
      return "KITTI";
    case TrajectoryFormat::kTum:
      return "TUM";
    case TrajectoryFormat::kEuroc:
      return "EuRoC";
  }
  return "unknown";
}

Trajectory read_trajectory(const std::filesystem::path& file, std::optional<TrajectoryFormat> format) {
  const auto lines = read_text_lines(file);
  if (lines.empty()) throw std::runtime_error(fmt::format("{}: contains no poses", file.string()));
  require_line_end(file, lines);
  Trajectory trajectory;
  trajectory.poses.reserve(lines.size());
  int number = lines.front().number;
  try {
    trajectory.format = format ? *format : detect_format(lines.front().text);
    for (const auto& line : lines) {
      number = line.number;
      append_line(trajectory, line.text);
    }
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(at_line(file, number, error.what()));
  }
  return trajectory;
}

void write_kitti_trajectory(std::ostream& stream, std::span<const Pose> poses) {
  for (const auto& pose : poses) {
    const Matrix3<double> R = pose.rotation_matrix();
    const Vector3<double> t = pose.translation();
    for (int row = 0; row < 3; ++row) {
      fmt::print(stream, "{}{:.12g} {:.12g} {:.12g} {:.12g}", row == 0 ? "" : " ", R(row, 0), R(row, 1),
                 R(row, 2), t[row]);
    }
    stream << '\n';
  }
}

void write_tum_trajectory(std::ostream& stream, std::span<const std::int64_t> stamps_ns,
                          std::span<const Pose> poses) {
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Vector3<double> t = poses[i].translation();
    const antipode::Vector4<double> q = antipode::canonical(poses[i].rotation());
    fmt::print(stream, "{} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g}\n",
               format_seconds(stamps_ns[i]), t[0], t[1], t[2], q[1], q[2], q[3], q[0]);
  }
}

}  // namespace stereo_slam
