// SPDX-License-Identifier: MIT
#pragma once

#include "support/catch.hpp"

namespace antipode::test {

/// Calls of malloc and realloc by this thread, from the program itself: those of Eigen, which asks the C
/// library for its memory. Not those of the standard library's containers. Counted in the programs of
/// antipode_count_allocations (tests/CMakeLists.txt).
[[nodiscard]] long allocations();

/// f(), in which Eigen must not allocate.
template <class Function>
[[nodiscard]] auto without_allocation(const Function& f) {
  const long before = allocations();
  auto result = f();
  const long during = allocations() - before;
  CHECK(during == 0);
  return result;
}

}  // namespace antipode::test
