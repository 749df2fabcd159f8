// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>

namespace antipode::test {

/// The text of the std::invalid_argument that f() throws; "nothing thrown" if it does not.
template <class Function>
[[nodiscard]] std::string error_message(const Function& f) {
  try {
    (void)f();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing thrown";
}

/// Whether `text` contains `part`.
[[nodiscard]] inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace antipode::test
