// SPDX-License-Identifier: MIT
#include "stereo_slam/core/parallel.hpp"

#include <stdexcept>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("Both functions are called once, with any number of threads", "[stereo_slam][core]") {
  const int before = cv::getNumThreads();
  for (const int threads : {1, 2}) {
    cv::setNumThreads(threads);
    int first = 0;
    int second = 0;
    run_both([&] { ++first; }, [&] { ++second; });
    CHECK(first == 1);
    CHECK(second == 1);
  }
  cv::setNumThreads(before);
}

TEST_CASE("An exception of either function reaches the caller", "[stereo_slam][core]") {
  const auto fail = [] { throw std::invalid_argument("no"); };
  const auto work = [] {};
  CHECK_THROWS_AS(run_both(fail, work), std::invalid_argument);
  CHECK_THROWS_AS(run_both(work, fail), std::invalid_argument);
}

}  // namespace
}  // namespace stereo_slam
