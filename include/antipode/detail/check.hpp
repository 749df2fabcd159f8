// SPDX-License-Identifier: MIT
#pragma once

#include <charconv>
#include <concepts>
#include <iterator>
#include <limits>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include <antipode/eigen_types.hpp>

/// Checks of arguments. Every error message contains the invalid value.
namespace antipode::detail {

/// An Eigen expression whose size is known at compile time to be Rows x Cols.
template <class T, int Rows, int Cols = 1>
concept MatrixExpression = requires(const T& expression) {
  []<class Derived>(const Eigen::MatrixBase<Derived>&) {}(expression);
}
&&(T::RowsAtCompileTime == Rows) && (T::ColsAtCompileTime == Cols);

/// An Eigen expression with `Rows` rows and any number of columns, fixed or dynamic, except a fixed number of
/// one.
template <class T, int Rows>
concept ColumnsExpression = requires(const T& expression) {
  []<class Derived>(const Eigen::MatrixBase<Derived>&) {}(expression);
}
&&(T::RowsAtCompileTime == Rows) && (T::ColsAtCompileTime != 1);

/// Throws std::invalid_argument("<what>: <value>"); a matrix is printed in one line, "[1, 2; 3, 4]".
template <class Value>
[[noreturn, gnu::cold, gnu::noinline]] void throw_invalid(std::string_view what, const Value& value) {
  std::ostringstream text;
  text << what << ": ";
  if constexpr (requires {
                  typename Value::Scalar;
                  value.rows();
                }) {
    // Loops, because Eigen's formatted output costs a tenth of a second of compile time for every matrix
    // type.
    text.precision(std::numeric_limits<typename Value::Scalar>::digits10);
    text << '[';
    for (int i = 0; i < value.rows(); ++i) {
      if (i > 0) text << "; ";
      for (int j = 0; j < value.cols(); ++j) text << (j > 0 ? ", " : "") << value(i, j);
    }
    text << ']';
  } else {
    if constexpr (std::floating_point<Value>) text.precision(std::numeric_limits<Value>::digits10);
    text << value;
  }
  throw std::invalid_argument(text.str());
}

/// Prints a number with as many digits as are needed to read the same one back: 0.1, 4500000.125. A number of
/// another type than the standard's, a dual number say, prints as it does.
template <class Scalar>
void print_number(std::ostream& out, const Scalar& x) {
  if constexpr (std::floating_point<Scalar>) {
    char digits[64];
    const auto [end, error] = std::to_chars(std::begin(digits), std::end(digits), x);
    out.write(digits, end - digits);
  } else {
    out << x;
  }
}

/// Prints a vector in one line, "[1 2 3]".
template <class Derived>
void print_row(std::ostream& out, const Eigen::MatrixBase<Derived>& vector) {
  out << '[';
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    if (i > 0) out << ' ';
    print_number(out, vector[i]);
  }
  out << ']';
}

/// Whether x is neither NaN nor infinite. For a dual number, only its value is checked.
template <class Scalar>
[[nodiscard]] constexpr bool is_finite(const Scalar& x) noexcept {
  return x - x == Scalar(0);
}

/// Whether every entry is finite. A loop, because Eigen's allFinite() compiles three expressions for every
/// matrix type.
template <class Derived>
[[nodiscard]] bool all_finite(const Eigen::MatrixBase<Derived>& value) noexcept {
  const auto& entries = value.eval();
  bool finite = true;
  for (Eigen::Index i = 0; i < entries.size(); ++i) finite &= is_finite(entries.data()[i]);
  return finite;
}

/// Throws std::invalid_argument unless every entry is finite.
template <class Derived>
void require_finite(std::string_view what, const Eigen::MatrixBase<Derived>& value) {
  if (!all_finite(value)) [[unlikely]] {
    throw_invalid(what, value.eval());
  }
}

}  // namespace antipode::detail
