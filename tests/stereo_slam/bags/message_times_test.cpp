// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/message_times.hpp"

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Stamps of messages are used where they are in order", "[bags]") {
  const auto times_of = [](const std::vector<std::int64_t>& seconds) {
    std::vector<MessageTime> times;
    for (std::size_t i = 0; i < seconds.size(); ++i)
      times.push_back({seconds[i] * 1'000'000'000, static_cast<std::int64_t>(i + 100) * 1'000'000'000});
    return times;
  };
  const auto used = [&](const std::vector<std::int64_t>& seconds) {
    return by_header_stamps(times_of(seconds)).index;
  };
  using Indices = std::vector<std::size_t>;
  CHECK(used({1, 2, 3, 4}) == Indices{0, 1, 2, 3});
  CHECK(used({1, 2, 900, 4, 5}) == Indices{0, 1, 3, 4});
  CHECK(used({1, 2, 0, 4, 5}) == Indices{0, 1, 3, 4});
  CHECK(used({0, 901, 902, 903}) == Indices{1, 2, 3});
  CHECK(used({0, 1, 2, 3}) == Indices{0, 1, 2, 3});  // of a simulation
  CHECK(used({1, 2, 3, 900}) == Indices{0, 1, 2});
  CHECK(used({1, 2, 2, 3}) == Indices{0, 1, 3});
  CHECK(used({}).empty());
  CHECK(used({7}) == Indices{0});
  CHECK_THAT(message_of([&] {
               (void)used({1, 2, 3, 1, 2, 3});
             }),
             Catch::Contains("3 of its 6 images are out of order"));
  CHECK_THAT(message_of([&] {
               (void)used({0, 0, 0, 0});
             }),
             Catch::Contains("4 of its 4 images have the stamp zero"));
  const auto recorded = by_record_times(times_of({0, 0, 0}));
  CHECK(recorded.stamps_ns == std::vector<std::int64_t>{100'000'000'000, 101'000'000'000, 102'000'000'000});
}
