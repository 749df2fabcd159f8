// SPDX-License-Identifier: MIT
#pragma once

// The first include of a test program of its own: it changes Eigen, which reports a forbidden allocation by
// an assertion.
#ifdef EIGEN_CORE_H
#error "support/no_allocation.hpp must come before Eigen"
#endif
#undef NDEBUG
#define EIGEN_RUNTIME_NO_MALLOC
#include <antipode/eigen_types.hpp>

namespace antipode::test {

/// f(), stopping the program if Eigen allocates in it.
template <class Function>
[[nodiscard]] auto without_allocation(const Function& f) {
  Eigen::internal::set_is_malloc_allowed(false);
  auto result = f();
  Eigen::internal::set_is_malloc_allowed(true);
  return result;
}

}  // namespace antipode::test
