// SPDX-License-Identifier: MIT
// Compiled once: the JSON parser and printer cost a second in every source that contains them.
#include "support/reference.hpp"

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace antipode::test {

nlohmann::json read_reference(const std::string& name) {
  std::ifstream file(std::filesystem::path(ANTIPODE_TEST_DATA_DIR) / name);
  if (!file) throw std::runtime_error("cannot read test data " + name);
  return nlohmann::json::parse(file);
}

void refuse_reference(const std::string& expected, const nlohmann::json& found) {
  throw std::runtime_error("expected " + expected + " in " + found.dump());
}

}  // namespace antipode::test
