// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "stereo_slam/io/pose_columns.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

namespace stereo_slam {

/// Columns of a row-major 3x4 or 4x4 matrix [R | t].
struct MatrixColumns {
  std::size_t first = 0;    ///< 0, or 1 if a frame's number or a stamp is in front
  std::size_t count = 12;   ///< 12 or 16
  bool by_columns = false;  ///< a 4x4 matrix that is written column by column
};

/// What the columns of a trajectory file hold.
struct TrajectoryLayout {
  TrajectoryFormat format = TrajectoryFormat::kKitti;
  char separator = ' ';
  std::size_t fields = 0;              ///< of each row
  std::optional<PoseColumns> columns;  ///< nothing: a matrix
  MatrixColumns matrix;
  bool named = false;                ///< the columns have names
  std::vector<std::string> remarks;  ///< what the user should know about the reading
};

/// The columns of x, y and z.
[[nodiscard]] std::array<std::size_t, 3> position_columns(const TrajectoryLayout& layout);

/// A trajectory file's lines: those before the first row of numbers, and the rows, without comments ('#',
/// '%').
struct TrajectoryLines {
  std::vector<TextLine> head;
  std::vector<TextLine> rows;
};

[[nodiscard]] TrajectoryLines divide_lines(std::vector<TextLine> lines);

/// The layout, from the names of the columns, if there are any, or from the first row. Throws
/// std::runtime_error with file and line if it is none of a trajectory.
[[nodiscard]] TrajectoryLayout layout_of(const std::filesystem::path& file, const TrajectoryLines& lines,
                                         std::optional<TrajectoryFormat> format);

/// Throws std::runtime_error if the numbers of a row have decimal commas.
void refuse_decimal_commas(std::string_view row);

/// Whether a matrix is a rotation to the digits of a file: R R' = I within kRotationTolerance.
[[nodiscard]] bool is_rotation(const Eigen::Matrix3d& R);

/// Largest deviation of R R' from the identity, or of a quaternion's norm from 1; admits files with three
/// digits.
inline constexpr double kRotationTolerance = 1e-2;

/// The upper 3x4 block of a row's matrix.
[[nodiscard]] Eigen::Matrix<double, 3, 4> matrix_at(const std::vector<double>& numbers,
                                                    const MatrixColumns& columns);

}  // namespace stereo_slam
