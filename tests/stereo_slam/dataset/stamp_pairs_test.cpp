// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/stamp_pairs.hpp"

#include <cstdint>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr std::int64_t kMs_ns = 1'000'000;
using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;
using Indices = std::vector<std::size_t>;

/// Stamps of images each 50 ms, all `late_ms` late, without those of the given indices.
std::vector<std::int64_t> each_50_ms(std::int64_t count, std::int64_t late_ms, const Indices& lost = {}) {
  std::vector<std::int64_t> result;
  for (std::int64_t i = 0; i < count; ++i) {
    if (std::find(lost.begin(), lost.end(), static_cast<std::size_t>(i)) == lost.end())
      result.push_back((50 * i + late_ms) * kMs_ns);
  }
  return result;
}

}  // namespace

TEST_CASE("An image lost on each side leaves the other pairs as they are", "[pairs]") {
  const auto result = pair_stamps(each_50_ms(6, 0, {1}), each_50_ms(6, 20, {4}), std::nullopt);
  CHECK(result.pairs == Pairs{{0, 0}, {1, 2}, {2, 3}, {4, 4}});
  CHECK(result.left_alone == Indices{3});
  CHECK(result.right_alone == Indices{1});
  CHECK(result.distances.median_ns == 20 * kMs_ns);
  CHECK(result.distances.largest_ns == 20 * kMs_ns);
}

TEST_CASE("Pairs are less than half an interval apart, of the faster camera", "[pairs]") {
  CHECK(pair_stamps(each_50_ms(6, 0), each_50_ms(6, 24), std::nullopt).pairs.size() == 6);
  // Half an interval: either neighbour may be the partner.
  CHECK(pair_stamps(each_50_ms(6, 0), each_50_ms(6, 25), std::nullopt).pairs.empty());
  CHECK(pair_stamps(each_50_ms(6, 0), each_50_ms(6, 0, {1, 3, 5}), std::nullopt).pairs ==
        Pairs{{0, 0}, {2, 1}, {4, 2}});
  // A pause does not change the usual interval.
  CHECK(pair_stamps({0, 50, 100, 90'000}, {0, 50, 100, 90'030}, std::nullopt).pairs.size() == 3);
}

TEST_CASE("The bound may be given", "[pairs]") {
  CHECK(pair_stamps(each_50_ms(6, 0), each_50_ms(6, 2), kMs_ns).pairs.empty());
  CHECK(pair_stamps(each_50_ms(6, 0), each_50_ms(6, 2), 2 * kMs_ns).pairs.size() == 6);
  CHECK(pair_stamps(each_50_ms(6, 0), each_50_ms(6, 0), 0).pairs.size() == 6);
  // Each image has one partner, whatever the bound: the nearest.
  CHECK(pair_stamps(each_50_ms(6, 0), each_50_ms(6, 20), 1000 * kMs_ns).pairs.size() == 6);
  CHECK(pair_stamps(each_50_ms(6, 0), each_50_ms(1, 101), 1000 * kMs_ns).pairs == Pairs{{2, 0}});
}

TEST_CASE("Few and no images are paired without a fault", "[pairs]") {
  CHECK(pair_stamps({}, {}, std::nullopt).pairs.empty());
  CHECK(pair_stamps({}, {5, 6}, std::nullopt).right_alone == Indices{0, 1});
  CHECK(pair_stamps({5, 6}, {}, std::nullopt).left_alone == Indices{0, 1});
  CHECK(pair_stamps({5}, {7}, std::nullopt).pairs == Pairs{{0, 0}});
  CHECK(pair_stamps({5}, {7}, std::nullopt).nearest_ns == 2);
}

TEST_CASE("Distances above a millisecond give a warning, and too few pairs an error", "[pairs]") {
  SequenceScan scan;
  scan.sequence.folder = "drive";
  const CameraStamps left{"left", each_50_ms(6, 0)};
  (void)paired_by_stamps(left, {"right", each_50_ms(6, 1)}, {}, scan);
  CHECK(scan.problems.empty());
  CHECK(scan.sequence.pair_distances.largest_ns == kMs_ns);
  (void)paired_by_stamps(left, {"right", each_50_ms(6, 7)}, {}, scan);
  REQUIRE(scan.problems.size() == 1);
  CHECK_THAT(scan.problems[0].text,
             Catch::StartsWith("drive: ") && Catch::Contains("up to 7 ms apart (median 7 ms)"));
  const auto error = message_of([&] {
    (void)paired_by_stamps(left, {"right", each_50_ms(6, 90'000)}, {}, scan);
  });
  CHECK_THAT(error, Catch::Contains("drive: 0 of 6 images of left and 6 of right were taken within 25 ms") &&
                        Catch::Contains("the nearest are 89.75 s apart"));
}
