// SPDX-License-Identifier: MIT
#include "stereo_slam/calibration/lens_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numbers>

#include <fmt/format.h>

#include "stereo_slam/images/image_size.hpp"

namespace stereo_slam {
namespace {

struct Model {
  std::string_view name;
  Distortion distortion;
};
constexpr Model kModels[] = {{"radtan", Distortion::kRadTan},
                             {"equidistant", Distortion::kEquidistant},
                             {"none", Distortion::kNone},
                             {"radial-tangential", Distortion::kRadTan},
                             {"plumb_bob", Distortion::kRadTan},
                             {"fisheye", Distortion::kEquidistant},
                             {"rational_polynomial", Distortion::kRadTan},
                             {"equi", Distortion::kEquidistant}};

}  // namespace

void set_size(Lens& lens, const std::vector<double>& size, const Fail& fail) {
  constexpr double kMaxSide_px = 20000.0;
  const auto is_side = [](double x) { return x >= 16.0 && x <= kMaxSide_px && x == std::floor(x); };
  if (size.size() != 2 || !std::all_of(size.begin(), size.end(), is_side))
    return fail("resolution must be [width, height] in pixels");
  lens.width_px = static_cast<int>(size[0]);
  lens.height_px = static_cast<int>(size[1]);
  if (static_cast<std::uint64_t>(lens.width_px) * static_cast<std::uint64_t>(lens.height_px) > kMostPixels) {
    fail(fmt::format("resolution is {} x {}; images may have up to {} pixels", lens.width_px, lens.height_px,
                     kMostPixels));
  }
}

void set_pinhole(Lens& lens, const std::vector<double>& intrinsics, const Fail& fail) {
  if (intrinsics.size() != 4) return fail("the intrinsics must be [fx, fy, cx, cy]");
  lens.fx = intrinsics[0];
  lens.fy = intrinsics[1];
  lens.cx = intrinsics[2];
  lens.cy = intrinsics[3];
  if (!(lens.fx > 0.0 && lens.fy > 0.0))
    return fail(
        fmt::format("intrinsics has focal lengths {} and {}; both must be positive", lens.fx, lens.fy));
  const bool inside = lens.cx > 0.0 && lens.cy > 0.0 &&
                      (lens.width_px == 0 || (lens.cx < lens.width_px && lens.cy < lens.height_px));
  if (!inside) {
    fail(fmt::format(
        "the principal point ({}, {}) lies outside the {}x{} images; intrinsics is [fx, fy, cx, cy]", lens.cx,
        lens.cy, lens.width_px, lens.height_px));
  }
}

void set_camera_matrix(Lens& lens, const std::vector<double>& K, const Fail& fail) {
  constexpr double kMostSkew = 1e-4;  // of fx
  constexpr double kTolerance = 1e-6;
  const auto is = [&](std::size_t i, double value) { return std::abs(K[i] - value) <= kTolerance; };
  if (K.size() != 9 || !is(3, 0.0) || !is(6, 0.0) || !is(7, 0.0) || !is(8, 1.0))
    return fail("the camera matrix is not [fx 0 cx; 0 fy cy; 0 0 1]; write it in pixels, row by row");
  if (!(std::abs(K[1]) <= kMostSkew * std::abs(K[0]))) {
    return fail(fmt::format(
        "the camera matrix has a skew of {:.6g}, its second number, which must be 0; calibrate without skew, "
        "for a fisheye with CALIB_FIX_SKEW",
        K[1]));
  }
  set_pinhole(lens, {K[0], K[4], K[2], K[5]}, fail);
}

bool is_model_name(std::string_view name) {
  return std::any_of(std::begin(kModels), std::end(kModels), [&](const auto& m) { return m.name == name; });
}

void set_model(Lens& lens, std::string_view name, const Fail& fail) {
  const auto* model =
      std::find_if(std::begin(kModels), std::end(kModels), [&](const auto& m) { return m.name == name; });
  if (model == std::end(kModels)) {
    return fail(
        fmt::format("distortion_model is {}, but must be radtan (radial-tangential, plumb_bob), "
                    "equidistant (fisheye) or none; calibrate with one of them",
                    name));
  }
  lens.distortion = model->distortion;
}

void set_coefficients(Lens& lens, std::vector<double> coefficients, const Fail& fail) {
  constexpr std::size_t kRational = 8;
  constexpr std::size_t kFisheye = 4;
  const bool radtan = lens.distortion == Distortion::kRadTan;
  const std::size_t most = radtan ? kRational : kFisheye;
  const auto is_zero = [](double k) { return k == 0.0; };
  if (coefficients.size() > most &&
      std::all_of(coefficients.begin() + static_cast<std::ptrdiff_t>(most), coefficients.end(), is_zero))
    coefficients.resize(most);
  const auto count = coefficients.size();
  constexpr std::size_t kThinPrism = 12;
  if (radtan && (count == kThinPrism || count == kThinPrism + 2)) {
    return fail(fmt::format(
        "radtan has {} distortion coefficients, of which those after the eighth (thin prism, tilted "
        "sensor) are not zero and not read; calibrate without them",
        count));
  }
  if (count != 4 && !(radtan && (count == 5 || count == kRational))) {
    return fail(fmt::format("{} has {} distortion coefficients, but needs {}",
                            radtan ? "radtan" : "equidistant", count,
                            radtan ? "4, 5 or 8 (k1 k2 p1 p2 [k3 [k4 k5 k6]])" : "4 (k1 k2 k3 k4)"));
  }
  lens.coefficients = std::move(coefficients);
}

bool agree(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  constexpr double kAngle_rad = 0.5 * std::numbers::pi / 180.0;
  constexpr double kLength_m = 1e-3;
  constexpr double kShare = 0.02;
  const double angle_rad = Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
  const double apart_m = (a.translation() - b.translation()).norm();
  return angle_rad <= kAngle_rad && apart_m <= kLength_m + kShare * a.translation().norm();
}

}  // namespace stereo_slam
