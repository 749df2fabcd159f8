// SPDX-License-Identifier: MIT
#include "simulator/recording/recording_folder.hpp"

#include <fstream>
#include <ostream>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "simulator/recording/euroc_writer.hpp"
#include "simulator/recording/kitti_writer.hpp"
#include "stereo_slam/codecs/codecs.hpp"
#include "stereo_slam/io/output_file.hpp"

namespace stereo_slam::simulator {

namespace fs = std::filesystem;

namespace {

fs::path make_folder(const fs::path& folder) {
  fs::create_directories(folder);
  return folder;
}

void write_png(const cv::Mat1b& image, const fs::path& file) {
  const auto png = opencv_codecs().encode(image, ".png", {cv::IMWRITE_PNG_COMPRESSION, 1});
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  stream.close();
  if (png.empty() || !stream)
    throw std::runtime_error(file.string() + ": cannot be written; check permissions and free space");
}

}  // namespace

void make_empty_folder(const fs::path& output) {
  std::error_code error;
  fs::create_directories(output, error);
  if (!error && !fs::is_directory(output)) error = std::make_error_code(std::errc::not_a_directory);
  if (error)
    throw std::runtime_error(
        fmt::format("{}: cannot be used for output ({})", output.string(), error.message()));
  if (fs::is_empty(output, error) || error) return;  // what cannot be read is reported when it is written
  throw std::runtime_error(
      fmt::format("{}: not empty; choose another output folder, or remove it", output.string()));
}

RecordingFolder::RecordingFolder(const SimulationSettings& settings, const fs::path& output)
    : settings_(settings), root_(output) {
  make_empty_folder(root_);
  if (settings.rig) root_ /= "mav0";
  images_ = settings.rig ? std::array{make_folder(root_ / "cam0/data"), make_folder(root_ / "cam1/data")}
                         : std::array{make_folder(root_ / "image_0"), make_folder(root_ / "image_1")};
  if (settings.moving_masks) (void)make_folder(root_ / "moving");
}

void RecordingFolder::write_cameras() const {
  if (!settings_.rig) {
    write_file(root_ / "calib.txt", [&](std::ostream& stream) {
      write_kitti_calibration(stream, settings_.camera, settings_.baseline_m);
    });
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

void RecordingFolder::write_times_and_poses(const CameraPath& path) const {
  CameraPath body_path = path;  // the body of the KITTI layout is the left camera
  if (settings_.rig) {
    const Eigen::Isometry3d T_camera_body = settings_.rig->T_body_left->inverse();
    for (auto& pose : body_path) pose = pose * T_camera_body;
  }
  const std::vector<ImuTruth> imu = write_imu(body_path);
  if (!settings_.rig) {
    write_file(root_ / "times.txt",
               [&](std::ostream& stream) { write_kitti_times(stream, path.size(), settings_.fps); });
    write_file(root_ / "poses.txt", [&](std::ostream& stream) { write_kitti_poses(stream, path); });
    return;
  }
  for (const auto* camera : {"cam0", "cam1"}) {
    write_file(root_ / camera / "data.csv",
               [&](std::ostream& stream) { write_euroc_rows(stream, path.size(), settings_.fps); });
  }
  fs::create_directories(root_ / "state_groundtruth_estimate0");
  write_file(root_ / "state_groundtruth_estimate0/data.csv",
             [&](std::ostream& stream) { write_euroc_truth(stream, body_path, imu, settings_.fps); });
}

std::vector<ImuTruth> RecordingFolder::write_imu(const CameraPath& body_path) const {
  constexpr std::size_t kFewest = 2;  // a recording that was interrupted may have less
  if (!settings_.imu || body_path.size() < kFewest) return {};
  const ImuSettings& imu = *settings_.imu;
  const auto readings = imu_readings(body_path, settings_.fps, imu, settings_.seed);
  auto truth = imu_truth(body_path, settings_.fps, readings, imu);
  const bool euroc = settings_.rig.has_value();
  if (euroc) fs::create_directories(root_ / "imu0");
  write_file(root_ / (euroc ? "imu0/data.csv" : "imu.csv"), [&](std::ostream& stream) {
    write_imu_rows(stream, readings, imu, euroc ? euroc_stamp_ns(0, settings_.fps) : 0);
  });
  write_file(root_ / (euroc ? "imu0/sensor.yaml" : "imu.yaml"),
             [&](std::ostream& stream) { write_imu_sensor(stream, imu); });
  if (!euroc) {
    write_file(root_ / "imu_truth.csv", [&](std::ostream& stream) { write_imu_truth(stream, truth); });
  }
  return truth;
}

void RecordingFolder::write_disturbance(const std::vector<RightCameraError>& errors,
                                        const PinholeCamera& camera) const {
  write_file(root_ / "disturbance.csv", [&](std::ostream& stream) {
    stream << "frame,u_px,v_px,roll_px,pitch_rad,yaw_rad,roll_rad,delay_s\n";
    for (std::size_t frame = 0; frame < errors.size(); ++frame) {
      const Eigen::Vector3d& rotation = errors[frame].rotation_rad;
      const Eigen::Vector3d moved = displacement_px(camera, rotation);
      stream << fmt::format("{},{},{},{},{},{},{},{}\n", frame, moved.x(), moved.y(), moved.z(), rotation.x(),
                            rotation.y(), rotation.z(), errors[frame].delay_s);
    }
  });
}

void RecordingFolder::write_image(const cv::Mat1b& image, std::size_t side, std::size_t frame) const {
  write_png(image, images_[side] / name(frame));
}

void RecordingFolder::write_mask(const cv::Mat1b& mask, std::size_t frame) const {
  write_png(mask, root_ / "moving" / name(frame));
}

std::string RecordingFolder::name(std::size_t frame) const {
  return settings_.rig ? fmt::format("{}.png", euroc_stamp_ns(frame, settings_.fps))
                       : fmt::format("{:06}.png", frame);
}

}  // namespace stereo_slam::simulator
