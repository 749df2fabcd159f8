// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/place_recognition.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <random>
#include <tuple>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr unsigned kTownSeed = 3;
constexpr std::size_t kPlacePoints = 300;

/// Descriptors whose bits are as uneven and as dependent as those of corners: each is one of many kinds of
/// corner, worn by flipped bits.
class RandomTown {
 public:
  explicit RandomTown(unsigned seed) : random_(seed) {
    kinds_.resize(4000);
    for (auto& kind : kinds_) kind = any();
  }

  [[nodiscard]] std::vector<KeyframePoint> place() {
    std::vector<KeyframePoint> points(kPlacePoints);
    for (auto& point : points) point.descriptor = worn(kinds_[random_() % kinds_.size()], 0.12);
    return points;
  }

  /// The same place another time: less than half of the corners again, with one bit in ten changed.
  [[nodiscard]] std::vector<KeyframePoint> again(const std::vector<KeyframePoint>& place) {
    auto points = this->place();
    for (std::size_t i = 0; i < 2 * kPlacePoints / 5; ++i)
      points[i].descriptor = worn(place[i].descriptor, 0.1);
    return points;
  }

 private:
  [[nodiscard]] Descriptor any() {
    Descriptor descriptor{};
    for (auto& byte : descriptor) byte = static_cast<std::uint8_t>(random_());
    return descriptor;
  }
  [[nodiscard]] Descriptor worn(Descriptor descriptor, double share) {
    // Not std::bernoulli_distribution, which takes two logarithms with Clang.
    const auto limit = static_cast<std::uint32_t>(share * std::numeric_limits<std::uint32_t>::max());
    for (auto& byte : descriptor) {
      for (int bit = 0; bit < 8; ++bit) {
        const bool flipped = static_cast<std::uint32_t>(random_()) < limit;
        if (flipped) byte = static_cast<std::uint8_t>(byte ^ (1U << bit));
      }
    }
    return descriptor;
  }

  std::mt19937_64 random_;
  std::vector<Descriptor> kinds_;
};

TEST_CASE("A tree is the same if the points of a keyframe are inserted together or one by one",
          "[place_recognition]") {
  RandomTown town(kTownSeed);
  constexpr std::size_t kSmallLeaf = 8;  // many leaves are split while the points of a keyframe are inserted
  const int half = GENERATE(0, 1);
  DescriptorTree together(half, 0, 1, kSmallLeaf);
  DescriptorTree one_by_one(half, 0, 1, kSmallLeaf);
  std::vector<KeyframePoint> all;
  for (std::uint32_t keyframe = 0; keyframe < 10; ++keyframe) {
    const auto points = town.place();
    together.insert(points, keyframe);
    for (const auto& point : points) one_by_one.insert({&point, 1}, keyframe);
    all.insert(all.end(), points.begin(), points.end());
  }
  const auto leaves = together.leaves_of(all);
  REQUIRE(leaves.size() == all.size());
  std::size_t longest = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto expected = one_by_one.leaves_of({&all[i], 1}).front();
    CHECK(std::equal(
        leaves[i].begin(), leaves[i].end(), expected.begin(), expected.end(),
        [](const TreeEntry& a, const TreeEntry& b) { return a.half == b.half && a.keyframe == b.keyframe; }));
    longest = std::max(longest, leaves[i].size());
  }
  CHECK(longest < all.size() / 10);
  CHECK(together.leaves_of({}).empty());
}

TEST_CASE("Places are recognised, and the work of a query grows far slower than the number of keyframes",
          "[stereo_slam][places]") {
  CAPTURE(kTownSeed);
  constexpr std::size_t kPlaces = 2000;
  RandomTown town(kTownSeed);
  PlaceRecognition recognition{PlaceRecognitionSettings{}};
  std::vector<std::vector<KeyframePoint>> places;
  std::size_t few = 0;
  std::size_t many = 0;
  for (std::size_t id = 0; id < kPlaces; ++id) {
    places.push_back(town.place());
    recognition.add(id, places.back());
    if (id + 1 == kPlaces / 20) few = recognition.query(town.again(places[id / 2]), id + 1).comparisons;
  }
  int found = 0;
  int asked = 0;
  for (std::size_t id = 7; id < kPlaces; id += 20) {
    const auto query = recognition.query(town.again(places[id]), kPlaces);
    many = std::max(many, query.comparisons);
    ++asked;
    if (!query.candidates.empty() && query.candidates.front().keyframe == id) ++found;
  }
  CAPTURE(asked, few, many);
  CHECK(found >= 0.95 * asked);
  CHECK(many < 3 * few);
  CHECK(recognition.memory_bytes() < kPlaces * kPlacePoints * 150);
}

TEST_CASE("A new place has no candidate that scores like a revisit", "[stereo_slam][places]") {
  CAPTURE(kTownSeed);
  RandomTown town(kTownSeed);
  PlaceRecognition recognition{PlaceRecognitionSettings{}};
  std::vector<std::vector<KeyframePoint>> places;
  for (std::size_t id = 0; id < 300; ++id) {
    places.push_back(town.place());
    recognition.add(id, places.back());
  }
  const auto seen = recognition.query(town.again(places[50]), 300);
  REQUIRE_FALSE(seen.candidates.empty());
  CHECK(seen.candidates.front().keyframe == 50);
  const auto other = recognition.query(town.place(), 300);
  const double other_score = other.candidates.empty() ? 0.0 : other.candidates.front().score;
  CHECK(seen.candidates.front().score > 2.0 * other_score);
}

TEST_CASE("Recent keyframes and neighbours of a candidate are not candidates", "[stereo_slam][places]") {
  CAPTURE(kTownSeed);
  RandomTown town(kTownSeed);
  PlaceRecognition recognition{PlaceRecognitionSettings{}};
  const auto place = town.place();
  for (std::size_t id = 0; id < 30; ++id) {
    recognition.add(id, id % 10 < 2 ? town.again(place) : town.place());
  }
  const auto query = recognition.query(town.again(place), 20);
  REQUIRE(query.candidates.size() == 2);
  CHECK(query.candidates[0].score >= query.candidates[1].score);
  for (const auto& candidate : query.candidates) {
    CHECK(candidate.keyframe < 20);
    CHECK(candidate.keyframe % 10 < 2);
  }
}

TEST_CASE("Equal descriptors neither split a leaf without end nor fill it", "[stereo_slam][places]") {
  PlaceRecognition recognition{PlaceRecognitionSettings{}};
  const std::vector<KeyframePoint> same(kPlacePoints);
  for (std::size_t id = 0; id < 50; ++id) recognition.add(id, same);
  const auto query = recognition.query(same, 50);
  CHECK(query.comparisons <= kPlacePoints * 4 * 4 * 48);
}

TEST_CASE("The trees keep the first and the second half of the descriptors in turn",
          "[stereo_slam][places]") {
  CAPTURE(kTownSeed);
  constexpr std::size_t kPlaces = 40;
  constexpr std::size_t kHalf = 16;
  for (const auto& [trees, half, found] :
       {std::tuple{1, 0, true}, {1, 1, false}, {2, 0, true}, {2, 1, true}, {3, 1, true}, {16, 1, true}}) {
    CAPTURE(trees, half);
    RandomTown town(kTownSeed);
    PlaceRecognitionSettings settings;
    settings.trees = trees;
    PlaceRecognition recognition(settings);
    std::vector<std::vector<KeyframePoint>> places;
    for (std::size_t id = 0; id < kPlaces; ++id) {
      places.push_back(town.place());
      recognition.add(id, places.back());
    }
    auto query = RandomTown(kTownSeed + 1).place();
    const auto& place = places[kPlaces / 2];
    for (std::size_t i = 0; i < query.size(); ++i) {
      const auto begin = place[i].descriptor.begin() + (half == 0 ? 0 : kHalf);
      std::copy_n(begin, kHalf, query[i].descriptor.begin() + (half == 0 ? 0 : kHalf));
    }
    const auto candidates = recognition.query(query, kPlaces).candidates;
    CHECK((!candidates.empty() && candidates.front().keyframe == kPlaces / 2) == found);
  }
}

TEST_CASE("Halves of descriptors match up to half of the largest distance", "[stereo_slam][places]") {
  PlaceRecognitionSettings settings;
  settings.trees = 1;
  settings.max_descriptor_distance = 33;  // 16 bits of a half
  for (const int flipped : {0, 15, 16, 17, 33}) {
    CAPTURE(flipped);
    PlaceRecognition recognition(settings);
    recognition.add(0, std::vector<KeyframePoint>(1));
    std::vector<KeyframePoint> query(1);
    for (int bit = 0; bit < flipped; ++bit) {
      auto& byte = query[0].descriptor[static_cast<std::size_t>(bit / 8)];
      byte = static_cast<std::uint8_t>(byte ^ (1U << (bit % 8)));
    }
    CHECK(recognition.query(query, 1).candidates.empty() == (flipped > 16));
  }
}

TEST_CASE("An empty query and an empty database give no candidates", "[stereo_slam][places]") {
  const PlaceRecognition recognition{PlaceRecognitionSettings{}};
  CHECK(recognition.query(RandomTown(1).place(), 0).candidates.empty());
  CHECK(recognition.query({}, 10).candidates.empty());
}

}  // namespace
}  // namespace stereo_slam
