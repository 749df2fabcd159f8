// SPDX-License-Identifier: MIT
// Linked with --wrap=malloc and --wrap=realloc: the program's calls of these end here.
#include <cstddef>

#include <Eigen/Core>

#include "support/no_allocation.hpp"

namespace {

thread_local long allocations_of_thread = 0;

}  // namespace

// NOLINTBEGIN(bugprone-reserved-identifier): the linker chooses the names
extern "C" {

void* __real_malloc(std::size_t size);
void* __real_realloc(void* memory, std::size_t size);

void* __wrap_malloc(std::size_t size) {
  ++allocations_of_thread;
  return __real_malloc(size);
}

void* __wrap_realloc(void* memory, std::size_t size) {
  ++allocations_of_thread;
  return __real_realloc(memory, size);
}
}
// NOLINTEND(bugprone-reserved-identifier)

namespace antipode::test {

long allocations() { return allocations_of_thread; }

}  // namespace antipode::test

TEST_CASE("The allocations of Eigen are counted", "[allocation]") {
  const long before = antipode::test::allocations();
  Eigen::VectorXd v = Eigen::VectorXd::Ones(100);
  CHECK(antipode::test::allocations() == before + 1);
  v.conservativeResize(2000);
  CHECK(antipode::test::allocations() == before + 2);
  CHECK(v.head(100).sum() == 100.0);
}
