// SPDX-License-Identifier: MIT
#include "simulate.hpp"

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

#include "random.hpp"
#include "renderer.hpp"
#include "text_file.hpp"
#include "traffic.hpp"
#include "world.hpp"

namespace stereo_slam::simulate {
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
  validate(settings.camera);
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

void write_image(const cv::Mat1b& image, const fs::path& folder, std::size_t frame) {
  const fs::path file = folder / fmt::format("{:06}.png", frame);
  if (!cv::imwrite(file.string(), image, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
    throw std::runtime_error(file.string() + ": cannot be written; check permissions and free space");
  }
}

using Folders = std::array<fs::path, 2>;  ///< of the left and the right images

/// Renders and writes stereo pairs; one for each thread.
class Camera {
 public:
  Camera(const SimulationSettings& settings, const World& world, const Traffic& traffic,
         const Folders& folders)
      : settings_(settings),
        traffic_(traffic),
        folders_(folders),
        renderer_(world.scene(), settings.camera, settings.samples_per_pixel) {}

  void shoot(std::size_t frame, const Eigen::Isometry3d& T_world_left) {
    const double time_s = static_cast<double>(frame) / settings_.fps;
    const auto moving = traffic_.at(frame);
    for (int side = 0; side < 2; ++side) {
      const Eigen::Isometry3d T_world_camera =
          T_world_left * Eigen::Translation3d(side * settings_.baseline_m, 0.0, 0.0);
      const cv::Mat1f light = renderer_.render(T_world_camera, moving);
      const double gain = exposure_gain(settings_.sensor, settings_.seed, time_s, side);
      Random random(settings_.seed, 1000 + 2 * frame + static_cast<std::size_t>(side));
      write_image(expose(light, settings_.sensor, gain, random.bits()),
                  folders_[static_cast<std::size_t>(side)], frame);
    }
  }

 private:
  const SimulationSettings& settings_;
  const Traffic& traffic_;
  const Folders& folders_;
  Renderer renderer_;
};

}  // namespace

CameraPath camera_path(const SimulationSettings& settings) {
  validate(settings);
  if (settings.trajectory.empty()) {
    const int frames = settings.frames > 0 ? settings.frames : SimulationSettings::kDefaultFrames;
    return street_loop(frames, settings.fps, settings.loop);
  }
  CameraPath path = read_camera_path(settings.trajectory);
  if (settings.frames > 0) path.resize(std::min(path.size(), static_cast<std::size_t>(settings.frames)));
  return path;
}

void simulate(const SimulationSettings& settings, const fs::path& output, const Progress& progress) {
  CameraPath path = camera_path(settings);
  const World world(path, {.seed = settings.seed,
                           .camera_height_m = settings.camera_height_m,
                           .texture_size_px = settings.texture_size_px,
                           .street = {}});
  const Traffic traffic(world, path, settings.fps, settings.dynamic_objects, settings.seed);

  const std::array folders{make_image_folder(output / "image_0"), make_image_folder(output / "image_1")};
  write_file(output / "calib.txt", [&](std::ostream& stream) { write_calibration(stream, settings); });
  const auto write_times_and_poses = [&] {
    write_file(output / "times.txt",
               [&](std::ostream& stream) { write_times(stream, path.size(), settings.fps); });
    write_file(output / "poses.txt", [&](std::ostream& stream) { write_poses(stream, path); });
  };
  write_times_and_poses();

  // Each worker renders and writes whole frames, so that one writes while another renders.
  std::atomic<std::size_t> next_frame = 0;
  std::mutex mutex;
  std::size_t done = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      Camera camera(settings, world, traffic, folders);
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
  write_times_and_poses();
}

}  // namespace stereo_slam::simulate
