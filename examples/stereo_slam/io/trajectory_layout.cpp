// SPDX-License-Identifier: MIT
#include "stereo_slam/io/trajectory_layout.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/table_row.hpp"

namespace stereo_slam {
namespace {

using Fields = std::vector<std::string_view>;

constexpr std::size_t kStampedFields = 8;

[[nodiscard]] bool is_comment(std::string_view text) {
  const auto first = text.find_first_not_of(" \t,");
  return first != std::string_view::npos && (text[first] == '#' || text[first] == '%');
}

[[nodiscard]] bool has_number(std::string_view text) {
  const Fields fields = split_row(text, separator_of(text));
  return std::ranges::any_of(fields, [](auto field) { return !field.empty() && parse_numbers(field); });
}

/// The names in a line of the head. Between blanks, a unit in brackets belongs to the name before it.
[[nodiscard]] Fields names_in(std::string_view text) {
  text.remove_prefix(std::min(text.size(), text.find_first_not_of(" \t#%")));
  char separator = separator_of(text);
  if (separator == ' ' && text.find('\t') != std::string_view::npos) separator = '\t';
  Fields names = split_row(text, separator);
  if (separator == ' ')
    std::erase_if(names, [](auto name) { return name.starts_with('[') || name.starts_with('('); });
  return names;
}

/// Whether a row with this many fields can have these names; other programs end a line with a separator.
[[nodiscard]] bool fits(const Fields& names, const Fields& fields, bool comment) {
  if (names.size() == fields.size()) return true;
  if (names.size() == fields.size() + 1) return names.back().empty();
  if (names.size() + 1 == fields.size() && fields.back().empty()) return true;
  return comment && names.size() < fields.size();
}

/// The numbers of the fields, and NaN where there is none.
[[nodiscard]] std::vector<double> numbers_or_nan(const Fields& fields) {
  std::vector<double> numbers;
  for (const auto field : fields) {
    const auto number = parse_numbers(field);
    numbers.push_back(number && number->size() == 1 ? number->front() : std::nan(""));
  }
  return numbers;
}

/// The columns of a row's matrix, if it contains a rotation.
[[nodiscard]] std::optional<MatrixColumns> find_matrix(const std::vector<double>& numbers) {
  for (const std::size_t first : {0U, 1U}) {
    for (const MatrixColumns columns :
         {MatrixColumns{first, 12, false}, MatrixColumns{first, 16, false}, MatrixColumns{first, 16, true}}) {
      if (numbers.size() != first + columns.count) continue;
      if (!is_rotation(matrix_at(numbers, columns).leftCols<3>())) continue;
      if (columns.count == 12) return columns;
      const auto at = [&](std::size_t i) { return numbers[first + i]; };
      const Eigen::Vector3d last = columns.by_columns ? Eigen::Vector3d(at(3), at(7), at(11))
                                                      : Eigen::Vector3d(at(12), at(13), at(14));
      if (last.isZero(0.0) && at(15) == 1.0) return columns;
    }
  }
  return std::nullopt;
}

[[nodiscard]] bool has_unit_quaternion(const std::vector<double>& numbers) {
  const Eigen::Vector4d q(numbers[4], numbers[5], numbers[6], numbers[7]);
  return std::abs(q.norm() - 1.0) <= kRotationTolerance;
}

constexpr std::string_view kHowToName = "name the columns in the first line: timestamp,tx,ty,tz,qx,qy,qz,qw";

/// What is wrong with the names of a pose's columns.
[[nodiscard]] std::string fault_of(const NamedColumns& named) {
  if (named.missing.empty())
    return fmt::format("the columns '{}' and '{}' may both be meant; leave out one of them", named.twice[0],
                       named.twice[1]);
  return fmt::format("no column is named '{}', nor by a name that is known for it; {}", named.missing,
                     kHowToName);
}

/// Takes the columns from the last line of the head that names all of them. Throws std::runtime_error if the
/// head's last line is no comment and names only some.
void use_names(const std::vector<TextLine>& head, const Fields& row, TrajectoryLayout& layout) {
  const bool matrix = find_matrix(numbers_or_nan(row)).has_value();
  for (std::size_t i = head.size(); i-- > 0;) {
    const std::string& text = head[i].text;
    const bool comment = is_comment(text);
    const Fields names = names_in(text);
    const NamedColumns named = find_pose_columns(names);
    if (named.columns && fits(names, row, comment)) {
      layout.columns = named.columns;
      layout.named = true;
      return;
    }
    if (comment && named.position && !named.columns && !matrix)
      layout.remarks.push_back("its names of columns are ignored: " + fault_of(named));
    if (comment || matrix) continue;
    if (!named.columns) throw std::runtime_error(fault_of(named));
    throw std::runtime_error(fmt::format("{} for the {} of the first row", counted(names.size(), "name"),
                                         counted(row.size(), "column")));
  }
}

/// The columns of a stamped pose without names. Throws std::runtime_error if there are none.
[[nodiscard]] PoseColumns stamped_columns(const std::vector<double>& numbers, bool scalar_first,
                                          TrajectoryLayout& layout) {
  const std::size_t count = numbers.size();
  if (count < kStampedFields || (count > kStampedFields && !has_unit_quaternion(numbers))) {
    throw std::runtime_error(
        fmt::format("{} neither KITTI (12), TUM (8) nor EuRoC (8 or more, commas); if each row is a pose, {}",
                    counted(count, "field is", "fields are"), kHowToName));
  }
  if (count > kStampedFields) {
    layout.remarks.push_back(
        fmt::format("{} columns without names; the first 8 are taken as stamp, position and quaternion, {}",
                    count, scalar_first ? "qw first" : "qw last"));
  }
  PoseColumns columns;
  if (!scalar_first) columns.quaternion = {7, 4, 5, 6};
  return columns;
}

/// The layout of a row without names.
void use_order(Fields row, std::optional<TrajectoryFormat> format, TrajectoryLayout& layout) {
  if (row.back().empty()) row.pop_back();  // some programs end a line with a separator
  const auto numbers = numbers_or_nan(row);
  const auto matrix = find_matrix(numbers);
  const bool twelve = numbers.size() == 12;
  const bool stamped = twelve && std::abs(numbers[0]) > 2.0 && has_unit_quaternion(numbers);
  const bool usual_kitti = twelve && !stamped && layout.separator == ' ';
  const bool kitti = format ? *format == TrajectoryFormat::kKitti : usual_kitti;
  const bool wrong = kitti ? !matrix && !twelve : format && (matrix || numbers.size() < kStampedFields);
  if (format && wrong) {
    throw std::runtime_error(fmt::format("{}, but {} has {}", counted(numbers.size(), "field"),
                                         to_string(*format), kitti ? 12 : kStampedFields));
  }
  if (matrix || kitti) {
    layout.matrix = matrix.value_or(MatrixColumns{});
    return;
  }
  const bool scalar_first = format ? *format == TrajectoryFormat::kEuroc : layout.separator != ' ';
  layout.columns = stamped_columns(numbers, scalar_first, layout);
}

}  // namespace

void refuse_decimal_commas(std::string_view row) {
  if (!has_decimal_commas(row)) return;
  throw std::runtime_error("its numbers have decimal commas; write them with decimal points");
}

bool is_rotation(const Eigen::Matrix3d& R) {
  const double defect = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  return defect <= kRotationTolerance && R.determinant() > 0.0;
}

Eigen::Matrix<double, 3, 4> matrix_at(const std::vector<double>& numbers, const MatrixColumns& columns) {
  const double* first = numbers.data() + columns.first;
  if (columns.by_columns) return Eigen::Map<const Eigen::Matrix4d>(first).topRows<3>();
  return Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(first);
}

std::array<std::size_t, 3> position_columns(const TrajectoryLayout& layout) {
  if (layout.columns) return layout.columns->position;
  const std::size_t first = layout.matrix.first;
  if (layout.matrix.by_columns) return {first + 12, first + 13, first + 14};
  return {first + 3, first + 7, first + 11};
}

TrajectoryLines divide_lines(std::vector<TextLine> lines) {
  TrajectoryLines divided;
  for (auto& line : lines) {
    const bool comment = is_comment(line.text);
    if (divided.rows.empty() && (comment || !has_number(line.text))) {
      divided.head.push_back(std::move(line));
    } else if (!comment) {
      divided.rows.push_back(std::move(line));
    }
  }
  return divided;
}

TrajectoryLayout layout_of(const std::filesystem::path& file, const TrajectoryLines& lines,
                           std::optional<TrajectoryFormat> format) {
  const std::string& text = lines.rows.front().text;
  int number = lines.rows.front().number;
  TrajectoryLayout layout;
  try {
    refuse_decimal_commas(text);
    layout.separator = separator_of(text);
    const Fields row = split_row(text, layout.separator);
    layout.fields = row.size();
    if (format != TrajectoryFormat::kKitti) {
      if (!lines.head.empty()) number = lines.head.back().number;
      use_names(lines.head, row, layout);
      number = lines.rows.front().number;
    }
    if (!layout.named) use_order(row, format, layout);
  } catch (const std::runtime_error& error) {
    fail_at(file, number, error.what());
  }
  if (layout.columns) {
    const auto usual = layout.separator == ' ' ? TrajectoryFormat::kTum : TrajectoryFormat::kEuroc;
    layout.format = format.value_or(usual);
  }
  if (layout.matrix.by_columns) layout.remarks.emplace_back("its matrices are written column by column");
  return layout;
}

}  // namespace stereo_slam
