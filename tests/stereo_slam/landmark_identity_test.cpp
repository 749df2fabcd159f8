// SPDX-License-Identifier: MIT
#include "landmark_identity.hpp"

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("A landmark goes by the smallest of its numbers", "[stereo_slam][landmarks]") {
  LandmarkIdentity identity;
  CHECK(identity(7) == 7);
  identity.unite(9, 4);
  identity.unite(30, 9);
  identity.unite(12, 30);
  for (const std::uint32_t number : {4U, 9U, 12U, 30U}) CHECK(identity(number) == 4);
  CHECK(identity(10) == 10);
  identity.unite(2, 12);
  for (const std::uint32_t number : {2U, 4U, 9U, 12U, 30U}) CHECK(identity(number) == 2);
  identity.unite(2, 30);
  CHECK(identity(31) == 31);
}

}  // namespace
}  // namespace stereo_slam
