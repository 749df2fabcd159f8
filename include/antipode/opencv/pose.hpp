// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <opencv2/core.hpp>
#include <opencv2/core/dualquaternion.hpp>

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/quaternion.hpp>

/// @file
/// Poses to and from OpenCV's types: the R, t (or rvec, tvec) of calib3d, and cv::DualQuat.
namespace antipode {

namespace detail {

/// The entries of a single-channel `Rows` x `Cols` matrix of any depth; a vector may be a row or a column.
/// Throws if the size or the number of channels is wrong.
template <class Scalar, int Rows, int Cols>
[[nodiscard]] Matrix<Scalar, Rows, Cols> from_cv_matrix(const char* what, const cv::Mat& matrix) {
  const bool fits = matrix.dims == 2 && matrix.channels() == 1 &&
                    ((matrix.rows == Rows && matrix.cols == Cols) ||
                     (Cols == 1 && matrix.rows == 1 && matrix.cols == Rows));
  if (!fits) {
    throw_invalid(std::string(what) + " has the wrong size or several channels",
                  std::to_string(matrix.rows) + " x " + std::to_string(matrix.cols) + " x " +
                      std::to_string(matrix.channels()));
  }
  cv::Mat_<Scalar> values;
  matrix.convertTo(values, values.type());
  values = values.reshape(0, Rows);
  Matrix<Scalar, Rows, Cols> result;
  for (int i = 0; i < Rows; ++i) {
    for (int j = 0; j < Cols; ++j) {
      result(i, j) = values(i, j);
    }
  }
  return result;
}

}  // namespace detail

/// The pose p -> R p + t of a 3 x 3 rotation matrix, or of a rotation vector (Rodrigues) [rad], and a
/// translation, all of any depth. Throws if a size is wrong, R is not a rotation matrix or a value is not
/// finite.
template <class Scalar = double>
[[nodiscard]] DualQuaternion<Scalar> pose_from_cv(const cv::Mat& rotation, const cv::Mat& translation) {
  const auto t = detail::from_cv_matrix<Scalar, 3, 1>("translation", translation);
  if (rotation.total() == 3) {
    const auto phi = detail::from_cv_matrix<Scalar, 3, 1>("rotation vector", rotation);
    return DualQuaternion<Scalar>::from_rotation_translation(quaternion_exp(phi), t);
  }
  return DualQuaternion<Scalar>::from_matrix(detail::from_cv_matrix<Scalar, 3, 3>("rotation", rotation), t);
}

/// The pose of OpenCV's dual quaternion, which has the same layout and meaning. Throws unless it is unit.
template <class Scalar>
[[nodiscard]] DualQuaternion<Scalar> pose_from_cv(const cv::DualQuat<Scalar>& x) {
  return DualQuaternion<Scalar>::from_coefficients(
      Vector8<Scalar>{{x.w, x.x, x.y, x.z, x.w_, x.x_, x.y_, x.z_}});
}

/// The 3 x 3 rotation matrix of a pose.
template <class C>
[[nodiscard]] cv::Matx<typename C::Scalar, 3, 3> rotation_to_cv(const BasicDualQuaternion<C>& pose) {
  cv::Matx<typename C::Scalar, 3, 3> R;
  Eigen::Map<Eigen::Matrix<typename C::Scalar, 3, 3, Eigen::RowMajor>>{R.val} = pose.rotation_matrix();
  return R;
}

/// The rotation vector (rvec) of a pose [rad].
template <class C>
[[nodiscard]] cv::Vec<typename C::Scalar, 3> rotation_vector_to_cv(const BasicDualQuaternion<C>& pose) {
  const Vector3<typename C::Scalar> phi = quaternion_log(pose.real());
  return {phi[0], phi[1], phi[2]};
}

/// The translation (tvec) of a pose.
template <class C>
[[nodiscard]] cv::Vec<typename C::Scalar, 3> translation_to_cv(const BasicDualQuaternion<C>& pose) {
  const Vector3<typename C::Scalar> t = pose.translation();
  return {t[0], t[1], t[2]};
}

/// The pose as OpenCV's dual quaternion, which has the same layout and meaning.
template <class C>
[[nodiscard]] cv::DualQuat<typename C::Scalar> to_cv(const BasicDualQuaternion<C>& pose) {
  const auto& x = pose.coeffs();
  return {x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]};
}

}  // namespace antipode
