// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>
#include <vector>

#include "simulator/world/props.hpp"

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector3d;

/// Builds a car. The body is an extruded side view, the cabin a frustum of glass; all other parts lie a few
/// millimetres in front of these.
class CarBuilder {
 public:
  CarBuilder(Mesh& mesh, Random& random, const Palette& palette)
      : mesh_(mesh), random_(random), palette_(palette) {
    const bool is_dark = random.chance(0.5);
    paint_ = varied_paint(random, palette.metal, is_dark ? 0.2 : 1.0, is_dark ? 0.6 : 1.9);
    black_ = {palette.metal, 0.16, false, shift(), shift()};
    glass_ = varied_paint(random, palette.glass, 0.8, 1.3);
    waist_ = random.uniform(0.82, 0.95);
    roof_ = waist_ + random.uniform(0.48, 0.65);
    is_estate_ = random.chance(0.5);
  }

  void build() {
    body();
    cabin();
    for (const double side : {-1.0, 1.0}) flank(side);
    for (const double end : {-1.0, 1.0}) face(end);
  }

 private:
  static constexpr double kHalfWidth = 0.5 * CarSize::kWidth_m;
  static constexpr double kHalfLength = 0.5 * CarSize::kLength_m;
  static constexpr double kGround = 0.2;  ///< clearance

  [[nodiscard]] double shift() { return random_.uniform(0.0, 64.0); }

  void body() {
    const double rear_deck = is_estate_ ? waist_ : waist_ - 0.04;
    const std::vector<Eigen::Vector2d> outline = {
        // (z, y), counter-clockwise seen from the left
        {-kHalfLength + 0.08, kGround},   {kHalfLength - 0.1, kGround}, {kHalfLength, 0.42},
        {kHalfLength - 0.06, 0.66},       {0.45 * kHalfLength, waist_}, {-0.62 * kHalfLength, waist_},
        {-kHalfLength + 0.05, rear_deck}, {-kHalfLength, 0.5}};
    std::vector<Vector3d> left;
    std::vector<Vector3d> right;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d& a = outline[i];
      const Eigen::Vector2d& b = outline[(i + 1) % outline.size()];
      left.emplace_back(-kHalfWidth, a.y(), a.x());
      right.insert(right.begin(), Vector3d(kHalfWidth, a.y(), a.x()));
      const Vector3d edge(0.0, b.y() - a.y(), b.x() - a.x());
      mesh_.rectangle({-kHalfWidth, a.y(), a.x()}, 2.0 * kHalfWidth * Vector3d::UnitX(), edge, paint_);
    }
    mesh_.polygon(left, Vector3d::UnitZ(), Vector3d::UnitY(), paint_);
    mesh_.polygon(right, -Vector3d::UnitZ(), Vector3d::UnitY(), paint_);
    // The dark road underneath.
    mesh_.rectangle({-kHalfWidth, 0.04, kHalfLength}, 2.0 * kHalfWidth * Vector3d::UnitX(),
                    -2.0 * kHalfLength * Vector3d::UnitZ(), black_);
  }

  void cabin() {
    const double tail = is_estate_ ? -kHalfLength + 0.12 : -0.62 * kHalfLength;
    const double bottom_x = kHalfWidth - 0.05;
    const double top_x = kHalfWidth - 0.2;
    const Vector3d a(bottom_x, waist_, 0.45 * kHalfLength);
    const Vector3d b(top_x, roof_, 0.12 * kHalfLength);
    const Vector3d c(top_x, roof_, tail + 0.3);
    const Vector3d d(bottom_x, waist_, tail);
    const auto mirrored = [](const Vector3d& p) { return Vector3d(-p.x(), p.y(), p.z()); };
    const Vector3d x = Vector3d::UnitX();
    const Vector3d y = Vector3d::UnitY();
    const Vector3d z = Vector3d::UnitZ();
    mesh_.polygon({mirrored(a), a, b, mirrored(b)}, x, b - a, glass_);
    mesh_.polygon({d, mirrored(d), mirrored(c), c}, -x, c - d, glass_);
    mesh_.polygon({mirrored(b), b, c, mirrored(c)}, x, -z, paint_);
    mesh_.polygon({a, d, c, b}, -z, y, glass_);
    mesh_.polygon({mirrored(d), mirrored(a), mirrored(b), mirrored(c)}, z, y, glass_);
    // Pillars and the frame of the roof.
    for (const double side : {-1.0, 1.0}) {
      const Vector3d out = 0.012 * side * x;
      const auto on_side = [&](const Vector3d& p) -> Vector3d {
        return (side > 0.0 ? p : mirrored(p)) + out;
      };
      const auto bar = [&](const Vector3d& from, const Vector3d& to, double width) {
        const Vector3d across = -side * width * z;
        const Vector3d start = on_side(from) - 0.5 * across;
        mesh_.rectangle(start, across, on_side(to) - on_side(from), paint_);
      };
      const auto between = [](const Vector3d& p, const Vector3d& q, double t) -> Vector3d {
        return p + t * (q - p);
      };
      bar(between(a, d, 0.47), between(b, c, 0.42), 0.09);
      bar(between(a, d, 0.03), between(b, c, 0.03), 0.07);
      bar(between(a, d, 0.96), between(b, c, 0.95), is_estate_ ? 0.12 : 0.2);
    }
  }

  void flank(double side) {
    const Vector3d along(0.0, 0.0, -side);
    const Vector3d up = Vector3d::UnitY();
    const auto add = [&](const Patch& patch, double offset_m, const Paint& look) {
      mesh_.centred_rectangle({side * (kHalfWidth + offset_m), patch.y_m, patch.x_m}, patch.width_m * along,
                              patch.height_m * up, look);
    };
    const Paint rim{random_.pick(palette_.wheels), 0.9, true};
    for (const double z : {-0.6 * kHalfLength, 0.63 * kHalfLength}) {
      const Vector3d hub(side * (kHalfWidth + 0.012), 0.31, z);
      mesh_.disc(hub + Vector3d(-0.008 * side, 0.05, 0.0), 0.38, side, black_);  // the wheel's well
      add_wheel(mesh_, palette_, {hub, 0.31, side, rim});
    }
    for (const double z : {-0.3 * kHalfLength, 0.04 * kHalfLength, 0.4 * kHalfLength}) {
      add({z, 0.58, 0.02, waist_ - 0.35}, 0.006, black_);  // seams of the doors
    }
    for (const double z : {-0.24 * kHalfLength, 0.1 * kHalfLength}) add({z, 0.76, 0.15, 0.035}, 0.01, black_);
    add({0.05, 0.5, 2.0, 0.05}, 0.008, black_);
    const double mirror_x = side * (kHalfWidth + 0.06);
    mesh_.box({mirror_x - 0.07, waist_ + 0.02, 0.36 * kHalfLength},
              {mirror_x + 0.07, waist_ + 0.13, 0.36 * kHalfLength + 0.08}, paint_);
  }

  void face(double end) {
    const Vector3d along = end * Vector3d::UnitX();
    const Vector3d up = Vector3d::UnitY();
    const auto add = [&](const Patch& patch, const Paint& look) {
      mesh_.centred_rectangle({patch.x_m, patch.y_m, end * (kHalfLength + 0.012)}, patch.width_m * along,
                              patch.height_m * up, look);
    };
    add({0.0, 0.3, 1.6, 0.12}, black_);
    add({0.0, 0.44, 0.52, 0.11}, {random_.pick(palette_.signs), 1.4, true});
    const Paint lamp{random_.pick(palette_.windows), end > 0.0 ? 1.6 : 0.8, true};
    for (const double x : {-0.66, 0.66}) add({x, 0.6, 0.34, 0.15}, lamp);
    if (end > 0.0) add({0.0, 0.58, 0.7, 0.1}, black_);
  }

  Mesh& mesh_;
  Random& random_;
  const Palette& palette_;
  Paint paint_;
  Paint black_;
  Paint glass_;
  double waist_ = 0.9;
  double roof_ = 1.45;
  bool is_estate_ = false;
};

}  // namespace

void add_wheel(Mesh& mesh, const Palette& palette, const Wheel& wheel) {
  mesh.disc(wheel.hub, wheel.radius_m, wheel.side, {palette.metal, 0.3});
  mesh.disc(wheel.hub + 0.008 * wheel.side * Vector3d::UnitX(), 0.87 * wheel.radius_m, wheel.side, wheel.rim);
}

void add_car(Mesh& mesh, Random& random, const Palette& palette) {
  CarBuilder(mesh, random, palette).build();
}

}  // namespace stereo_slam::simulator
