// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"

namespace stereo_slam {

/// Corner of a keyframe's left image that has a disparity.
struct KeyframePoint {
  Vector3<float> z;  ///< (u, v, d), px: in these the noise is Gaussian, near and far
  Descriptor descriptor{};
  std::uint32_t landmark = 0;  ///< points of one landmark share it; 0: of none
};

/// What remains of a frame after its image is gone: enough to recognise the place, to measure the pose of
/// another frame relative to it, and to be a node of the pose graph.
struct Keyframe {
  std::size_t id = 0;  ///< its place in the database
  std::size_t frame = 0;
  std::int64_t stamp_ns = 0;
  std::size_t segment = 0;  ///< of the map: a new one starts where the camera was lost
  std::vector<KeyframePoint> points;
  PoseGaussian T_previous_keyframe;  ///< relative density to the keyframe before; the first one's is unused
  PoseGaussian T_world_keyframe;     ///< as known now: loops correct it
  double travelled_m = 0.0;          ///< length of the way from the first keyframe along the keyframes
};

/// The same for a keyframe, with the numbers of their landmarks; without, all have number 0.
[[nodiscard]] std::vector<KeyframePoint> keyframe_points(const StereoPoints& points,
                                                         const std::vector<std::uint32_t>& landmarks);

/// All keyframes of a run, in order. A keyframe's memory is bounded by the number of its points.
class KeyframeDatabase {
 public:
  explicit KeyframeDatabase(std::size_t max_points) : max_points_(max_points) {}

  /// Appends a keyframe and returns its id. Beyond the bound the last points are left out: callers put the
  /// ones they care for first. Id, pose and way follow from the keyframe before. Throws std::invalid_argument
  /// when the frame is not a later one.
  std::size_t add(Keyframe keyframe);

  [[nodiscard]] std::size_t size() const noexcept { return keyframes_.size(); }
  [[nodiscard]] const Keyframe& operator[](std::size_t id) const { return keyframes_[id]; }
  [[nodiscard]] const Keyframe& back() const { return keyframes_.back(); }
  [[nodiscard]] const std::vector<Keyframe>& all() const noexcept { return keyframes_; }

  /// Sets the poses of the first keyframes and carries the others along. Throws std::invalid_argument for
  /// more poses than keyframes.
  void correct(const std::vector<PoseGaussian>& T_world_keyframe);

  /// Heap and table, bytes.
  [[nodiscard]] std::size_t memory_bytes() const;
  /// That no keyframe exceeds, bytes.
  [[nodiscard]] std::size_t max_bytes_per_keyframe() const;

 private:
  std::size_t max_points_;
  std::vector<Keyframe> keyframes_;
};

/// Weight of the edge between two keyframes in the covisibility graph: landmarks that both show, as followed
/// from the one to the other.
[[nodiscard]] std::size_t shared_landmarks(const Keyframe& a, const Keyframe& b);

/// (u, v, d) of a point.
[[nodiscard]] inline StereoPoint measurement(const KeyframePoint& point) { return point.z.cast<double>(); }

}  // namespace stereo_slam
