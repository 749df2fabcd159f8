// SPDX-License-Identifier: MIT
#include "simulator/recording/simulate.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "simulator/recording/recording_folder.hpp"
#include "simulator/rendering/lens_view.hpp"
#include "simulator/rendering/renderer.hpp"
#include "simulator/textures/random.hpp"
#include "simulator/world/traffic.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

namespace stereo_slam::simulator {
namespace {

namespace fs = std::filesystem;

void require(bool ok, const std::string& what, double value) {
  if (!ok) throw std::invalid_argument(what + ", not " + std::to_string(value));
}

void validate(const RigDisturbance& disturbance) {
  constexpr double kLargest_px = 20.0;
  require(disturbance.vibration_px >= 0.0 && disturbance.vibration_px <= kLargest_px,
          "vibration_px must be in [0, 20]", disturbance.vibration_px);
  require(disturbance.vibration_frames >= 0.0 && disturbance.vibration_frames <= 1e6,
          "vibration_frames must be in [0, 1e6]", disturbance.vibration_frames);
  require(std::abs(disturbance.drift_px) <= kLargest_px, "drift_px must be in [-20, 20]",
          disturbance.drift_px);
  require(std::abs(disturbance.sync_error_s) <= 1.0, "sync_error_s must be in [-1, 1]",
          disturbance.sync_error_s);
}

void validate(const SimulationSettings& settings) {
  require(settings.frames >= 0, "frames must not be negative", settings.frames);
  require(settings.dynamic_objects >= 0, "dynamic_objects must not be negative", settings.dynamic_objects);
  require(settings.fps > 0.0, "fps must be positive", settings.fps);
  require(settings.rectification_error_px >= 0.0, "rectification_error_px must not be negative",
          settings.rectification_error_px);
  if (settings.rig && settings.rectification_error_px > 0.0)
    throw std::invalid_argument("rectification_error_px is of rectified images, not of a rig");
  if (settings.rig && settings.lens_error.any())
    throw std::invalid_argument("lens_error is of rectified images, not of a rig");
  validate(settings.disturbance);
  require(settings.ride.bounce_m >= 0.0 && settings.ride.bounce_m <= 0.2, "ride.bounce_m must be in [0, 0.2]",
          settings.ride.bounce_m);
  require(settings.baseline_m > 0.0, "baseline_m must be positive", settings.baseline_m);
  require(settings.camera_height_m > 0.0, "camera_height_m must be positive", settings.camera_height_m);
  require(settings.threads >= 0, "threads must not be negative", settings.threads);
  const int samples = settings.samples_per_pixel;
  require(samples == 4 || samples == 8 || samples == 16, "samples_per_pixel must be 4, 8 or 16", samples);
  if (settings.rig) {
    if (!settings.rig->T_body_left) throw std::invalid_argument("rig: T_body_left is missing");
  } else {
    validate(settings.camera);
    validate(settings.lens_error, settings.camera);
  }
  validate(settings.sensor);
  if (settings.imu) validate(*settings.imu);
  const double exposure_s = settings.sensor.exposure_s;
  require(exposure_s >= 0.0 && exposure_s * settings.fps <= 1.0,
          "exposure_s must be from 0 to the time between two frames", exposure_s);
}

/// The two cameras that are rendered. With a rectification error, the recorded calibration differs from them.
struct StereoViews {
  std::vector<LensView> lenses;  ///< left and right; none if both are pinholes
  Eigen::Isometry3d T_left_right = Eigen::Isometry3d::Identity();
  std::vector<RightCameraError> errors;  ///< of each frame; empty: none
};

/// Size and focal lengths of the right camera.
PinholeCamera right_camera(const SimulationSettings& settings) {
  if (!settings.rig) return settings.camera;
  const Lens& lens = settings.rig->right;
  return {lens.width_px, lens.height_px, lens.fx, lens.fy, lens.cx, lens.cy};
}

StereoViews stereo_views(const SimulationSettings& settings, std::size_t frames) {
  StereoViews views;
  if (settings.disturbance.any()) {
    views.errors = right_camera_errors(settings.disturbance, right_camera(settings), frames, settings.seed);
  }
  std::optional<StereoRig> rig = settings.rig;
  constexpr double kNegligible_px = 1e-9;
  if (settings.rectification_error_px > kNegligible_px || settings.lens_error.any()) {
    rig = with_lens_error(misrectified_rig(settings.camera, settings.baseline_m,
                                           {settings.rectification_error_px, settings.seed}),
                          settings.lens_error);
  }
  if (rig) {
    views.lenses = {LensView(rig->left), LensView(rig->right)};
    views.T_left_right = rig->T_right_left.inverse();
  } else {
    views.T_left_right = Eigen::Translation3d(settings.baseline_m, 0.0, 0.0);
  }
  return views;
}

/// Renders and writes stereo pairs. Each thread has its own Camera.
class Camera {
 public:
  Camera(const SimulationSettings& settings, const World& world, const Traffic& traffic,
         const StereoViews& views, const RecordingFolder& folder)
      : settings_(settings), traffic_(traffic), views_(views), folder_(folder) {
    for (std::size_t side = 0; side < 2; ++side) {
      const auto& lenses = views.lenses;
      renderers_.emplace_back(world.scene(), lenses.empty() ? settings.camera : lenses[side].pinhole(),
                              settings.samples_per_pixel);
    }
  }

  void shoot(const CameraPath& path, std::size_t frame) {
    const double exposure_s = settings_.sensor.exposure_s;
    constexpr int kSamples = 8;  // of the exposure
    const CameraPath T_world_left =
        exposure_s > 0.0 ? poses_during_exposure(path, frame, exposure_s * settings_.fps, kSamples)
                         : CameraPath{path[frame]};
    for (std::size_t side = 0; side < 2; ++side) {
      const double delay_s = side == 0 ? 0.0 : right_error(frame).delay_s;
      const double later = delay_s * settings_.fps;
      const auto moving = traffic_.at(frame, later);
      const Eigen::Isometry3d T_left_camera =
          side == 0 ? Eigen::Isometry3d::Identity() : T_left_right(path, frame, later);
      const cv::Mat1f light = see(side, T_world_left, T_left_camera, moving);
      if (side == 0 && settings_.moving_masks) {
        const cv::Mat1b mask = light != see(side, T_world_left, T_left_camera, {});
        folder_.write_mask(mask, frame);
      }
      const double time_s = static_cast<double>(frame) / settings_.fps + delay_s;
      const double gain = exposure_gain(settings_.sensor, settings_.seed, time_s, static_cast<int>(side));
      Random random(settings_.seed, 1000 + 2 * frame + side);
      folder_.write_image(expose(light, settings_.sensor, gain, random.bits()), side, frame);
    }
  }

 private:
  /// The light that falls on the sensor of one camera (0 left, 1 right): the mean over the poses.
  [[nodiscard]] cv::Mat1f see(std::size_t side, const CameraPath& T_world_left,
                              const Eigen::Isometry3d& T_left_camera, const std::vector<Face>& moving) {
    cv::Mat1f light;
    for (const auto& pose : T_world_left) {
      const cv::Mat1f seen = renderers_[side].render(pose * T_left_camera, moving);
      if (light.empty()) {
        light = seen;
      } else {
        light += seen;
      }
    }
    if (T_world_left.size() > 1) light /= static_cast<double>(T_world_left.size());
    return views_.lenses.empty() ? light : views_.lenses[side].through(light);
  }

  [[nodiscard]] RightCameraError right_error(std::size_t frame) const {
    return views_.errors.empty() ? RightCameraError{} : views_.errors[frame];
  }

  /// The right camera, which is exposed `later` frames, seen from the left one of the frame.
  [[nodiscard]] Eigen::Isometry3d T_left_right(const CameraPath& path, std::size_t frame,
                                               double later) const {
    if (views_.errors.empty()) return views_.T_left_right;
    Eigen::Isometry3d T = views_.T_left_right;
    if (later != 0.0) T = path[frame].inverse() * pose_after(path, frame, later) * T;
    return T * Eigen::Isometry3d(rotation_matrix(right_error(frame).rotation_rad).transpose());
  }

  const SimulationSettings& settings_;
  const Traffic& traffic_;
  const StereoViews& views_;
  const RecordingFolder& folder_;
  std::vector<Renderer> renderers_;
};

/// The folder for a recording. It is removed again if nothing was written to it and it did not exist before.
class NewFolder {
 public:
  explicit NewFolder(const fs::path& folder) : folder_(folder) {
    std::error_code unreadable;  // reported by make_empty_folder()
    existed_ = fs::exists(folder, unreadable);
    make_empty_folder(folder);
  }
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;
  ~NewFolder() {
    std::error_code not_empty;
    if (!existed_) fs::remove(folder_, not_empty);
  }

 private:
  fs::path folder_;
  bool existed_ = false;
};

/// The text files of a recording whose first frames are those of `path`.
void write_texts(const RecordingFolder& folder, const SimulationSettings& settings, const StereoViews& views,
                 const CameraPath& path) {
  folder.write_times_and_poses(path);
  if (views.errors.empty()) return;
  folder.write_disturbance({views.errors.begin(), views.errors.begin() + static_cast<long>(path.size())},
                           right_camera(settings));
}

/// Calls work(frame) of a new make_worker() in every thread for all frames, and progress after each, until it
/// returns false. Returns the number of frames done, which are the first ones.
template <class MakeWorker>
std::size_t for_all_frames(std::size_t frames, int threads, const Progress& progress,
                           const MakeWorker& make_worker) {
  std::atomic<std::size_t> next_frame = 0;
  std::mutex mutex;
  std::size_t done = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      auto worker = make_worker();
      for (std::size_t frame = next_frame++; frame < frames; frame = next_frame++) {
        worker(frame);
        const std::lock_guard lock(mutex);
        ++done;
        const bool go_on = !progress || progress(static_cast<int>(done), static_cast<int>(frames));
        if (!go_on) next_frame = frames;
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      next_frame = frames;
    }
  };
  const auto processors = std::max(1U, std::thread::hardware_concurrency());
  {
    std::vector<std::jthread> workers;
    for (unsigned i = 0; i < (threads > 0 ? static_cast<unsigned>(threads) : processors); ++i)
      workers.emplace_back(work);
  }
  if (failure) std::rethrow_exception(failure);
  return done;
}

}  // namespace

std::vector<std::string> trajectory_remarks(const SimulationSettings& settings) {
  if (!fs::is_regular_file(settings.trajectory)) return {};
  auto remarks = read_trajectory(settings.trajectory).remarks;
  for (auto& remark : remarks) remark.insert(0, settings.trajectory.string() + ": ");
  return remarks;
}

CameraPath camera_path(const SimulationSettings& settings) {
  validate(settings);
  if (settings.trajectory.empty()) {
    const int frames = settings.frames > 0 ? settings.frames : SimulationSettings::kDefaultFrames;
    return settings.scenery == Scenery::kHighway ? highway_drive(frames, settings.fps, settings.highway)
                                                 : street_loop(frames, settings.fps, settings.loop);
  }
  CameraPath path = read_camera_path(settings.trajectory);
  const auto frames = static_cast<std::size_t>(settings.frames);
  if (frames > path.size()) {
    throw std::runtime_error(fmt::format("{}: has {} poses, fewer than the {} frames asked for",
                                         settings.trajectory.string(), path.size(), frames));
  }
  if (frames > 0) path.resize(frames);
  constexpr double kLargestTown_m = 20e3;  // the world around the path must fit into memory
  for (const auto& pose : path) {
    const double distance_m = (pose.translation() - path.front().translation()).norm();
    if (!(distance_m <= kLargestTown_m)) {
      throw std::runtime_error(
          fmt::format("{}: leads {:.3g} m away from its start; at most {:.0f} m can be rendered",
                      settings.trajectory.string(), distance_m, kLargestTown_m));
    }
  }
  constexpr double kLongestStep_m = 100.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double step_m = (path[i].translation() - path[i - 1].translation()).norm();
    if (step_m <= kLongestStep_m) continue;
    throw std::runtime_error(fmt::format(
        "{}: poses {} and {} are {:.3g} m apart; a camera moves at most {:.0f} m from frame to frame",
        settings.trajectory.string(), i, i + 1, step_m, kLongestStep_m));
  }
  return path;
}

void simulate(const SimulationSettings& settings, const fs::path& output, const Progress& progress) {
  validate(settings);
  const NewFolder claimed(output);  // before the path and the world, which may take minutes to build
  const CameraPath road = camera_path(settings);
  const StereoViews views = stereo_views(settings, road.size());
  const World world(road, {.scenery = settings.scenery,
                           .seed = settings.seed,
                           .camera_height_m = settings.camera_height_m,
                           .texture_size_px = settings.texture_size_px,
                           .street = {}});
  const Traffic traffic(world, road, settings.fps, settings.dynamic_objects, settings.seed);
  CameraPath path = on_bad_road(road, settings.ride, settings.fps, settings.seed);

  const RecordingFolder folder(settings, output);
  folder.write_cameras();
  write_texts(folder, settings, views, path);
  // Each worker renders and writes whole frames, so that one writes while another renders.
  const std::size_t done = for_all_frames(path.size(), settings.threads, progress, [&] {
    const auto camera = std::make_shared<Camera>(settings, world, traffic, views, folder);
    return [&path, camera](std::size_t frame) { camera->shoot(path, frame); };
  });
  if (done == path.size()) return;
  path.resize(done);  // frames are begun in order and all that were begun are finished
  write_texts(folder, settings, views, path);
}

}  // namespace stereo_slam::simulator
