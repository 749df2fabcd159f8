// SPDX-License-Identifier: MIT
#include "simulator/world/props.hpp"

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

/// Builds a lorry. Cab and body are boxes on a frame; windows, doors, images and lamps lie a centimetre in
/// front of these.
class LorryBuilder {
 public:
  LorryBuilder(Mesh& mesh, Random& random, const Palette& palette)
      : mesh_(mesh), random_(random), palette_(palette) {
    cab_ = varied_paint(random, palette.metal, 0.4, 1.4);
    body_ = varied_paint(random, palette.metal, 0.8, 1.8);
    black_ = {palette.metal, 0.16, false, shift(), shift()};
    glass_ = varied_paint(random, palette.glass, 0.8, 1.3);
    poster_ = {random.pick(palette.signs), random.uniform(0.8, 1.3), true};
  }

  void build() {
    mesh_.box({-0.9 * kHalfWidth, 0.4, -kHalfLength + 0.1}, {0.9 * kHalfWidth, kDeck, kHalfLength - 0.2},
              black_);
    mesh_.rectangle({-kHalfWidth, 0.04, kHalfLength}, 2.0 * kHalfWidth * Vector3d::UnitX(),
                    -2.0 * kHalfLength * Vector3d::UnitZ(), black_);  // the dark road underneath
    mesh_.box({-kHalfWidth, kDeck, -kHalfLength}, {kHalfWidth, LorrySize::kHeight_m, kCabBack - 0.15}, body_);
    mesh_.box({-0.95 * kHalfWidth, 0.45, kCabBack}, {0.95 * kHalfWidth, kCabRoof, kHalfLength}, cab_);
    for (const double side : {-1.0, 1.0}) flank(side);
    front();
    tail();
  }

 private:
  static constexpr double kHalfWidth = 0.5 * LorrySize::kWidth_m;
  static constexpr double kHalfLength = 0.5 * LorrySize::kLength_m;
  static constexpr double kDeck = 0.9;
  static constexpr double kCabBack = kHalfLength - 1.7;
  static constexpr double kCabRoof = 2.3;

  [[nodiscard]] double shift() { return random_.uniform(0.0, 64.0); }

  void flank(double side) {
    const Vector3d along(0.0, 0.0, -side);
    const auto add = [&](const Patch& patch, double out, const Paint& look) {
      mesh_.centred_rectangle({side * out, patch.y_m, patch.x_m}, patch.width_m * along,
                              patch.height_m * Vector3d::UnitY(), look);
    };
    const double body_middle = 0.5 * (kCabBack - 0.15 - kHalfLength);
    add({body_middle, 1.95, 2.6, 1.4}, kHalfWidth + 0.01, poster_);
    add({body_middle, 1.02, 3.4, 0.08}, kHalfWidth + 0.01, black_);
    add({kCabBack + 1.0, 1.75, 1.0, 0.65}, 0.95 * kHalfWidth + 0.01, glass_);
    add({kCabBack + 0.35, 1.3, 0.03, 1.5}, 0.95 * kHalfWidth + 0.01, black_);
    const Paint rim{random_.pick(palette_.wheels), 0.9, true};
    for (const double z : {-0.55 * kHalfLength, 0.68 * kHalfLength}) {
      add_wheel(mesh_, palette_, {{side * (kHalfWidth + 0.01), 0.48, z}, 0.48, side, rim});
    }
  }

  /// Part of the front (end = 1) or the tail (end = -1).
  void add(double end, const Patch& patch, const Paint& look) {
    mesh_.centred_rectangle({patch.x_m, patch.y_m, end * (kHalfLength + 0.012)},
                            end * patch.width_m * Vector3d::UnitX(), patch.height_m * Vector3d::UnitY(),
                            look);
  }

  void front() {
    const Paint lamp{random_.pick(palette_.windows), 1.6, true};
    add(1.0, {0.0, 1.75, 1.7, 0.75}, glass_);
    add(1.0, {0.0, 1.05, 1.2, 0.3}, black_);
    for (const double x : {-0.75, 0.75}) add(1.0, {x, 0.75, 0.36, 0.2}, lamp);
  }

  void tail() {
    const Paint lamp{random_.pick(palette_.windows), 0.8, true};
    add(-1.0, {0.0, 1.9, 0.03, 1.9}, black_);  // between the wings of the door
    for (const double x : {-0.35, 0.35}) add(-1.0, {x, 1.9, 0.05, 1.8}, black_);
    for (const double x : {-0.68, 0.68})
      add(-1.0, {x, 2.3, 0.5, 0.5}, {random_.pick(palette_.signs), 1.2, true});
    for (const double x : {-0.8, 0.8}) add(-1.0, {x, 0.75, 0.3, 0.18}, lamp);
    add(-1.0, {0.0, 0.7, 0.52, 0.11}, {random_.pick(palette_.signs), 1.4, true});
  }

  Mesh& mesh_;
  Random& random_;
  const Palette& palette_;
  Paint cab_;
  Paint body_;
  Paint black_;
  Paint glass_;
  Paint poster_;
};

}  // namespace

void add_lorry(Mesh& mesh, Random& random, const Palette& palette) {
  LorryBuilder(mesh, random, palette).build();
}

}  // namespace stereo_slam::simulator
