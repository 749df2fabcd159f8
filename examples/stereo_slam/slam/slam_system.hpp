// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/local_map.hpp"
#include "stereo_slam/loop_closing/async_loop_closer.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/rig/learned_cameras.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/slam/path.hpp"

namespace stereo_slam {

struct AssociationTrace;

/// What the command line and other programs need of a SLAM system: `Slam`, the product, or `PaperSlam`, the
/// filter of the DQV-SLAM paper.
///
/// Frames go in one by one, in order. Reads and writes no files. The results do not depend on threads. What
/// both systems keep, the local map and the path, is kept and reported here.
class SlamSystem {
 public:
  SlamSystem(const SlamSystem&) = delete;
  SlamSystem& operator=(const SlamSystem&) = delete;
  virtual ~SlamSystem() = default;

  /// Tracks one rectified frame and updates the map. Every frame gets a pose; its status says how far it
  /// can be trusted. Fills `trace`, if there is one, with how landmarks were searched for.
  virtual FrameResult process(const StereoFrame& recorded, AssociationTrace* trace = nullptr) = 0;

  /// Call after the last frame. It corrects earlier poses by what was still being computed, and by what is
  /// better known at the end.
  virtual void finish() {}

  /// T_world_camera of every frame so far. A loop closure may have moved earlier ones.
  [[nodiscard]] std::vector<PoseGaussian> trajectory() const { return path_.poses(calibration_error()); }

  /// FrameResult::relative_covariance of every frame so far, as known now: finish() changes it.
  [[nodiscard]] std::vector<Matrix6<double>> relative_covariances() const {
    return path_.trajectory().relative_covariances();
  }

  /// Errors of the calibration that all frames share, as known now.
  [[nodiscard]] virtual CalibrationError calibration_error() const = 0;

  /// What was learned of the cameras so far. Systems that learn nothing of them say nothing.
  [[nodiscard]] virtual RigSummary rig() const { return {}; }

  /// Begins with a delay of the right images, which is refined while driving. Call it before the first frame.
  /// Throws std::invalid_argument if a value is not finite or the standard deviation not positive. Systems
  /// that learn nothing of the cameras ignore it.
  virtual void begin_with_delay(const DelayEstimate& /*known*/) {}

  /// How the readings of an IMU were used; nothing without any.
  [[nodiscard]] virtual std::optional<InertialSummary> inertial() const { return std::nullopt; }

  /// The established landmarks in world coordinates, with those of a loaded map once the run is localised in
  /// it: they were seen in three frames and are not at infinity. Complete after finish().
  [[nodiscard]] std::vector<MapPoint> map_points() const { return path_.map_points(local_map_); }

  /// The same without the landmarks that are tracked now, for display: brought up to date and not copied.
  /// Valid until the next call of a function that is not const.
  [[nodiscard]] const std::vector<MapPoint>& archived_map_points() {
    return path_.archived_map_points(local_map_);
  }

  /// The landmarks that are in view of the last frame.
  [[nodiscard]] std::vector<LandmarkTrack> landmark_tracks() const {
    if (path_.frames() == 0) return {};
    return tracks_in_view(local_map_.view(), path_.trajectory().T_keyframe_last(), path_.frames() - 1);
  }

  /// The map for a later run, with the one that this run started with; complete after finish(). Throws
  /// std::logic_error without loop closure, which keeps the keyframes.
  [[nodiscard]] virtual SavedMap saved_map() const {
    throw std::logic_error("a map without loop closure has no keyframes to save");
  }

  /// Loops so far, accepted and refused; complete after finish().
  [[nodiscard]] std::vector<LoopEvent> loop_events() const {
    return path_.loops() ? path_.loops()->events() : std::vector<LoopEvent>{};
  }

  /// The same without waiting: nothing while the loop-closing thread works.
  [[nodiscard]] std::optional<std::span<const LoopEvent>> loop_events_if_idle() const {
    return path_.loops() ? path_.loops()->events_if_idle() : std::span<const LoopEvent>{};
  }

  /// Memory that loop closure uses for keyframes and place recognition, bytes; zero without loop closure.
  [[nodiscard]] std::size_t keyframe_memory_bytes() const {
    return path_.loops() ? path_.loops()->memory_bytes() : 0;
  }

 protected:
  SlamSystem(const StereoCamera& camera, const MapSettings& settings) : local_map_(camera, settings) {}

  LocalMap local_map_;  // landmarks of the reference keyframe, and the archive of earlier ones
  Path path_;           // poses of keyframes and frames, loops, the landmarks of a loaded map
};

/// The system that the settings' preset names. It starts with the map of an earlier run, unless `loaded` is
/// empty, or with what that learned of the cameras, if `loaded` has a camera and no keyframes (see Slam).
/// Throws std::invalid_argument if a map is given and loop closure is off, or the
/// map is of another camera.
[[nodiscard]] std::unique_ptr<SlamSystem> make_slam_system(const StereoCamera& camera,
                                                           const Settings& settings,
                                                           LoopThread loop_thread = LoopThread::kNone,
                                                           const SavedMap& loaded = {},
                                                           MapUse use = MapUse::kContinue);

}  // namespace stereo_slam
