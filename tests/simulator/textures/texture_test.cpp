// SPDX-License-Identifier: MIT
#include "simulator/textures/texture.hpp"

#include <cmath>
#include <numbers>

#include "simulator/textures/pattern.hpp"
#include "simulator/textures/random.hpp"
#include "simulator/textures/textures.hpp"
#include "simulator/world/materials.hpp"
#include "support/catch.hpp"

using namespace stereo_slam::simulator;

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// A wave of `cycles` over the texture in u.
double wave(double u, int cycles) { return 0.5 + 0.4 * std::sin(kTurn * cycles * u); }

Texture wave_texture(int size, int cycles) {
  cv::Mat1b image(size, size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      image(y, x) = cv::saturate_cast<std::uint8_t>(255.0 * wave((x + 0.5) / size, cycles));
    }
  }
  return Texture(image);
}

Footprint point_at(double u, double v) { return {.u = u, .v = v}; }

double read(const Texture& texture, const Footprint& footprint) {
  return static_cast<double>(texture.sample(footprint));
}

}  // namespace

TEST_CASE("Textures whose sides are not powers of two are rejected", "[simulate][texture]") {
  for (const cv::Size size : {cv::Size(0, 0), cv::Size(12, 16), cv::Size(16, 12), cv::Size(1, 3)}) {
    CHECK_THROWS_AS(Texture(cv::Mat1b(size, std::uint8_t{7})), std::invalid_argument);
  }
  CHECK_NOTHROW(Texture(cv::Mat1b(1, 1, std::uint8_t{7})));
}

TEST_CASE("Sampling at a texel's centre gives the texel, halfway between two their mean",
          "[simulate][texture]") {
  cv::Mat1b image(4, 8, std::uint8_t{0});
  for (int i = 0; i < 32; ++i) image(i / 8, i % 8) = static_cast<std::uint8_t>(7 * i + 3);
  const Texture texture(image);
  constexpr double kStep = 1.0 / (2.0 * 255.0);  // half a grey level: the weights have 8 bits
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 8; ++x) {
      const double u = (x + 0.5) / 8.0;
      const double v = (y + 0.5) / 4.0;
      const double right = image(y, (x + 1) % 8);
      CHECK(std::abs(read(texture, point_at(u, v)) - image(y, x) / 255.0) < kStep);
      CHECK(std::abs(read(texture, point_at(u + 0.5 / 8.0, v)) - 0.5 * (image(y, x) + right) / 255.0) <
            kStep);
    }
  }
}

TEST_CASE("A texture repeats with period one in both directions, also far from the origin",
          "[simulate][texture]") {
  Random random(11);
  const Texture texture(cv::Mat1b(to_bytes(stain_texture(random, 64))));
  for (int i = 0; i < 200; ++i) {
    const double u = random.uniform();
    const double v = random.uniform();
    const Footprint near{u, v, 0.01, 0.002, -0.003, 0.03};
    Footprint far = near;
    far.u += random.integer(-5000, 5000);
    far.v += random.integer(-5000, 5000);
    // A position is rounded to 2^-16 texels, and 2^-52 of the period count.
    CHECK(std::abs(read(texture, near) - read(texture, far)) < 2.0 / 255.0);
  }
}

TEST_CASE("Every footprint on a uniform texture gives its grey", "[simulate][texture]") {
  const Texture texture(cv::Mat1b(256, 256, std::uint8_t{100}));
  Random random(5);
  for (int i = 0; i < 500; ++i) {
    const double scale = std::pow(10.0, random.uniform(-6.0, 2.0));
    const auto derivative = [&] { return scale * random.uniform(-1.0, 1.0); };
    const Footprint footprint{random.uniform(-9.0, 9.0),
                              random.uniform(-9.0, 9.0),
                              derivative(),
                              derivative(),
                              derivative(),
                              derivative()};
    CHECK(read(texture, footprint) == Approx(100.0 / 255.0).epsilon(1e-6));
    CHECK(texture.sample_round(footprint) == Approx(100.0 / 255.0).epsilon(1e-6));
  }
}

TEST_CASE("Small footprints sample a smooth texture like the function it was made of",
          "[simulate][texture]") {
  constexpr int kSize = 256;
  constexpr int kCycles = 4;
  const Texture texture = wave_texture(kSize, kCycles);
  // Linear interpolation of a sine of w = 2 pi cycles / size a texel errs by w^2 / 8 of its amplitude; 8-bit
  // values by half a level, and the weights by as much again.
  const double w = kTurn * kCycles / kSize;
  const double tolerance = 0.4 * w * w / 8.0 + 1.0 / 255.0;
  for (int i = 0; i < 300; ++i) {
    const double u = -1.0 + i / 97.0;
    CHECK(std::abs(read(texture, {u, 0.3, 0.5 / kSize, 0.0, 0.0, 0.5 / kSize}) - wave(u, kCycles)) <
          tolerance);
  }
}

TEST_CASE("Long footprints average along their length and stay sharp across it", "[simulate][texture]") {
  constexpr int kSize = 256;
  constexpr int kCycles = 4;
  const Texture texture = wave_texture(kSize, kCycles);
  const double length = 1.0 / kCycles;  // one wave
  for (const double u : {0.0, 0.07, 0.31}) {
    // Along the waves' direction the mean is even; eight taps a wave leave its eighth harmonic, of which
    // there is none.
    CHECK(std::abs(read(texture, {u, 0.0, length, 0.0, 0.0, 1.0 / kSize}) - 0.5) < 0.02);
    // Turned by a right angle the footprint lies along the crests, and the wave is as without it.
    const double along_crest = read(texture, {u, 0.0, 0.0, 8.0 / kSize, 1.0 / kSize, 0.0});
    CHECK(std::abs(along_crest - wave(u, kCycles)) < 0.02);
  }
}

TEST_CASE("The palette fills every list with textured materials", "[simulate][texture]") {
  std::vector<Material> materials;
  const Palette palette = make_palette(materials, 3, 64);
  for (const auto* list :
       {&palette.pavements, &palette.grounds, &palette.walls, &palette.roofs, &palette.windows,
        &palette.doors, &palette.shops, &palette.signs, &palette.wheels, &palette.foliage}) {
    CHECK_FALSE(list->empty());
    for (const MaterialId id : *list) REQUIRE(id < materials.size());
  }
  for (const Material& material : materials) CHECK(material.detail != nullptr);
  for (const MaterialId id : palette.foliage) CHECK(materials[id].opacity != nullptr);
  CHECK_THROWS_AS(make_palette(materials, 3, 100), std::invalid_argument);
  CHECK_THROWS_AS(make_palette(materials, 3, 32), std::invalid_argument);
}

TEST_CASE("Random numbers match the published ones, and streams of a seed differ", "[simulate][random]") {
  // SplitMix64 from state 1234567: the published first outputs.
  CHECK(mix_bits(1234567 + 0x9e3779b97f4a7c15ULL) == 6457827717110365317ULL);
  CHECK(mix_bits(1234567 + 2 * 0x9e3779b97f4a7c15ULL) == 3203168211198807973ULL);
  Random a(1, 0);
  Random b(1, 1);
  CHECK(a.bits() != b.bits());
  double sum = 0.0;
  constexpr int kCount = 10000;
  for (int i = 0; i < kCount; ++i) {
    const double x = a.uniform(2.0, 4.0);
    REQUIRE((x >= 2.0 && x < 4.0));
    sum += x;
    REQUIRE(a.integer(-2, 2) >= -2);
    REQUIRE(a.integer(-2, 2) <= 2);
  }
  CHECK(std::abs(sum / kCount - 3.0) < 5.0 * 2.0 / std::sqrt(12.0 * kCount));  // five standard errors
}
