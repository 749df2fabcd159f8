// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <deque>
#include <future>
#include <optional>
#include <span>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/loop_closing/loop_closer.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Thread that loop closing runs on. The results do not depend on it.
enum class LoopThread {
  kNone,  ///< the caller's
  kOwn,   ///< one of its own
};

/// Frames from a keyframe to the correction by its loop, in which the loop-closing thread works.
inline constexpr std::size_t kCorrectionLatency_frames = 15;

/// When the correction of a keyframe takes effect.
enum class CorrectionDelay {
  kUsual,  ///< after kCorrectionLatency_frames, and one more frame for each 50 keyframes
  kShort,  ///< after at most three frames: the camera's pose in the map is not known without it
};

/// A LoopCloser that runs in the background.
///
/// It processes keyframes in order. The correction of a keyframe takes effect after a number of frames that
/// depends only on the settings, the delay and the number of keyframes; correction_due() waits for it if
/// necessary. The results therefore do not depend on threads or their speed. It stays where it is, since the
/// thread refers to it.
class AsyncLoopCloser {
 public:
  /// `loaded` is the map of an earlier run, or empty.
  AsyncLoopCloser(const StereoCamera& camera, const Settings& settings, LoopThread thread,
                  const SavedMap& loaded = {}, MapUse use = MapUse::kContinue);
  AsyncLoopCloser(const AsyncLoopCloser&) = delete;
  AsyncLoopCloser& operator=(const AsyncLoopCloser&) = delete;

  /// Adds a keyframe with its points and its pose relative to the keyframe before. If its points are not
  /// described yet, `left` is the image to describe them by, on the loop-closing thread.
  void add_keyframe(Keyframe keyframe, cv::Mat left = {}, const LensResidual& lens = {},
                    CorrectionDelay delay = CorrectionDelay::kUsual);

  /// The correction that takes effect before `frame`, if any. The caller corrects its keyframes.
  [[nodiscard]] std::optional<LoopCorrection> correction_due(std::size_t frame);

  /// The last correction, after the last keyframe: it contains all accepted loops. `links` are poses relative
  /// to the keyframe before that replace those given earlier. Waits for the thread.
  [[nodiscard]] std::optional<LoopCorrection> finish(const std::vector<KeyframeLink>& links = {});

  /// Loops found so far, accepted and refused, in order. Waits for the thread; complete after finish().
  [[nodiscard]] std::vector<LoopEvent> events() const { return at_rest().events(); }

  /// The same without waiting: nothing while the thread works. Valid until the next keyframe is added.
  [[nodiscard]] std::optional<std::span<const LoopEvent>> events_if_idle() const;

  /// Sets the keyframes and the loops of `map`; those of the loaded map come first. Waits for the thread.
  void save(SavedMap& map) const { at_rest().save(map); }

  /// Memory of keyframes and place recognition, bytes. Waits for the thread.
  [[nodiscard]] std::size_t memory_bytes() const { return at_rest().memory_bytes(); }

 private:
  using FutureCorrection = std::shared_future<std::optional<LoopCorrection>>;
  /// Processing of one keyframe, and the frame before which its correction takes effect.
  struct Task {
    FutureCorrection correction;
    std::size_t due = 0;
  };

  [[nodiscard]] const LoopCloser& at_rest() const;

  LoopCloser closer_;
  LoopThread thread_;
  std::size_t keyframes_;   // of the pose graph that may move
  std::deque<Task> tasks_;  // in order; each waits for the one before
};

}  // namespace stereo_slam
