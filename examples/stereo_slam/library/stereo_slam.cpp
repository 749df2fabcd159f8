// SPDX-License-Identifier: MIT
#include "stereo_slam/stereo_slam.hpp"

#include <mutex>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/calibration/calibration_file.hpp"
#include "stereo_slam/calibration/camera_values.hpp"
#include "stereo_slam/calibration/rectifier.hpp"
#include "stereo_slam/images/grey_image.hpp"
#include "stereo_slam/results/learned_cameras.hpp"
#include "stereo_slam/results/map_file.hpp"
#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/settings/settings_io.hpp"
#include "stereo_slam/slam/slam_system.hpp"

namespace stereo_slam {
namespace {

/// A fixed-size Eigen type has another layout where Eigen aligns differently.
void check_alignment(const SlamOptions& options) {
  if (options.eigen_alignment == EIGEN_MAX_ALIGN_BYTES) return;
  throw std::invalid_argument(fmt::format(
      "stereo_slam was compiled for Eigen types aligned to {} bytes, and this program for {}; compile both "
      "with the same -march or -m options",
      EIGEN_MAX_ALIGN_BYTES, options.eigen_alignment));
}

[[nodiscard]] Settings settings_of(const SlamOptions& options) {
  Settings settings = options.settings_file ? load_settings(*options.settings_file, options.preset)
                                            : preset_settings(options.preset);
  for (const auto& [key, value] : options.settings) set_setting(settings, key, value);
  return settings;
}

[[nodiscard]] cv::Mat grey(const cv::Mat& left) {
  if (left.empty()) throw std::invalid_argument("the left image is empty");
  return to_grey(left);
}

}  // namespace

struct StereoSlam::State {
  std::mutex mutex;  // held by each call, so that those of several threads wait for each other
  SlamOptions options;
  Settings settings;
  StereoCamera camera;
  std::optional<OwnCamera> raw;  // raw cameras, while the size of their images is not known
  std::optional<Rectifier> rectifier;
  std::optional<Eigen::Isometry3d> T_body_camera;
  SavedMap known;
  std::unique_ptr<SlamSystem> slam;
  std::vector<FramePose> frames;  // poses are filled in when they are asked for
  std::vector<std::size_t> keyframes;

  explicit State(const SlamOptions& given) : options(given), settings(settings_of(given)) {
    if (options.load_map && options.learned)
      throw std::invalid_argument("SlamOptions: give load_map or learned, not both");
    if (options.load_map) known = stereo_slam::load_map(*options.load_map);
    if (options.learned) known = as_map(read_learned_cameras(*options.learned));
  }

  void use(const StereoCamera& rectified) {
    camera = rectified;
    begin_if_sized();
  }

  void use(const StereoRig& rig) {
    rectifier.emplace(rig);
    camera = rectifier->camera();
    if (rig.T_body_left) T_body_camera = *rig.T_body_left * rectifier->T_left_camera();
    raw.reset();
    begin_if_sized();
  }

  void use(const OwnCamera& own) {
    T_body_camera = own.T_body_camera;
    if (own.rectified) return use(*own.rectified);
    if (own.rig->left.width_px > 0 && own.other_sizes.empty()) return use(*own.rig);
    raw = own;
  }

  /// Begins as soon as the images' size is known: at once, or with the first images.
  void begin_if_sized() {
    if (camera.width_px == 0) return;
    const auto thread = options.loop_thread ? LoopThread::kOwn : LoopThread::kNone;
    const auto use = options.extend_map ? MapUse::kContinue : MapUse::kLocalise;
    try {
      slam = make_slam_system(camera, settings, thread, known, use);
    } catch (const std::invalid_argument& error) {
      const auto& file = options.load_map ? options.load_map : options.learned;
      if (!file) throw;
      throw std::invalid_argument(fmt::format("{}: {}", file->string(), error.what()));
    }
  }

  /// Begins with the sizes of the first images.
  void take_sizes(const cv::Size& left, const cv::Size& right) {
    if (raw) return use(rig_for(*raw, left, right));
    StereoCamera sized = camera;
    sized.width_px = left.width;
    sized.height_px = left.height;
    require_valid(sized);
    use(sized);
  }

  void require_sizes(const cv::Size& left, const cv::Size& right) const {
    const cv::Size rectified(camera.width_px, camera.height_px);
    require_size(left, rectifier ? rectifier->left_size() : rectified);
    require_size(right, rectifier ? rectifier->right_size() : rectified);
  }

  static void require_size(const cv::Size& size, const cv::Size& calibrated) {
    if (size == calibrated) return;
    throw std::invalid_argument(fmt::format("the images have {}x{} pixels, but the calibration is of {}x{}",
                                            size.width, size.height, calibrated.width, calibrated.height));
  }

  [[nodiscard]] cv::Size right_size() const {
    return rectifier ? rectifier->right_size() : cv::Size(camera.width_px, camera.height_px);
  }

  /// The body of the calibration is the IMU.
  [[nodiscard]] Pose T_camera_imu() const {
    if (!T_body_camera) {
      throw std::invalid_argument(
          "the calibration has no pose of the camera in the axes of the IMU; add T_body_left, T_BS or "
          "T_cam_imu");
    }
    return to_pose(*T_body_camera).inverse();
  }

  [[nodiscard]] std::vector<FramePose> trajectory() const {
    std::vector<FramePose> result = frames;
    if (result.empty()) return result;
    const auto poses = slam->trajectory();
    for (std::size_t i = 0; i < result.size(); ++i) result[i].T_world_camera = poses.at(i);
    return result;
  }

  [[nodiscard]] const SlamSystem& begun() const {
    if (!slam) throw std::logic_error("no frame has been processed yet");
    return *slam;
  }
};

StereoSlam::StereoSlam(const StereoCamera& camera, const SlamOptions& options) {
  check_alignment(options);
  require_valid(camera);
  state_ = std::make_unique<State>(options);
  state_->use(camera);
}

StereoSlam::StereoSlam(const StereoRig& rig, const SlamOptions& options) {
  check_alignment(options);
  require_valid(rig);
  state_ = std::make_unique<State>(options);
  OwnCamera own;
  own.rig = rig;
  state_->use(own);
}

StereoSlam::StereoSlam(const std::filesystem::path& calibration, const SlamOptions& options) {
  check_alignment(options);
  state_ = std::make_unique<State>(options);
  const OwnCamera own = read_calibration(calibration);
  try {
    state_->use(own);
  } catch (const std::runtime_error& error) {  // thrown by the rectification, which does not know the file
    throw std::runtime_error(fmt::format("{}: {}", calibration.string(), error.what()));
  }
}

StereoSlam::StereoSlam(StereoSlam&&) noexcept = default;
StereoSlam& StereoSlam::operator=(StereoSlam&&) noexcept = default;
StereoSlam::~StereoSlam() = default;

FrameResult StereoSlam::process(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp_ns) {
  return process_frame(left, right, stamp_ns, std::nullopt);
}

FrameResult StereoSlam::process(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp_ns,
                                std::span<const ImuSample> imu) {
  return process_frame(
      left, right, stamp_ns,
      ImuReadings{.sensor = {.T_camera_imu = Pose::identity()},  // known with the first images
                  .samples = {imu.begin(), imu.end()}});
}

FrameResult StereoSlam::process_frame(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp_ns,
                                      std::optional<ImuReadings> imu) {
  State& state = *state_;
  const std::scoped_lock lock(state.mutex);
  if (imu && !state.slam) state.options.imu_noise.check();
  if (!state.frames.empty() && stamp_ns <= state.frames.back().stamp_ns) {
    throw std::invalid_argument(fmt::format("the stamp {} ns is not later than {} ns, the one before",
                                            stamp_ns, state.frames.back().stamp_ns));
  }
  if (right.empty() && !state.slam) throw std::invalid_argument("the right image is empty");
  StereoFrame frame{state.frames.size(), stamp_ns, grey(left), {}};
  if (right.empty()) {
    frame.right = cv::Mat::zeros(state.right_size(), CV_8UC1);
    frame.right_fault = "the right image is empty";
  } else {
    frame.right = to_grey(right);
  }
  const bool rectified = !state.raw && !state.rectifier;
  if (rectified && frame.left.size() != frame.right.size())
    throw std::invalid_argument("the two images differ in size");
  if (!state.slam) state.take_sizes(frame.left.size(), frame.right.size());
  state.require_sizes(frame.left.size(), frame.right.size());
  if (state.rectifier) {
    frame.left = state.rectifier->left(frame.left);
    frame.right = state.rectifier->right(frame.right);
  }
  if (imu) imu->sensor = {.T_camera_imu = state.T_camera_imu(), .noise = state.options.imu_noise};
  frame.imu = std::move(imu);
  equalise_contrast(frame, state.settings.images);
  FrameResult result = state.slam->process(frame);
  state.frames.push_back({frame.index, stamp_ns, result.status, {}});
  if (result.is_keyframe) state.keyframes.push_back(frame.index);
  return result;
}

void StereoSlam::finish() {
  const std::scoped_lock lock(state_->mutex);
  if (state_->slam) state_->slam->finish();
}

std::vector<FramePose> StereoSlam::trajectory() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->trajectory();
}

std::vector<FramePose> StereoSlam::keyframes() const {
  const std::scoped_lock lock(state_->mutex);
  const auto frames = state_->trajectory();
  std::vector<FramePose> keyframes;
  for (const std::size_t index : state_->keyframes) keyframes.push_back(frames.at(index));
  return keyframes;
}

std::vector<MapPoint> StereoSlam::map_points() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->slam ? state_->slam->map_points() : std::vector<MapPoint>{};
}

std::vector<LoopEvent> StereoSlam::loops() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->slam ? state_->slam->loop_events() : std::vector<LoopEvent>{};
}

const StereoCamera& StereoSlam::camera() const { return state_->camera; }

const std::optional<Eigen::Isometry3d>& StereoSlam::T_body_camera() const { return state_->T_body_camera; }

std::optional<InertialSummary> StereoSlam::inertial() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->slam ? state_->slam->inertial() : std::nullopt;
}

void StereoSlam::save_cameras(const std::filesystem::path& file) const {
  const std::scoped_lock lock(state_->mutex);
  const auto learned = state_->begun().rig().learned;
  if (!learned) throw std::logic_error("this preset learns nothing of the cameras");
  save_learned_cameras(file, *learned);
}

void StereoSlam::save_map(const std::filesystem::path& file) const {
  const std::scoped_lock lock(state_->mutex);
  stereo_slam::save_map(file, state_->begun().saved_map());
}

}  // namespace stereo_slam
