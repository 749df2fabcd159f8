// SPDX-License-Identifier: MIT
#pragma once

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace antipode::test {

/// The rows of a comma-separated table of numbers in tests/data, without its header line.
[[nodiscard]] inline std::vector<std::vector<double>> read_csv(const std::string& name) {
  std::ifstream file(std::string(ANTIPODE_TEST_DATA_DIR) + "/" + name);
  if (!file) throw std::runtime_error("cannot read test data " + name);
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<double>& row = rows.emplace_back();
    std::stringstream entries(line);
    for (std::string entry; std::getline(entries, entry, ',');) row.push_back(std::stod(entry));
  }
  return rows;
}

}  // namespace antipode::test
