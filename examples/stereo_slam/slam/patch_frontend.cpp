// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/point_tracks.hpp"
#include "stereo_slam/slam/frontend.hpp"

namespace stereo_slam {
namespace {

class PatchFrontend final : public Frontend {
 public:
  PatchFrontend(const StereoCamera& camera, const Settings& settings)
      : camera_(camera), settings_(settings) {}

  [[nodiscard]] FrameImages prepare(const StereoFrame& frame, PreviousFrame& previous) const override {
    return prepare_images(frame, PyramidSides::kLeft, previous);
  }

  [[nodiscard]] OdometryResult measure_motion(const ConsecutivePyramids& pyramids, const StereoView& view,
                                              const ExpectedMotion& expected) override {
    return odometry_from_tracks(tracks_, pyramids, view, expected, settings_);
  }

  [[nodiscard]] Association find_landmarks(const LandmarkSearch& search,
                                           const PoseGaussian& T_keyframe_camera,
                                           const FrameImages& /*images*/, const StereoView& view,
                                           const OdometryResult& odometry) const override {
    return search.align_patches(T_keyframe_camera, view, odometry.valid);
  }

  void note_static_points(const std::optional<Pose>& T_previous_current,
                          const std::vector<Match>& /*matches*/) override {
    tracks_.compare_with(T_previous_current, camera_, settings_.odometry.pixel_sigma_px);
  }

  void choose_odometry_points(const FrameImages& images, const StereoView& view,
                              const std::vector<Vector2<double>>& landmarks_px) override {
    tracks_.replenish(view, images.corners, landmarks_px, settings_);
  }

  [[nodiscard]] StereoPoints measure_points(
      const FrameImages& images, const StereoView& view,
      const std::vector<Vector2<double>>& /*reserved_px*/) const override {
    return measure_stereo_corners(view, images.corners, settings_);
  }

  [[nodiscard]] bool describes_points() const override { return false; }

  [[nodiscard]] std::size_t count_features(const FrameImages& /*images*/) const override {
    return tracks_.points().size();
  }

  void change_rectification(const RectificationResidual& before,
                            const RectificationResidual& after) override {
    tracks_.remeasure(before, after);
  }

  void restart() override { tracks_ = {}; }

 private:
  StereoCamera camera_;
  Settings settings_;
  PointTracks tracks_;  // what the odometry follows
};

}  // namespace

std::unique_ptr<Frontend> make_patch_frontend(const StereoCamera& camera, const Settings& settings) {
  return std::make_unique<PatchFrontend>(camera, settings);
}

}  // namespace stereo_slam
