// SPDX-License-Identifier: MIT
#pragma once

#include <sstream>
#include <stdexcept>
#include <string_view>

#include <Eigen/Core>

/// Refusing invalid arguments: one place that words the error, so that every message carries the offending
/// value.
namespace antipode::detail {

/// An Eigen expression whose size is known at compile time to be Rows x Cols.
template <class T, int Rows, int Cols = 1>
concept MatrixExpression = requires(const T& expression) {
  []<class Derived>(const Eigen::MatrixBase<Derived>&) {}(expression);
}
&&(T::RowsAtCompileTime == Rows) && (T::ColsAtCompileTime == Cols);

/// Throws std::invalid_argument("<what>: <value>"); matrices are printed in one line at full precision.
template <class Value>
[[noreturn, gnu::cold, gnu::noinline]] void throw_invalid(std::string_view what, const Value& value) {
  std::ostringstream text;
  text << what << ": ";
  if constexpr (requires { value.format(Eigen::IOFormat()); }) {
    text << value.format(
        Eigen::IOFormat(Eigen::FullPrecision, Eigen::DontAlignCols, ", ", "; ", "", "", "[", "]"));
  } else {
    text << value;
  }
  throw std::invalid_argument(text.str());
}

/// Neither NaN nor infinite; for dual-number scalars, their value.
template <class Scalar>
[[nodiscard]] constexpr bool is_finite(const Scalar& x) noexcept {
  return x - x == Scalar(0);
}

/// Throws unless every entry is finite.
template <class Derived>
void require_finite(std::string_view what, const Eigen::MatrixBase<Derived>& value) {
  if (!value.allFinite()) [[unlikely]] {
    throw_invalid(what, value.eval());
  }
}

}  // namespace antipode::detail
