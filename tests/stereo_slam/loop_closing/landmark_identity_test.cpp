// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/landmark_identity.hpp"

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("A landmark is named by the smallest of its ids", "[stereo_slam][landmarks]") {
  LandmarkIdentity identity;
  CHECK(identity(7) == 7);
  identity.unite(9, 4);
  identity.unite(30, 9);
  identity.unite(12, 30);
  for (const std::uint32_t id : {4U, 9U, 12U, 30U}) CHECK(identity(id) == 4);
  CHECK(identity(10) == 10);
  identity.unite(2, 12);
  for (const std::uint32_t id : {2U, 4U, 9U, 12U, 30U}) CHECK(identity(id) == 2);
  identity.unite(2, 30);
  CHECK(identity(31) == 31);
}

TEST_CASE("The largest ids cost no more than small ones", "[stereo_slam][landmarks]") {
  LandmarkIdentity identity;
  identity.unite(0xffffffffU, 0x80000000U);
  CHECK(identity(0xffffffffU) == 0x80000000U);
  identity.unite(1, 0xffffffffU);
  CHECK(identity(0x80000000U) == 1);
}

TEST_CASE("Landmarks are named by the smallest id in whatever order they are united",
          "[stereo_slam][landmarks]") {
  std::mt19937_64 random(3);
  LandmarkIdentity identity;
  std::vector<std::uint32_t> smallest(60);  // by exhaustive replacement
  std::iota(smallest.begin(), smallest.end(), 0U);
  for (int i = 0; i < 50; ++i) {
    const auto a = static_cast<std::uint32_t>(random() % smallest.size());
    const auto b = static_cast<std::uint32_t>(random() % smallest.size());
    identity.unite(a, b);
    const auto [kept, replaced] = std::minmax(smallest[a], smallest[b]);
    std::replace(smallest.begin(), smallest.end(), std::uint32_t{replaced}, std::uint32_t{kept});
    for (std::uint32_t n = 0; n < smallest.size(); ++n) REQUIRE(identity(n) == smallest[n]);
  }
}

}  // namespace
}  // namespace stereo_slam
