// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stereo_slam/core/tilt_measurement.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/rig/lens_residual.hpp"

namespace stereo_slam {

/// Corner of a keyframe's left image that has a disparity.
struct KeyframePoint {
  Vector3<float> z;  ///< (u, v, d), px: their noise is Gaussian for near and far points
  Descriptor descriptor{};
  std::uint32_t landmark = 0;  ///< id of its landmark; 0: none
};

/// A keyframe without its image: points to recognise the place and to measure the pose of another frame
/// relative to it, and a node of the pose graph.
struct Keyframe {
  std::size_t id = 0;  ///< index in the graph
  std::size_t frame = 0;
  std::int64_t stamp_ns = 0;
  std::size_t segment = 0;  ///< of the map; a loss begins a new one
  std::vector<KeyframePoint> points;
  PoseGaussian T_previous_keyframe;  ///< pose relative to the keyframe before; unused for the first keyframe
  std::optional<TiltMeasurement> tilt{};  ///< by gravity, relative to the first keyframe of the run
  PoseGaussian T_world_keyframe;          ///< current estimate, without the common error; loops correct it
  double path_length_m = 0.0;             ///< from the first keyframe, along the keyframes
};

/// The pose of a keyframe relative to the one before, and its tilt, by the keyframe's id.
struct KeyframeLink {
  std::size_t keyframe = 0;
  PoseGaussian T_previous_keyframe;
  std::optional<TiltMeasurement> tilt{};
};

/// Points of a keyframe with the ids of their landmarks, one per point. Without ids no point has a landmark.
[[nodiscard]] std::vector<KeyframePoint> keyframe_points(const StereoPoints& points,
                                                         const std::vector<std::uint32_t>& landmarks);

/// Computes the descriptors of the points from the left image of their keyframe.
void describe(std::vector<KeyframePoint>& points, const cv::Mat& left, const LensResidual& lens);

/// Number of landmarks that both keyframes observe: the weight of their edge in the covisibility graph.
[[nodiscard]] std::size_t shared_landmarks(const Keyframe& a, const Keyframe& b);

/// (u, v, d) of a point.
[[nodiscard]] inline StereoPoint measurement(const KeyframePoint& point) { return point.z.cast<double>(); }

}  // namespace stereo_slam
