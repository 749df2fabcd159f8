// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/saved_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>

#include <Eigen/Cholesky>
#include <fmt/format.h>

namespace stereo_slam {
namespace {

constexpr double kFarthest_m = 1e9;
constexpr std::uint32_t kMostLandmarks = 1U << 31;  // leaves room for the ids of a run
constexpr std::size_t kMostFrames = std::size_t{1} << 53;
constexpr double kRounding = 1e-6;  // of a correlation coefficient

[[noreturn]] void refuse(std::string_view where, std::string_view what) {
  throw std::invalid_argument(fmt::format("{} {}", where, what));
}

void require(bool condition, std::string_view where, std::string_view what) {
  if (!condition) refuse(where, what);
}

/// Symmetric and without a negative variance in any direction, whatever the units of its rows.
template <int N>
[[nodiscard]] bool is_covariance(const antipode::Matrix<double, N>& P) {
  using Vector = antipode::Vector<double, N>;
  using Matrix = antipode::Matrix<double, N>;
  const Vector sigma = P.diagonal().cwiseSqrt();  // NaN for a negative variance
  const Matrix bound = sigma * sigma.transpose();
  if (!P.allFinite() || !bound.allFinite()) return false;
  if (((P - P.transpose()).array().abs() > kRounding * bound.array()).any()) return false;
  if ((P.array().abs() > (1.0 + kRounding) * bound.array()).any()) return false;
  const Vector scale = sigma.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  const Matrix correlation = scale.asDiagonal() * P * scale.asDiagonal();
  return Eigen::LLT<Matrix>(correlation + kRounding * Matrix::Identity()).info() == Eigen::Success;
}

template <int N>
[[nodiscard]] bool is_positive_definite(const antipode::Matrix<double, N>& P) {
  return is_covariance<N>(P) && Eigen::LLT<antipode::Matrix<double, N>>(P).info() == Eigen::Success;
}

[[nodiscard]] bool is_near(const Vector3<double>& position) {
  return position.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= kFarthest_m;
}

void check_pose(const Pose& pose, std::string_view where) {
  try {
    static_cast<void>(Pose::from_coefficients(pose.coeffs()));
  } catch (const std::invalid_argument& error) {
    refuse(where, fmt::format("is {}", error.what()));
  }
  require(is_near(pose.translation()), where, "is farther than 1e9 m");
}

void check_estimate(const PoseGaussian& estimate, std::string_view where) {
  check_pose(estimate.pose, where);
  require(is_covariance<6>(estimate.covariance), where, "has a matrix that is not a covariance");
}

/// A relative pose is an edge of the pose graph.
void check_relative(const PoseGaussian& estimate, std::string_view where) {
  check_estimate(estimate, where);
  require(is_positive_definite<6>(estimate.covariance), where,
          "has a covariance that is not positive definite");
}

void check_camera(const StereoCamera& camera) {
  const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
  require(positive(camera.fx) && positive(camera.fy), "camera", "has no positive focal length");
  require(std::isfinite(camera.cx) && std::isfinite(camera.cy), "camera", "has no finite principal point");
  require(positive(camera.baseline_m), "camera", "has no positive baseline");
  require(camera.width_px > 0 && camera.height_px > 0, "camera", "has an image without pixels");
}

void check_rectification(const RectificationEstimate& estimate, const StereoCamera& camera) {
  const std::string_view where = "rectification";
  require(estimate.coefficients.allFinite() && estimate.lens.allFinite() && estimate.row_vector.allFinite() &&
              estimate.disparity_vector.allFinite(),
          where, "is not finite");
  require(estimate.coefficients.cwiseAbs().maxCoeff() < camera.width_px &&
              LensResidual(camera, estimate.lens).is_moderate(),
          where, "moves points out of the image");
  require(
      is_positive_definite(estimate.row_information) && is_positive_definite(estimate.disparity_information),
      where, "has an information that is not positive definite");
}

/// Largest shift of a point by the correction of the lens, in image widths: a moderate lens has less.
constexpr double kMostLensShift = 0.25;

void check_point(const KeyframePoint& point, const StereoCamera& camera, std::string_view where) {
  const StereoPoint z = measurement(point);
  require(z.allFinite(), where, "has a point that is not finite");
  const double margin_px = kMostLensShift * camera.width_px;
  const auto is_inside = [margin_px](double px, int size_px) {
    return px >= -margin_px && px <= size_px + margin_px;
  };
  require(is_inside(z.x(), camera.width_px) && is_inside(z.y(), camera.height_px), where,
          "has a point outside the image");
  require(z.z() >= 0.0, where, "has a point with a negative disparity");
  require(point.landmark <= kMostLandmarks, where, "has a point with a landmark id beyond 2^31");
}

void check_keyframe(const Keyframe& keyframe, const StereoCamera& camera, std::string_view where) {
  check_estimate(keyframe.T_previous_keyframe, fmt::format("{}: T_previous_keyframe", where));
  check_estimate(keyframe.T_world_keyframe, fmt::format("{}: T_world_keyframe", where));
  require(keyframe.frame <= kMostFrames, where, "has a frame index beyond 2^53");
  require(keyframe.path_length_m >= 0.0 && std::isfinite(keyframe.path_length_m), where,
          "has no valid path length");
  for (const auto& point : keyframe.points) check_point(point, camera, where);
}

void check_succession(const Keyframe& previous, const Keyframe& keyframe, std::string_view where) {
  require(keyframe.frame > previous.frame, where, "is not of a later frame than the keyframe before");
  require(keyframe.segment >= previous.segment, where, "is of an earlier segment than the keyframe before");
  require(keyframe.segment <= previous.segment + 1, where, "skips a segment");
  require(keyframe.path_length_m >= previous.path_length_m, where,
          "has a shorter path length than the keyframe before");
  check_relative(keyframe.T_previous_keyframe, fmt::format("{}: T_previous_keyframe", where));
}

void check_loop(const PoseGraphEdge& loop, std::size_t keyframes, std::string_view where) {
  require(loop.from < keyframes && loop.to < keyframes, where,
          fmt::format("connects keyframe {} with {} of {}", loop.from, loop.to, keyframes));
  require(loop.from != loop.to, where, fmt::format("connects keyframe {} with itself", loop.from));
  check_relative(loop.T_from_to, where);
}

void check_map_point(const MapPoint& point, std::size_t keyframes, std::string_view where) {
  require(is_near(point.position_world), where, "is not finite, or farther than 1e9 m");
  require(point.keyframe < keyframes, where,
          fmt::format("belongs to keyframe {} of {}", point.keyframe, keyframes));
  require(point.landmark <= kMostLandmarks, where, "has a landmark id beyond 2^31");
}

}  // namespace

void check_camera_of(const SavedMap& map, const StereoCamera& camera) {
  const auto parameters = [](const StereoCamera& c) {
    return std::array{c.fx, c.fy, c.cx, c.cy, c.fx * c.baseline_m};
  };
  const auto a = parameters(map.camera);
  const auto b = parameters(camera);
  const bool same = std::equal(a.begin(), a.end(), b.begin(),
                               [](double x, double y) { return std::abs(x - y) <= 1e-3 * std::abs(y); });
  if (!same || map.camera.width_px != camera.width_px || map.camera.height_px != camera.height_px) {
    throw std::invalid_argument("it was made with another camera, or with its images at another size");
  }
}

void check(const SavedMap& map) {
  check_camera(map.camera);
  check_rectification(map.rectification, map.camera);
  for (std::size_t id = 0; id < map.keyframes.size(); ++id) {
    const std::string where = fmt::format("keyframe {}", id);
    require(map.keyframes[id].id == id, where, fmt::format("has the id {}", map.keyframes[id].id));
    check_keyframe(map.keyframes[id], map.camera, where);
    if (id == 0) {
      require(map.keyframes[id].segment == 0, where, "is not of segment 0");
    } else {
      check_succession(map.keyframes[id - 1], map.keyframes[id], where);
    }
  }
  for (std::size_t i = 0; i < map.loops.size(); ++i) {
    check_loop(map.loops[i], map.keyframes.size(), fmt::format("loop {}", i));
  }
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    check_map_point(map.points[i], map.keyframes.size(), fmt::format("map point {}", i));
  }
}

}  // namespace stereo_slam
