// SPDX-License-Identifier: MIT
#include "stereo_slam/app/duty_cycle.hpp"

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("Work takes its share of the time, however long it takes", "[stereo_slam][duty_cycle]") {
  using std::chrono::milliseconds;
  DutyCycle cycle(0.04);
  const DutyCycle::Time begin{milliseconds(1000)};
  CHECK(cycle.is_due(begin));
  cycle.worked(begin, begin + milliseconds(8));
  CHECK_FALSE(cycle.is_due(begin + milliseconds(8)));
  CHECK_FALSE(cycle.is_due(begin + milliseconds(199)));
  CHECK(cycle.is_due(begin + milliseconds(201)));
  cycle.worked(begin + milliseconds(300), begin + milliseconds(300));
  CHECK(cycle.is_due(begin + milliseconds(300)));  // work without length has no pause
}

}  // namespace
}  // namespace stereo_slam
