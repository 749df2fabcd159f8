// SPDX-License-Identifier: MIT
#include "stereo_slam/core/descriptor.hpp"

#include "support/catch.hpp"

using namespace stereo_slam;

TEST_CASE("The distance of descriptors is the number of differing bits", "[stereo_slam][descriptor]") {
  Descriptor a{};
  Descriptor b{};
  CHECK(hamming_distance(a, b) == 0);
  b[0] = 0x0F;
  b[31] = 0x80;
  CHECK(hamming_distance(a, b) == 5);
  b.fill(0xFF);
  CHECK(hamming_distance(a, b) == 256);
}

TEST_CASE("Of equally near descriptors the first is the nearest", "[stereo_slam][descriptor]") {
  NearestDescriptor nearest;
  nearest.offer(4, 30);
  nearest.offer(5, 20);
  nearest.offer(6, 20);
  nearest.offer(7, 25);
  CHECK(nearest.index == 5);
  CHECK(nearest.distance == 20);
  CHECK(nearest.second == 20);
}
