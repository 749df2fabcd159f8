// SPDX-License-Identifier: MIT
#include "stereo_slam/calibration/camera_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "stereo_slam/images/image_size.hpp"

namespace stereo_slam {
namespace {

constexpr double kLeast = 1e-6;  // focal lengths, px, and baselines, m
constexpr double kMost = 1e6;

[[nodiscard]] bool is_sane(double value) { return value >= kLeast && value <= kMost; }

/// What a StereoCamera and a Lens have in common.
struct Pinhole {
  double fx, fy, cx, cy;
  int width_px, height_px;
};

void require_pinhole(const Pinhole& camera, std::string_view name) {
  const auto& [fx, fy, cx, cy, width_px, height_px] = camera;
  if (!(is_sane(fx) && is_sane(fy))) {
    throw std::invalid_argument(
        fmt::format("{} has focal lengths {} and {} px; both must be positive, from {} to {}", name, fx, fy,
                    kLeast, kMost));
  }
  if (!(std::isfinite(cx) && std::isfinite(cy)))
    throw std::invalid_argument(fmt::format("{} has the principal point ({}, {})", name, cx, cy));
  if (width_px == 0 && height_px == 0) return;  // known with the first images
  if (width_px <= 0 || height_px <= 0 ||
      static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px) > kMostPixels) {
    throw std::invalid_argument(fmt::format("{} has images of {}x{} px; there must be from 1 to {} pixels",
                                            name, width_px, height_px, kMostPixels));
  }
  if (!(cx > 0.0 && cx < width_px && cy > 0.0 && cy < height_px)) {
    throw std::invalid_argument(
        fmt::format("{} has the principal point ({:.6g}, {:.6g}), which lies outside the {}x{} images", name,
                    cx, cy, width_px, height_px));
  }
}

void require_lens(const Lens& lens, std::string_view name) {
  require_pinhole({lens.fx, lens.fy, lens.cx, lens.cy, lens.width_px, lens.height_px}, name);
  if (lens.distortion == Distortion::kNone) return;
  const std::size_t count = lens.coefficients.size();
  const bool radtan = lens.distortion == Distortion::kRadTan;
  if (count != 4 && !(radtan && (count == 5 || count == 8))) {
    throw std::invalid_argument(fmt::format("{} has {} distortion coefficients; {}", name, count,
                                            radtan ? "radtan needs 4, 5 or 8" : "equidistant needs 4"));
  }
  if (!std::ranges::all_of(lens.coefficients, [](double k) { return std::isfinite(k); }))
    throw std::invalid_argument(fmt::format("{} has distortion coefficients that are not finite", name));
}

void require_rigid(const Eigen::Isometry3d& T, std::string_view name) {
  constexpr double kTolerance = 1e-2;  // calibrations are written with few digits
  const Eigen::Matrix3d R = T.linear();
  const double defect = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(R.allFinite() && defect < kTolerance && R.determinant() > 0.0))
    throw std::invalid_argument(fmt::format("{} has no rotation in its left 3x3 block", name));
  const Eigen::Vector3d t_m = T.translation();
  if (!(t_m.allFinite() && t_m.cwiseAbs().maxCoeff() <= kMost)) {
    throw std::invalid_argument(
        fmt::format("{} has the translation ({}, {}, {}) m; it must be finite, up to {}", name, t_m.x(),
                    t_m.y(), t_m.z(), kMost));
  }
}

}  // namespace

void require_valid(const StereoCamera& camera) {
  require_pinhole({camera.fx, camera.fy, camera.cx, camera.cy, camera.width_px, camera.height_px},
                  "the camera");
  if (is_sane(camera.baseline_m)) return;
  throw std::invalid_argument(
      fmt::format("the camera has a baseline of {} m; it must be positive, from {} to {}", camera.baseline_m,
                  kLeast, kMost));
}

void require_valid(const StereoRig& rig) {
  require_lens(rig.left, "the left camera");
  require_lens(rig.right, "the right camera");
  require_rigid(rig.T_right_left, "T_right_left");
  if (rig.T_body_left) require_rigid(*rig.T_body_left, "T_body_left");
}

}  // namespace stereo_slam
