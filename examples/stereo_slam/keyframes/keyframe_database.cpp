// SPDX-License-Identifier: MIT
#include "stereo_slam/keyframes/keyframe_database.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/frontend/orb_descriptors.hpp"

namespace stereo_slam {

std::vector<KeyframePoint> keyframe_points(const StereoPoints& points,
                                           const std::vector<std::uint32_t>& landmarks) {
  std::vector<KeyframePoint> result;
  for (std::size_t i = 0; i < points.measured.size(); ++i) {
    KeyframePoint point{.z = points.measured[i].z.cast<float>()};
    if (!points.descriptors.empty()) point.descriptor = points.descriptors[i];
    if (!landmarks.empty()) point.landmark = landmarks[i];
    result.push_back(point);
  }
  return result;
}

void describe(std::vector<KeyframePoint>& points, const cv::Mat& left, const LensResidual& lens) {
  std::vector<Vector2<double>> px;
  px.reserve(points.size());
  for (const auto& point : points) px.push_back(lens.in_image(measurement(point).head<2>()));
  const auto descriptors = describe_points(left, px);
  for (std::size_t i = 0; i < points.size(); ++i) points[i].descriptor = descriptors[i];
}

std::size_t KeyframeDatabase::add(Keyframe keyframe) {
  if (!keyframes_.empty() && keyframe.frame <= keyframes_.back().frame) {
    throw std::invalid_argument(
        fmt::format("keyframe of frame {} follows one of frame {}: frames must increase", keyframe.frame,
                    keyframes_.back().frame));
  }
  keyframe.id = keyframes_.size();
  if (keyframe.points.size() > max_points_) keyframe.points.resize(max_points_);
  keyframe.points.shrink_to_fit();
  if (!keyframes_.empty()) {
    const Keyframe& previous = keyframes_.back();
    keyframe.T_world_keyframe = compose_first_order(previous.T_world_keyframe, keyframe.T_previous_keyframe);
    keyframe.path_length_m = previous.path_length_m + keyframe.T_previous_keyframe.pose.translation().norm();
  }
  keyframes_.push_back(std::move(keyframe));
  return keyframes_.back().id;
}

void KeyframeDatabase::correct(const std::vector<PoseGaussian>& T_world_keyframe) {
  if (T_world_keyframe.size() > keyframes_.size()) {
    throw std::invalid_argument(
        fmt::format("{} poses for {} keyframes", T_world_keyframe.size(), keyframes_.size()));
  }
  if (T_world_keyframe.empty()) return;
  for (std::size_t id = 0; id < keyframes_.size(); ++id) {
    keyframes_[id].T_world_keyframe =
        id < T_world_keyframe.size()
            ? T_world_keyframe[id]
            : compose_first_order(keyframes_[id - 1].T_world_keyframe, keyframes_[id].T_previous_keyframe);
  }
}

void KeyframeDatabase::replace(std::span<const KeyframeLink> links) {
  for (const auto& link : links) keyframes_.at(link.keyframe).T_previous_keyframe = link.T_previous_keyframe;
}

std::size_t shared_landmarks(const Keyframe& a, const Keyframe& b) {
  const auto ids_of = [](const Keyframe& keyframe) {
    std::vector<std::uint32_t> result;
    for (const auto& point : keyframe.points) {
      if (point.landmark > 0) result.push_back(point.landmark);
    }
    std::sort(result.begin(), result.end());
    return result;
  };
  std::vector<std::uint32_t> shared;
  std::ranges::set_intersection(ids_of(a), ids_of(b), std::back_inserter(shared));
  return shared.size();
}

std::size_t KeyframeDatabase::memory_bytes() const {
  std::size_t bytes = keyframes_.capacity() * sizeof(Keyframe);
  for (const auto& keyframe : keyframes_) bytes += keyframe.points.capacity() * sizeof(KeyframePoint);
  return bytes;
}

std::size_t KeyframeDatabase::max_bytes_per_keyframe() const {
  constexpr std::size_t kGrowth = 2;  // largest ratio of a vector's capacity to its size
  return kGrowth * sizeof(Keyframe) + max_points_ * sizeof(KeyframePoint);
}

}  // namespace stereo_slam
