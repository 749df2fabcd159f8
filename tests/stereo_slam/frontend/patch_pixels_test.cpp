// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/patch_pixels.hpp"

#include <random>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// Numbers of -100 to 100 on the pixels, and the same one after another.
struct RandomPatch {
  PatchPixels pixels;
  std::array<double, 49> values{};

  explicit RandomPatch(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> number(-100.0F, 100.0F);
    for (std::size_t row = 0; row < 7; ++row) {
      FourFloats halves[2];
      for (std::size_t column = 0; column < 8; ++column) {
        const float value = number(random);
        halves[column / 4][column % 4] = value;
        if (column < 7) values[7 * row + column] = static_cast<double>(value);
      }
      pixels.set_row(row, halves[0], halves[1]);
    }
  }

  [[nodiscard]] double sum() const {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum;
  }
};

TEST_CASE("Eight bytes become their values", "[stereo_slam][images]") {
  const std::array<std::uint8_t, 8> bytes{0, 1, 127, 128, 200, 254, 255, 7};
  const EightFloats eight(bytes.data());
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(eight.first[i] == static_cast<float>(bytes[i]));
    CHECK(eight.last[i] == static_cast<float>(bytes[4 + i]));
  }
}

TEST_CASE("Sums and products are those over the 49 pixels", "[stereo_slam][images]") {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const RandomPatch a(seed), b(seed + 10);
    double expected = 0.0;
    for (std::size_t i = 0; i < a.values.size(); ++i) expected += a.values[i] * b.values[i];
    CHECK(static_cast<double>(sum_of(a.pixels)) == Approx(a.sum()).margin(0.01));
    CHECK(static_cast<double>(product(a.pixels, b.pixels)) == Approx(expected).margin(1.0));
    const PatchPixels both = combination(2.0F, a.pixels, -0.5F, b.pixels);
    CHECK(static_cast<double>(sum_of(both)) == Approx(2.0 * a.sum() - 0.5 * b.sum()).margin(0.01));
  }
}

TEST_CASE("Without its mean, or another patch's share, a patch has none of it", "[stereo_slam][images]") {
  RandomPatch a(4);
  const RandomPatch b(5);
  a.pixels.subtract_mean();
  CHECK(static_cast<double>(sum_of(a.pixels)) == Approx(0.0).margin(0.01));
  a.pixels.subtract(product(a.pixels, b.pixels) / product(b.pixels, b.pixels), b.pixels);
  CHECK(static_cast<double>(product(a.pixels, b.pixels)) == Approx(0.0).margin(1.0));
}

}  // namespace
}  // namespace stereo_slam
