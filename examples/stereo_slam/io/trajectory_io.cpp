// SPDX-License-Identifier: MIT
#include "stereo_slam/io/trajectory_io.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/position_digits.hpp"
#include "stereo_slam/io/stamp_unit.hpp"
#include "stereo_slam/io/table_row.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_layout.hpp"

namespace stereo_slam {
namespace {

void check_position(const Eigen::Vector3d& t) {
  constexpr double kFarthest_m = 1e9;  // larger values are not metres, and computations may overflow
  if (!(t.cwiseAbs().maxCoeff() <= kFarthest_m)) {
    throw std::runtime_error(
        fmt::format("the position is {:.3g} m away; positions are in metres, up to {:.0e}",
                    t.cwiseAbs().maxCoeff(), kFarthest_m));
  }
}

Eigen::Isometry3d pose_from_matrix(const Eigen::Matrix<double, 3, 4>& matrix) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.affine() = matrix;
  check_position(T.translation());
  if (!is_rotation(T.linear())) throw std::runtime_error("the left 3x3 block is not a rotation matrix");
  return T;
}

Eigen::Isometry3d pose_from_quaternion(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) {
  if (!(std::abs(q.norm() - 1.0) <= kRotationTolerance)) {
    throw std::runtime_error(fmt::format("the quaternion has length {:.6g}, not 1", q.norm()));
  }
  check_position(t);
  return Eigen::Translation3d(t) * q.normalized();
}

using Fields = std::vector<std::string_view>;

double number_of(std::string_view field) {
  const auto numbers = parse_numbers(field);
  if (!numbers || numbers->size() != 1)
    throw std::runtime_error(fmt::format("'{}' is not a finite number", field));
  return numbers->front();
}

long double stamp_of(std::string_view field) {
  if (const auto stamp = parse_stamp(field)) return *stamp;
  throw std::runtime_error(fmt::format("'{}' is not a stamp in numbers", field));
}

bool is_whole(std::string_view field) {
  return !field.empty() && field.find_first_not_of("+-0123456789") == std::string_view::npos;
}

/// The stamps of a file, or the numbers of its frames, as they are written.
struct WrittenStamps {
  std::vector<long double> values;
  std::vector<long double> nanoseconds;  ///< after the values, in a column of their own
  bool whole = true;
};

void append_stamp(WrittenStamps& stamps, const TrajectoryLayout& layout, const Fields& fields) {
  const std::size_t column = layout.columns ? layout.columns->stamp : 0;
  const long double value = stamp_of(fields[column]);
  if (!stamps.values.empty() && value < stamps.values.back()) {
    throw std::runtime_error(fmt::format(
        "stamp {} is earlier than the one before; sort the lines by their stamps", fields[column]));
  }
  stamps.values.push_back(value);
  stamps.whole = stamps.whole && is_whole(fields[column]);
  if (layout.columns && layout.columns->nanoseconds)
    stamps.nanoseconds.push_back(stamp_of(fields[*layout.columns->nanoseconds]));
}

/// The pose of a row.
Eigen::Isometry3d pose_of(const TrajectoryLayout& layout, const Fields& fields) {
  if (layout.columns) {
    const auto& [x, y, z] = layout.columns->position;
    const auto& [qw, qx, qy, qz] = layout.columns->quaternion;
    const auto n = [&](std::size_t column) { return number_of(fields[column]); };
    return pose_from_quaternion({n(qw), n(qx), n(qy), n(qz)}, {n(x), n(y), n(z)});
  }
  std::vector<double> numbers;
  for (const auto field : fields) numbers.push_back(field.empty() ? 0.0 : number_of(field));
  return pose_from_matrix(matrix_at(numbers, layout.matrix));
}

/// What is read from the rows besides the poses.
struct WrittenRows {
  WrittenStamps stamps;
  PositionDigits digits;
};

void append_row(Trajectory& trajectory, const TrajectoryLayout& layout, const std::string& text,
                WrittenRows& written) {
  refuse_decimal_commas(text);
  const Fields fields = split_row(text, layout.separator);
  if (fields.size() != layout.fields) {
    throw std::runtime_error(
        fmt::format("{}, but the first row has {}", counted(fields.size(), "field"), layout.fields));
  }
  trajectory.poses.push_back(pose_of(layout, fields));
  if (layout.columns || layout.matrix.first == 1) append_stamp(written.stamps, layout, fields);
  const auto [x, y, z] = position_columns(layout);
  written.digits.add({fields[x], fields[y], fields[z]});
}

/// Whether numbers in front of matrices count frames, and are no stamps.
bool are_frame_numbers(const TrajectoryLayout& layout, const WrittenStamps& stamps) {
  constexpr long double kMostFrames = kMostLines * 10.0L;
  if (stamps.values.empty()) return false;
  return !layout.columns && stamps.whole && stamps.values.front() >= 0.0L &&
         stamps.values.back() < kMostFrames &&
         std::ranges::adjacent_find(stamps.values, std::greater_equal<>()) == stamps.values.end();
}

/// Throws std::runtime_error if stamps decrease, or if most of them repeat the one before.
void check_stamps(const std::filesystem::path& file, const std::vector<std::int64_t>& stamps_ns) {
  if (!std::ranges::is_sorted(stamps_ns)) fail(file, "its stamps decrease; sort the lines by their stamps");
  std::size_t repeated = 0;
  for (std::size_t i = 1; i < stamps_ns.size(); ++i) repeated += stamps_ns[i] == stamps_ns[i - 1] ? 1 : 0;
  if (2 * repeated <= stamps_ns.size()) return;
  fail(file, "{} of {} stamps are the same as the one before; write them with more digits", repeated,
       stamps_ns.size());
}

/// Converts the stamps to nanoseconds.
void set_stamps(const std::filesystem::path& file, const TrajectoryLayout& layout,
                const WrittenStamps& stamps, Trajectory& trajectory) {
  const bool nanoseconds = stamps.whole && (trajectory.format == TrajectoryFormat::kEuroc || !layout.columns);
  const auto usual = nanoseconds ? StampUnit::kNanoseconds : StampUnit::kSeconds;
  const auto expected = layout.columns ? layout.columns->unit.value_or(usual) : usual;
  const bool divided = !stamps.nanoseconds.empty();
  const auto unit = divided ? StampUnit::kSeconds : unit_of_stamps(stamps.values, expected);
  if (!divided && unit != expected)
    trajectory.remarks.push_back(fmt::format("its stamps are taken as {}, by their size", to_string(unit)));
  for (std::size_t i = 0; i < stamps.values.size(); ++i) {
    auto stamp_ns = to_nanoseconds(stamps.values[i], unit);
    if (stamp_ns && divided) {
      const long double sum_ns = static_cast<long double>(*stamp_ns) + stamps.nanoseconds[i];
      stamp_ns = to_nanoseconds(sum_ns, StampUnit::kNanoseconds);
    }
    if (!stamp_ns) {
      fail(file, "pose {} has the stamp {} in {}; more than 126 years before or after 1970", i + 1,
           static_cast<double>(stamps.values[i]), to_string(unit));
    }
    trajectory.stamps_ns.push_back(*stamp_ns);
  }
  check_stamps(file, trajectory.stamps_ns);
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
  const auto lines = divide_lines(read_text_lines(file, Comments::kKept));
  if (lines.rows.empty()) fail(file, "contains no poses");
  require_whole_last_line(file, lines.rows);
  Trajectory trajectory;
  const TrajectoryLayout layout = layout_of(file, lines, format);
  WrittenRows written;
  trajectory.poses.reserve(lines.rows.size());
  int number = lines.rows.front().number;
  try {
    for (const auto& line : lines.rows) {
      number = line.number;
      append_row(trajectory, layout, line.text, written);
    }
  } catch (const std::runtime_error& error) {
    fail_at(file, number, error.what());
  }
  trajectory.format = layout.format;
  trajectory.remarks = layout.remarks;
  if (const auto remark = written.digits.remark(trajectory.poses)) trajectory.remarks.push_back(*remark);
  const WrittenStamps& stamps = written.stamps;
  if (are_frame_numbers(layout, stamps)) {
    trajectory.frames.assign(stamps.values.begin(), stamps.values.end());
    trajectory.remarks.emplace_back("its first column is taken as the number of the frame");
  } else if (!stamps.values.empty()) {
    set_stamps(file, layout, stamps, trajectory);
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
