// SPDX-License-Identifier: MIT
#include "simulator/recording/simulate.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <exception>
#include <mutex>
#include <ostream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <opencv2/imgcodecs.hpp>

#include "simulator/recording/euroc_writer.hpp"
#include "simulator/rendering/lens_view.hpp"
#include "simulator/rendering/renderer.hpp"
#include "simulator/textures/random.hpp"
#include "simulator/world/traffic.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam::simulator {
namespace {

namespace fs = std::filesystem;

void require(bool ok, const std::string& what, double value) {
  if (!ok) throw std::invalid_argument(what + ", not " + std::to_string(value));
}

void validate(const SimulationSettings& settings) {
  require(settings.frames >= 0, "frames must not be negative", settings.frames);
  require(settings.dynamic_objects >= 0, "dynamic_objects must not be negative", settings.dynamic_objects);
  require(settings.fps > 0.0, "fps must be positive", settings.fps);
  require(settings.baseline_m > 0.0, "baseline_m must be positive", settings.baseline_m);
  require(settings.camera_height_m > 0.0, "camera_height_m must be positive", settings.camera_height_m);
  require(settings.threads >= 0, "threads must not be negative", settings.threads);
  const int samples = settings.samples_per_pixel;
  require(samples == 4 || samples == 8 || samples == 16, "samples_per_pixel must be 4, 8 or 16", samples);
  if (settings.rig) {
    if (!settings.rig->T_body_left) throw std::invalid_argument("rig: T_body_left is missing");
  } else {
    validate(settings.camera);
  }
  validate(settings.sensor);
}

/// KITTI's projection matrices; P2 and P3, the colour cameras, are the grey ones again. All numbers are
/// written in the fewest digits that give them back exactly.
void write_calibration(std::ostream& stream, const SimulationSettings& settings) {
  const PinholeCamera& camera = settings.camera;
  for (int i = 0; i < 4; ++i) {
    const double shift = i % 2 == 0 ? 0.0 : -camera.fx * settings.baseline_m;
    fmt::print(stream, "P{}: {} 0 {} {} 0 {} {} 0 0 0 1 0\n", i, camera.fx, camera.cx, shift, camera.fy,
               camera.cy);
  }
}

void write_times(std::ostream& stream, std::size_t frames, double fps) {
  for (std::size_t i = 0; i < frames; ++i) fmt::print(stream, "{}\n", static_cast<double>(i) / fps);
}

void write_poses(std::ostream& stream, const CameraPath& path) {
  for (const Eigen::Isometry3d& pose : path) {
    const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows = pose.matrix().topRows<3>();
    fmt::print(stream, "{}\n", fmt::join(rows.data(), rows.data() + rows.size(), " "));
  }
}

/// Creates a folder for images; throws when it has any, so that no recording is overwritten or mixed with
/// another.
fs::path make_image_folder(const fs::path& folder) {
  fs::create_directories(folder);
  if (!fs::is_empty(folder)) {
    throw std::runtime_error(folder.string() + ": not empty; remove it or choose another output folder");
  }
  return folder;
}

void write_image(const cv::Mat1b& image, const fs::path& file) {
  if (!cv::imwrite(file.string(), image, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
    throw std::runtime_error(file.string() + ": cannot be written; check permissions and free space");
  }
}

/// Where everything of a recording goes.
class Layout {
 public:
  /// Creates the folders of the images.
  Layout(const SimulationSettings& settings, const fs::path& output) : settings_(settings), root_(output) {
    if (settings.rig) root_ /= "mav0";
    images_ = settings.rig
                  ? std::array{make_image_folder(root_ / "cam0/data"), make_image_folder(root_ / "cam1/data")}
                  : std::array{make_image_folder(root_ / "image_0"), make_image_folder(root_ / "image_1")};
    if (settings.moving_masks) make_image_folder(root_ / "moving");
  }

  [[nodiscard]] fs::path image(std::size_t side, std::size_t frame) const {
    return images_[side] / name(frame);
  }
  [[nodiscard]] fs::path mask(std::size_t frame) const { return root_ / "moving" / name(frame); }

  void write_cameras() const {
    if (!settings_.rig) {
      write_file(root_ / "calib.txt", [&](std::ostream& stream) { write_calibration(stream, settings_); });
      return;
    }
    const StereoRig& rig = *settings_.rig;
    const Eigen::Isometry3d T_body_right = *rig.T_body_left * rig.T_right_left.inverse();
    write_file(root_ / "cam0/sensor.yaml", [&](std::ostream& stream) {
      write_euroc_sensor(stream, rig.left, *rig.T_body_left, settings_.fps);
    });
    write_file(root_ / "cam1/sensor.yaml", [&](std::ostream& stream) {
      write_euroc_sensor(stream, rig.right, T_body_right, settings_.fps);
    });
  }

  void write_times_and_poses(const CameraPath& path) const {
    if (!settings_.rig) {
      write_file(root_ / "times.txt",
                 [&](std::ostream& stream) { write_times(stream, path.size(), settings_.fps); });
      write_file(root_ / "poses.txt", [&](std::ostream& stream) { write_poses(stream, path); });
      return;
    }
    for (const auto* camera : {"cam0", "cam1"}) {
      write_file(root_ / camera / "data.csv",
                 [&](std::ostream& stream) { write_euroc_rows(stream, path.size(), settings_.fps); });
    }
    fs::create_directories(root_ / "state_groundtruth_estimate0");
    write_file(root_ / "state_groundtruth_estimate0/data.csv", [&](std::ostream& stream) {
      write_euroc_truth(stream, path, *settings_.rig->T_body_left, settings_.fps);
    });
  }

 private:
  [[nodiscard]] std::string name(std::size_t frame) const {
    return settings_.rig ? fmt::format("{}.png", euroc_stamp_ns(frame, settings_.fps))
                         : fmt::format("{:06}.png", frame);
  }

  const SimulationSettings& settings_;
  fs::path root_;
  std::array<fs::path, 2> images_;
};

/// The lenses of a rig: none with rectified images.
std::vector<LensView> lens_views(const SimulationSettings& settings) {
  std::vector<LensView> views;
  if (settings.rig) {
    views.emplace_back(settings.rig->left);
    views.emplace_back(settings.rig->right);
  }
  return views;
}

/// Renders and writes stereo pairs; one for each thread.
class Camera {
 public:
  Camera(const SimulationSettings& settings, const World& world, const Traffic& traffic,
         const std::vector<LensView>& lenses, const Layout& layout)
      : settings_(settings), traffic_(traffic), lenses_(lenses), layout_(layout) {
    for (std::size_t side = 0; side < 2; ++side) {
      renderers_.emplace_back(world.scene(), lenses.empty() ? settings.camera : lenses[side].pinhole(),
                              settings.samples_per_pixel);
    }
  }

  void shoot(std::size_t frame, const Eigen::Isometry3d& T_world_left) {
    const double time_s = static_cast<double>(frame) / settings_.fps;
    const auto moving = traffic_.at(frame);
    for (std::size_t side = 0; side < 2; ++side) {
      const cv::Mat1f light = see(side, T_world_left, moving);
      if (side == 0 && settings_.moving_masks) {
        const cv::Mat1b mask = light != see(side, T_world_left, {});
        write_image(mask, layout_.mask(frame));
      }
      const double gain = exposure_gain(settings_.sensor, settings_.seed, time_s, static_cast<int>(side));
      Random random(settings_.seed, 1000 + 2 * frame + side);
      write_image(expose(light, settings_.sensor, gain, random.bits()), layout_.image(side, frame));
    }
  }

 private:
  /// The light that falls on the sensor of one side.
  [[nodiscard]] cv::Mat1f see(std::size_t side, const Eigen::Isometry3d& T_world_left,
                              const std::vector<Face>& moving) {
    const cv::Mat1f light = renderers_[side].render(T_world_left * T_left_camera(side), moving);
    return lenses_.empty() ? light : lenses_[side].through(light);
  }

  [[nodiscard]] Eigen::Isometry3d T_left_camera(std::size_t side) const {
    if (side == 0) return Eigen::Isometry3d::Identity();
    if (settings_.rig) return settings_.rig->T_right_left.inverse();
    return Eigen::Isometry3d(Eigen::Translation3d(settings_.baseline_m, 0.0, 0.0));
  }

  const SimulationSettings& settings_;
  const Traffic& traffic_;
  const std::vector<LensView>& lenses_;
  const Layout& layout_;
  std::vector<Renderer> renderers_;
};

}  // namespace

CameraPath camera_path(const SimulationSettings& settings) {
  validate(settings);
  if (settings.trajectory.empty()) {
    const int frames = settings.frames > 0 ? settings.frames : SimulationSettings::kDefaultFrames;
    return settings.scenery == Scenery::kTown ? street_loop(frames, settings.fps, settings.loop)
                                              : highway_drive(frames, settings.fps, settings.highway);
  }
  CameraPath path = read_camera_path(settings.trajectory);
  if (settings.frames > 0) path.resize(std::min(path.size(), static_cast<std::size_t>(settings.frames)));
  constexpr double kLargestTown_m = 20e3;  // what is rendered around the path must fit into memory
  for (const auto& pose : path) {
    const double distance_m = (pose.translation() - path.front().translation()).norm();
    if (!(distance_m <= kLargestTown_m)) {
      throw std::runtime_error(
          fmt::format("{}: leads {:.3g} m away from its start; at most {:.0f} m can be rendered",
                      settings.trajectory.string(), distance_m, kLargestTown_m));
    }
  }
  return path;
}

void simulate(const SimulationSettings& settings, const fs::path& output, const Progress& progress) {
  CameraPath path = camera_path(settings);
  const World world(path, {.scenery = settings.scenery,
                           .seed = settings.seed,
                           .camera_height_m = settings.camera_height_m,
                           .texture_size_px = settings.texture_size_px,
                           .street = {}});
  const Traffic traffic(world, path, settings.fps, settings.dynamic_objects, settings.seed);

  const std::vector<LensView> lenses = lens_views(settings);
  const Layout layout(settings, output);
  layout.write_cameras();
  layout.write_times_and_poses(path);

  // Each worker renders and writes whole frames, so that one writes while another renders.
  std::atomic<std::size_t> next_frame = 0;
  std::mutex mutex;
  std::size_t done = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      Camera camera(settings, world, traffic, lenses, layout);
      for (std::size_t frame = next_frame++; frame < path.size(); frame = next_frame++) {
        camera.shoot(frame, path[frame]);
        const std::lock_guard lock(mutex);
        ++done;
        const bool go_on = !progress || progress(static_cast<int>(done), static_cast<int>(path.size()));
        if (!go_on) next_frame = path.size();
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      next_frame = path.size();
    }
  };
  const auto processors = std::max(1U, std::thread::hardware_concurrency());
  const auto threads = settings.threads > 0 ? static_cast<unsigned>(settings.threads) : processors;
  {
    std::vector<std::jthread> workers;
    for (unsigned i = 0; i < threads; ++i) workers.emplace_back(work);
  }
  if (failure) std::rethrow_exception(failure);
  if (done == path.size()) return;
  path.resize(done);  // frames are begun in order and all that were begun are finished
  layout.write_times_and_poses(path);
}

}  // namespace stereo_slam::simulator
