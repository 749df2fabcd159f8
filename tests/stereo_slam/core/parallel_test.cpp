// SPDX-License-Identifier: MIT
#include "stereo_slam/core/parallel.hpp"

#include <cstddef>
#include <stdexcept>
#include <vector>

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

TEST_CASE("A function is called with every number once, with any number of threads", "[stereo_slam][core]") {
  const int before = cv::getNumThreads();
  for (const int threads : {1, 2}) {
    cv::setNumThreads(threads);
    for (const std::size_t count : {0, 1, 17}) {
      std::vector<int> calls(count);
      run_each(count, [&](std::size_t i) { ++calls.at(i); });
      CHECK(calls == std::vector<int>(count, 1));
    }
  }
  cv::setNumThreads(before);
  CHECK_THROWS_AS(run_each(3, [](std::size_t i) { return std::vector<int>(i).at(1); }), std::out_of_range);
}

}  // namespace
}  // namespace stereo_slam
