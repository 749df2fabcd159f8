// SPDX-License-Identifier: MIT
#include "features.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/features2d.hpp>

#include <antipode/geometry/quaternion.hpp>

namespace object_pose {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

struct Keypoints {
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
};

Keypoints detect(const cv::Mat1b& image, int count) {
  // OpenCV's SIFT doubles the image with a shift of half a pixel of the doubled image.
  constexpr float kShift_px = 0.25f;
  Keypoints found;
  cv::SIFT::create(count)->detectAndCompute(image, cv::noArray(), found.points, found.descriptors);
  for (auto& point : found.points) point.pt -= cv::Point2f(kShift_px, kShift_px);
  return found;
}

ModelFeature on_face(const BoxModel& box, std::size_t face, const cv::KeyPoint& point) {
  const BoxFace& f = box.faces[face];
  const Eigen::Vector3d turn(0, 0, static_cast<double>(point.angle) * kRadians);
  Eigen::Vector3d place;
  place << f.face_point(static_cast<double>(point.pt.x), static_cast<double>(point.pt.y)), 0.0;
  const Pose T_face_feature = Pose::from_rotation_translation(antipode::quaternion_exp(turn), place);
  return {face, f.T_object_face * T_face_feature, static_cast<double>(point.size) / f.px_per_m()};
}

Eigen::Vector3d place_of(const FeatureModel& model, std::size_t feature) {
  return model.features[feature].T_object_feature.translation();
}

/// The ratio test: the descriptor distance to the best model feature over that to the best one at another
/// place. SIFT may find several orientations at one place; these do not compete.
double ratio_of(const std::vector<cv::DMatch>& nearest, const FeatureModel& model) {
  constexpr double kSamePlace_m = 0.002;
  const auto id = [](const cv::DMatch& m) { return static_cast<std::size_t>(m.trainIdx); };
  const Eigen::Vector3d best = place_of(model, id(nearest.front()));
  const auto rival = std::find_if(nearest.begin(), nearest.end(), [&](const cv::DMatch& m) {
    return (place_of(model, id(m)) - best).norm() > kSamePlace_m;
  });
  // If all neighbours are at the same place, a rival is at least as far as the last of them.
  const float distance = rival == nearest.end() ? nearest.back().distance : rival->distance;
  return static_cast<double>(nearest.front().distance) / static_cast<double>(std::max(distance, 1.0f));
}

/// The measurement (u, v, d) [px] of feature `index` of the left image, by the most similar feature of the
/// right image that fits in row, disparity, size and orientation. None if there is none.
std::optional<Eigen::Vector3d> find_on_right(const Keypoints& left, int index, const Keypoints& right,
                                             const StereoCamera& camera, const MatchSettings& settings) {
  constexpr float kMaxSizeRatio = 1.4f;
  constexpr double kMaxTurn_deg = 20.0, kMaxDistance = 250.0;
  const cv::KeyPoint& a = left.points[static_cast<std::size_t>(index)];
  const float max_disparity = static_cast<float>(camera.fx * camera.baseline_m / settings.min_depth_m);
  double best = kMaxDistance;
  std::optional<Eigen::Vector3d> z;
  for (int k = 0; k < right.descriptors.rows; ++k) {
    const cv::KeyPoint& b = right.points[static_cast<std::size_t>(k)];
    const float disparity = a.pt.x - b.pt.x;
    if (static_cast<double>(std::abs(a.pt.y - b.pt.y)) > settings.max_row_difference_px) continue;
    if (!(disparity > 1.0f && disparity < max_disparity)) continue;
    if (a.size > kMaxSizeRatio * b.size || b.size > kMaxSizeRatio * a.size) continue;
    if (std::abs(std::remainder(static_cast<double>(a.angle - b.angle), 360.0)) > kMaxTurn_deg) continue;
    const double distance = cv::norm(left.descriptors.row(index), right.descriptors.row(k));
    if (distance >= best) continue;
    best = distance;
    // In rectified images both rows measure the same.
    z = Eigen::Vector3d(static_cast<double>(a.pt.x), 0.5 * static_cast<double>(a.pt.y + b.pt.y),
                        static_cast<double>(disparity));
  }
  return z;
}

/// The matches on faces with at least a tenth of all matches. The few matches on a hidden face are
/// mismatches, and spread_out() would put them first, as they are far from the others.
std::vector<Match> on_seen_faces(const std::vector<Match>& matches, const FeatureModel& model) {
  constexpr double kLeastShare = 0.1;
  std::map<std::size_t, double> share;
  for (const auto& match : matches) {
    share[model.features[match.model_feature].face] += 1.0 / static_cast<double>(matches.size());
  }
  std::vector<Match> kept;
  for (const auto& match : matches) {
    if (share[model.features[match.model_feature].face] >= kLeastShare) kept.push_back(match);
  }
  return kept;
}

/// The most distinctive match first, then always the one furthest on the object from all before.
std::vector<Match> spread_out(std::vector<Match> matches, const FeatureModel& model) {
  const auto place = [&](std::size_t k) { return place_of(model, matches[k].model_feature); };
  std::vector<double> gap_m(matches.size(), std::numeric_limits<double>::infinity());
  for (std::size_t k = 0; k + 1 < matches.size(); ++k) {
    for (std::size_t i = k + 1; i < matches.size(); ++i) {
      gap_m[i] = std::min(gap_m[i], (place(i) - place(k)).norm());
    }
    const auto begin = gap_m.begin() + static_cast<std::ptrdiff_t>(k) + 1;
    const auto furthest = static_cast<std::size_t>(std::max_element(begin, gap_m.end()) - gap_m.begin());
    std::swap(matches[k + 1], matches[furthest]);
    std::swap(gap_m[k + 1], gap_m[furthest]);
  }
  return matches;
}

void require_size(const char* name, const cv::Mat& image, const StereoCamera& camera) {
  if (image.cols != camera.width_px || image.rows != camera.height_px) {
    throw std::runtime_error(fmt::format("the {} image has {} x {} px, but the model's camera has {} x {}",
                                         name, image.cols, image.rows, camera.width_px, camera.height_px));
  }
}

}  // namespace

FeatureModel learn_features(const BoxModel& box) {
  constexpr int kFeaturesOfFace = 700;
  FeatureModel model;
  for (std::size_t face = 0; face < box.faces.size(); ++face) {
    const Keypoints found = detect(box.faces[face].texture, kFeaturesOfFace);
    for (const auto& point : found.points) model.features.push_back(on_face(box, face, point));
    if (!found.points.empty()) model.descriptors.push_back(found.descriptors);
  }
  if (model.features.size() < 2) throw std::runtime_error("the faces of the model have no features");
  return model;
}

std::vector<Match> match_features(const StereoImages& images, const StereoCamera& camera,
                                  const FeatureModel& model, const MatchSettings& settings) {
  constexpr int kFeaturesOfImage = 4000;
  constexpr int kNeighbours = 4;
  require_size("left", images.left, camera);
  require_size("right", images.right, camera);
  const Keypoints left = detect(images.left, kFeaturesOfImage),
                  right = detect(images.right, kFeaturesOfImage);
  if (left.points.empty()) throw std::runtime_error("no features in the left image");
  if (right.points.empty()) throw std::runtime_error("no features in the right image");

  std::vector<std::vector<cv::DMatch>> neighbours;
  cv::BFMatcher(cv::NORM_L2).knnMatch(left.descriptors, model.descriptors, neighbours, kNeighbours);
  std::map<std::size_t, Match> best;  // of each model feature
  for (const auto& nearest : neighbours) {
    const auto feature = static_cast<std::size_t>(nearest.front().trainIdx);
    const double ratio = ratio_of(nearest, model);
    const auto rival = best.find(feature);
    if (ratio > settings.max_ratio || (rival != best.end() && rival->second.ratio <= ratio)) continue;
    const auto z = find_on_right(left, nearest.front().queryIdx, right, camera, settings);
    if (!z) continue;
    const cv::KeyPoint& point = left.points[static_cast<std::size_t>(nearest.front().queryIdx)];
    const SeenFeature seen{*z, static_cast<double>(point.angle) * kRadians, static_cast<double>(point.size)};
    best.insert_or_assign(feature, Match{feature, seen, ratio});
  }
  if (best.empty()) throw std::runtime_error("no feature of the model is seen in both images");

  std::vector<Match> matches;
  matches.reserve(best.size());
  for (const auto& [feature, match] : best) matches.push_back(match);
  std::stable_sort(matches.begin(), matches.end(),
                   [](const Match& a, const Match& b) { return a.ratio < b.ratio; });
  matches.resize(std::min(matches.size(), settings.max_matches));
  return spread_out(on_seen_faces(matches, model), model);
}

}  // namespace object_pose
