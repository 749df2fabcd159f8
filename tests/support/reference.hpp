// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

#include <antipode/eigen_types.hpp>

namespace antipode::test {

/// A JSON file of reference values in tests/data.
[[nodiscard]] inline nlohmann::json read_reference(const std::string& name) {
  std::ifstream file(std::filesystem::path(ANTIPODE_TEST_DATA_DIR) / name);
  if (!file) throw std::runtime_error("cannot read test data " + name);
  return nlohmann::json::parse(file);
}

/// A list of N numbers.
template <int N>
[[nodiscard]] Vector<double, N> to_vector(const nlohmann::json& list) {
  if (list.size() != N)
    throw std::runtime_error("expected " + std::to_string(N) + " numbers in " + list.dump());
  Vector<double, N> v;
  for (int i = 0; i < N; ++i) v[i] = list.at(static_cast<std::size_t>(i)).get<double>();
  return v;
}

/// A list of Rows lists of Cols numbers.
template <int Rows, int Cols = Rows>
[[nodiscard]] Matrix<double, Rows, Cols> to_matrix(const nlohmann::json& rows) {
  if (rows.size() != Rows)
    throw std::runtime_error("expected " + std::to_string(Rows) + " rows in " + rows.dump());
  Matrix<double, Rows, Cols> m;
  for (int i = 0; i < Rows; ++i) m.row(i) = to_vector<Cols>(rows.at(static_cast<std::size_t>(i))).transpose();
  return m;
}

}  // namespace antipode::test
