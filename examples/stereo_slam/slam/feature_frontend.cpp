// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/slam/frontend.hpp"

namespace stereo_slam {
namespace {

[[nodiscard]] std::vector<StereoPoint> measurements(const std::vector<Match>& matches) {
  std::vector<StereoPoint> result;
  result.reserve(matches.size());
  for (const auto& match : matches) result.push_back(match.z);
  return result;
}

class FeatureFrontend final : public Frontend {
 public:
  explicit FeatureFrontend(const Settings& settings) : settings_(settings) {}

  [[nodiscard]] FrameImages prepare(const StereoFrame& frame, PreviousFrame& previous) const override {
    FrameImages images = prepare_images(frame, PyramidSides::kBoth, previous);
    images.features = extract_features(frame, settings_.features);
    return images;
  }

  [[nodiscard]] OdometryResult measure_motion(const ConsecutivePyramids& pyramids, const StereoView& view,
                                              const ExpectedMotion& expected) override {
    return odometry_from_circle(pyramids, points_, view, expected, settings_);
  }

  [[nodiscard]] Association find_landmarks(const LandmarkSearch& search,
                                           const PoseGaussian& T_keyframe_camera, const FrameImages& images,
                                           const StereoView& view,
                                           const OdometryResult& odometry) const override {
    const StereoFeatures usable{exclude_features(images.features.left, positions(odometry.inliers),
                                                 view.frame.left.size(), settings_.odometry.exclusion_px),
                                images.features.right};
    return search.match_features(T_keyframe_camera, usable);
  }

  void note_static_points(const std::optional<Pose>& T_previous_current,
                          const std::vector<Match>& matches) override {
    points_.static_points = T_previous_current ? measurements(matches) : std::vector<StereoPoint>{};
  }

  void choose_odometry_points(const FrameImages& images, const StereoView& view,
                              const std::vector<Vector2<double>>& landmarks_px) override {
    points_.points = select_odometry_points(view, images.features.left, landmarks_px, settings_);
  }

  [[nodiscard]] StereoPoints measure_points(const FrameImages& images, const StereoView& view,
                                            const std::vector<Vector2<double>>& reserved_px) const override {
    return measure_stereo_points(view, images.features.left, reserved_px, settings_);
  }

  [[nodiscard]] bool describes_points() const override { return true; }

  [[nodiscard]] std::size_t count_features(const FrameImages& images) const override {
    return images.features.left.size();
  }

  /// Nothing to do: the rectification is refined by aligned patches only.
  void change_rectification(const RectificationResidual& /*before*/,
                            const RectificationResidual& /*after*/) override {}

  void restart() override { points_ = {}; }

 private:
  Settings settings_;
  OdometryPoints points_;  // where circular matching starts
};

}  // namespace

std::unique_ptr<Frontend> make_feature_frontend(const Settings& settings) {
  return std::make_unique<FeatureFrontend>(settings);
}

}  // namespace stereo_slam
