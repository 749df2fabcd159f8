// SPDX-License-Identifier: MIT
#include "stereo_slam/calibration/given_distortion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include <fmt/format.h>

namespace stereo_slam {
namespace {

constexpr std::size_t kAmbiguous = 4;

[[nodiscard]] bool all_zero(const std::vector<double>& coefficients) {
  return std::all_of(coefficients.begin(), coefficients.end(), [](double k) { return k == 0.0; });
}

/// Distance of the image's farthest border from the principal point, in focal lengths. Without an image size,
/// the principal point is taken for the middle.
[[nodiscard]] double farthest_border(const Lens& lens) {
  const double right = lens.width_px > 0 ? lens.width_px - lens.cx : lens.cx;
  const double bottom = lens.height_px > 0 ? lens.height_px - lens.cy : lens.cy;
  return std::max({lens.cx / lens.fx, right / lens.fx, lens.cy / lens.fy, bottom / lens.fy});
}

/// Where the image radius x (1 + a x^2 + b x^4 + c x^6 + d x^8) reaches `radius`; nothing if it stops growing
/// before, or if x would exceed `most`.
[[nodiscard]] std::optional<double> reaches(double radius, const std::vector<double>& k, double most) {
  constexpr int kSteps = 1000;
  constexpr double kLeast =
      0.05;  // three degrees; only coefficients that are no lens's reach a border so early
  double before = 0.0;
  for (int i = 1; i <= kSteps; ++i) {
    const double x = most * i / kSteps;
    double factor = 0.0;
    for (std::size_t n = k.size(); n > 0; --n) factor = (factor + k[n - 1]) * x * x;
    const double grown = x * (1.0 + factor);
    if (!(grown > before)) return std::nullopt;
    if (grown >= radius) return x >= kLeast ? std::optional(x) : std::nullopt;
    before = grown;
  }
  return std::nullopt;
}

[[nodiscard]] bool is_ambiguous(const GivenDistortion& given) {
  return given.model.empty() && given.coefficients.size() == kAmbiguous;
}

/// The name of the model of lenses of which at least one has four coefficients and no model. Calls `fail` if
/// it cannot be told.
[[nodiscard]] std::string model_of_four(const StereoRig& rig, const GivenDistortion& left,
                                        const GivenDistortion& right, const Fail& fail) {
  for (const auto* given : {&left, &right}) {
    if (!given->model.empty()) return given->model;
    if (given->coefficients.size() > kAmbiguous) return "radtan";
  }
  const auto both_can_be = [&](Distortion model) {
    return is_ambiguous(left) && is_ambiguous(right) && can_be(model, rig.left, left.coefficients) &&
           can_be(model, rig.right, right.coefficients);
  };
  const bool radtan = both_can_be(Distortion::kRadTan);
  const bool equidistant = both_can_be(Distortion::kEquidistant);
  if (radtan && all_zero(left.coefficients) && all_zero(right.coefficients)) return "none";
  if (radtan == equidistant) {
    fail(
        "has four distortion coefficients and no model: they may be k1 k2 p1 p2 of an ordinary lens or k1 k2 "
        "k3 k4 of a "
        "fisheye; say which by `distortion_model: plumb_bob` or, if cv::fisheye wrote them, by "
        "`distortion_model: "
        "equidistant`");
  }
  return radtan ? "radtan" : "equidistant";
}

void set_one(Lens& lens, const GivenDistortion& given, const char* side, const Fail& fail_rig) {
  const auto fail = [&](const std::string& what) { fail_rig(fmt::format("the {} camera: {}", side, what)); };
  if (!given.model.empty()) {
    set_model(lens, given.model, fail);
  } else {
    lens.distortion = Distortion::kRadTan;
  }
  const bool radtan = lens.distortion == Distortion::kRadTan;
  if (radtan && given.coefficients.empty()) lens.distortion = Distortion::kNone;
  if (lens.distortion != Distortion::kNone) set_coefficients(lens, given.coefficients, fail);
}

}  // namespace

bool can_be(Distortion model, const Lens& lens, const std::vector<double>& coefficients) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const double border = farthest_border(lens);
  if (model == Distortion::kEquidistant) {
    constexpr double kLeastK1 = -0.2;
    return coefficients[0] >= kLeastK1 && reaches(border, coefficients, 115.0 * kDegree).has_value();
  }
  constexpr double kMostTangential = 0.03;
  const bool tangential = std::max(std::abs(coefficients[2]), std::abs(coefficients[3])) <= kMostTangential;
  return tangential &&
         reaches(border, {coefficients[0], coefficients[1]}, std::tan(60.0 * kDegree)).has_value();
}

void set_distortions(StereoRig& rig, const GivenDistortion& left, const GivenDistortion& right,
                     const Fail& fail) {
  GivenDistortion of_left = left;
  GivenDistortion of_right = right;
  if (is_ambiguous(left) || is_ambiguous(right)) {
    const std::string model = model_of_four(rig, left, right, fail);
    for (auto* given : {&of_left, &of_right}) {
      if (given->model.empty()) given->model = model;
    }
  }
  set_one(rig.left, of_left, "left", fail);
  set_one(rig.right, of_right, "right", fail);
}

}  // namespace stereo_slam
