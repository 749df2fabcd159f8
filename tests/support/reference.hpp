// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json.hpp>

#include <antipode/eigen_types.hpp>

namespace antipode::test {

/// A JSON file of reference values in tests/data.
[[nodiscard]] nlohmann::json read_reference(const std::string& name);

/// Says what was expected, and what is there.
[[noreturn]] void refuse_reference(const std::string& expected, const nlohmann::json& found);

/// A list of N numbers.
template <int N>
[[nodiscard]] Vector<double, N> to_vector(const nlohmann::json& list) {
  if (list.size() != N) refuse_reference(std::to_string(N) + " numbers", list);
  Vector<double, N> v;
  for (int i = 0; i < N; ++i) v[i] = list.at(static_cast<std::size_t>(i)).get<double>();
  return v;
}

/// A list of Rows lists of Cols numbers.
template <int Rows, int Cols = Rows>
[[nodiscard]] Matrix<double, Rows, Cols> to_matrix(const nlohmann::json& rows) {
  if (rows.size() != Rows) refuse_reference(std::to_string(Rows) + " rows", rows);
  Matrix<double, Rows, Cols> m;
  for (int i = 0; i < Rows; ++i) m.row(i) = to_vector<Cols>(rows.at(static_cast<std::size_t>(i))).transpose();
  return m;
}

}  // namespace antipode::test
