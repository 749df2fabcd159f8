// SPDX-License-Identifier: MIT
// Every reader of a file: it returns what it documents, or throws one std::runtime_error that names the file.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <typeinfo>
#include <zlib.h>

#include "fuzz/fuzz_files.hpp"
#include "fuzz/fuzz_target.hpp"
#include "stereo_slam/calibration/calibration_file.hpp"
#include "stereo_slam/calibration/rectifier.hpp"
#include "stereo_slam/calibration/rig_file.hpp"
#include "stereo_slam/dataset/euroc.hpp"
#include "stereo_slam/dataset/kitti.hpp"
#include "stereo_slam/dataset/kitti_oxts.hpp"
#include "stereo_slam/evaluation/loop_score.hpp"
#include "stereo_slam/evaluation/nees.hpp"
#include "stereo_slam/images/image_size.hpp"
#include "stereo_slam/images/jpeg_data.hpp"
#include "stereo_slam/images/png_data.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/loop_closing/map_ids.hpp"
#include "stereo_slam/report/run_folder.hpp"
#include "stereo_slam/results/byte_stream.hpp"
#include "stereo_slam/results/learned_cameras.hpp"
#include "stereo_slam/results/map_file.hpp"
#include "stereo_slam/settings/settings_io.hpp"
#include "stereo_slam/stamps/name_times.hpp"

namespace antipode::fuzz {
namespace {

namespace fs = std::filesystem;
using namespace stereo_slam;

[[nodiscard]] bool finite_pose(const Eigen::Isometry3d& T) { return T.matrix().allFinite(); }

template <TrajectoryFormat kFormat>
void trajectory(Bytes bytes) {
  const fs::path file = folder().write("trajectory.txt", bytes);
  attempt_to_read([&] {
    const Trajectory read = read_trajectory(file, kFormat);
    require(std::all_of(read.poses.begin(), read.poses.end(), finite_pose), "a pose is not finite");
    require(read.stamps_ns.empty() || read.stamps_ns.size() == read.poses.size(), "a pose without a stamp");
    require(std::is_sorted(read.stamps_ns.begin(), read.stamps_ns.end()), "stamps decrease");
  });
  attempt_to_read([&] { (void)read_trajectory(file); });
}

void require_stamps(const StereoSequence& sequence) {
  for (const auto& frame : sequence.frames) {
    require(std::abs(frame.stamp_ns) <= kLatestStamp_ns, "a stamp that wraps");
  }
}

void calib(Bytes bytes) {
  const fs::path file = folder().write("kitti/calib.txt", bytes);
  const stereo_slam::StereoCamera camera = scan_kitti(file.parent_path()).sequence.camera;
  if (camera.fx == 0.0) return;  // it was refused
  const bool finite = std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy + camera.baseline_m);
  require(finite && camera.fx > 0.0 && camera.fy > 0.0 && camera.baseline_m > 0.0, "not a camera");
}

void times(Bytes bytes) {
  (void)folder().write("kitti_times/image_0/000000.png", {});
  (void)folder().write("kitti_times/image_0/000001.png", {});
  const fs::path file = folder().write("kitti_times/times.txt", bytes);
  require_stamps(scan_kitti(file.parent_path()).sequence);
}

/// A time and a packet of KITTI's raw data.
void kitti_raw(Bytes bytes) {
  (void)folder().write("oxts/data/0000000000.txt", bytes);
  const fs::path file = folder().write("oxts/timestamps.txt", bytes);
  attempt_to_read([&] {
    for (const auto& [index, stamp_ns] : read_kitti_stamps(file))
      require(stamp_ns <= kLatestStamp_ns, "a stamp that wraps");
  });
  const std::string time = "2011-09-26 13:02:25.5\n";
  (void)folder().write("oxts/timestamps.txt",
                       {reinterpret_cast<const std::uint8_t*>(time.data()), time.size()});
  attempt_to_read([&] {
    for (const auto& T : read_oxts(file.parent_path()).T_world_imu)
      require(finite_pose(T), "a pose is not finite");
  });
}

void euroc_csv(Bytes bytes) {
  (void)folder().write("mav0/cam0/data.csv", bytes);
  const fs::path file = folder().write("mav0/cam1/data.csv", bytes);
  require_stamps(scan_euroc(file.parent_path().parent_path()).sequence);
}

/// The names of images, one a line.
void image_names(Bytes bytes) {
  std::vector<std::string> names(1);
  for (const auto byte : bytes) {
    if (byte == '\n') {
      names.emplace_back();
    } else {
      names.back() += static_cast<char>(byte);
    }
  }
  try {
    const NameTimes times = times_in(names);
    require(times.keys.empty() || times.keys.size() == names.size(), "a name without a key");
    require(times.stamps_ns.empty() || times.stamps_ns == times.keys, "stamps are not the order");
    for (const auto key : times.keys) require(key >= 0, "a key that wraps");
    for (const auto stamp_ns : times.stamps_ns) require(stamp_ns <= kLatestStamp_ns, "a stamp that wraps");
  } catch (const std::invalid_argument&) {
  }
}

void require_lens(const Lens& lens) {
  require(std::isfinite(lens.fx + lens.fy + lens.cx + lens.cy) && lens.fx > 0.0 && lens.fy > 0.0,
          "not a lens");
  require(lens.width_px >= 0 && lens.height_px >= 0, "a negative resolution");
  for (const double coefficient : lens.coefficients) {
    require(std::isfinite(coefficient), "a distortion coefficient is not finite");
  }
}

/// Rectification of any two lenses; only of small images, because it takes time for each pixel.
void use(const StereoRig& rig) {
  require_lens(rig.left);
  require_lens(rig.right);
  require(finite_pose(rig.T_right_left), "a pose is not finite");
  constexpr int kMostPixels = 64 * 64;
  if (rig.left.width_px == 0 || rig.left.height_px > kMostPixels / rig.left.width_px) return;
  try {
    const Rectifier rectifier(rig);
    const auto& camera = rectifier.camera();
    require(std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy + camera.baseline_m) &&
                camera.fx > 0.0 && camera.fy > 0.0 && camera.baseline_m > 0.0,
            "not a rectified camera");
    require(finite_pose(rectifier.T_left_camera()), "the rectification is not finite");
    (void)rectifier.left(cv::Mat::zeros(rig.left.height_px, rig.left.width_px, CV_8UC1));
  } catch (const std::runtime_error& error) {
    require(typeid(error) == typeid(std::runtime_error), std::string("another library: ") + error.what());
  }
}

void use(const OwnCamera& camera) {
  if (camera.rig) use(*camera.rig);
  require(!camera.frame_rate_hz || std::isfinite(*camera.frame_rate_hz), "the frame rate is not finite");
}

void sensor_yaml(Bytes bytes) {
  const fs::path file = folder().write("sensor.yaml", bytes);
  attempt_to_read([&] { use(read_sensor_files(file, file)); });
}

void camchain(Bytes bytes) {
  const fs::path file = folder().write("camchain.yaml", bytes);
  attempt_to_read([&] { use(read_camchain(file)); });
}

void rig_file(Bytes bytes) {
  const fs::path file = folder().write("calibration.yaml", bytes);
  attempt_to_read([&] { use(read_own_camera(file)); });
}

/// OpenCV's and ROS's files, and all others by their contents. The same is read for both cameras.
void calibration(Bytes bytes) {
  const bool xml = !bytes.empty() && bytes.front() == '<';
  (void)folder().write("either/right.yaml", bytes);
  const fs::path file = folder().write(xml ? "either/left.xml" : "either/left.yaml", bytes);
  attempt_to_read([&] { use(read_calibration(file)); });
}

void settings(Bytes bytes) {
  const fs::path file = folder().write("settings.yaml", bytes);
  attempt_to_read([&] { (void)load_settings(file); });
}

/// The bytes between header and trailer; lengths and checksums are right, because nobody would guess them.
void map_body(Bytes bytes) {
  const auto checksum = [](const std::string& text) {
    return static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const unsigned char*>(text.data()), text.size()));
  };
  ByteWriter writer;
  writer.put_bytes("antipode map\r\n\x1a\n");
  writer.put(kMapVersion);
  writer.put(std::uint64_t{32 + bytes.size() + 4});
  writer.put(checksum(std::string(writer.bytes())));
  writer.put_bytes({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  writer.put(checksum(std::string(writer.bytes())));
  const std::string text = writer.take();
  const fs::path file =
      folder().write("map.bin", {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  attempt_to_read([&] {
    const SavedMap map = load_map(file);
    check(map);
    (void)MapIds::after(map);
  });
}

/// cameras.yaml of a run.
void learned_cameras(Bytes bytes) {
  const fs::path file = folder().write("cameras.yaml", bytes);
  attempt_to_read([&] {
    const LearnedCameras learned = read_learned_cameras(file);
    const OnlineRectificationSettings settings;
    (void)RectificationEstimator::after_drift(learned.camera, settings, learned.estimate);
  });
}

void map_file(Bytes bytes) {
  const fs::path file = folder().write("map.bin", bytes);
  attempt_to_read([&] { check(load_map(file)); });
}

void loops(Bytes bytes) {
  const fs::path file = folder().write("loops.csv", bytes);
  attempt_to_read([&] { (void)read_loops(file); });
}

void covariances(Bytes bytes) {
  const fs::path file = folder().write("covariances.csv", bytes);
  attempt_to_read([&] {
    for (const CovarianceRow& row : read_covariances(file)) {
      require(row.relative.allFinite() && std::isfinite(row.nis), "a covariance is not finite");
    }
  });
}

/// What is read of images without OpenCV.
void image_headers(Bytes bytes) {
  constexpr std::uint64_t kMostDecoded = 100'000;  // pixels; more take too long
  if (const auto size = image_size(bytes)) {
    if (is_supported(*size) && size->width_px * size->height_px <= kMostDecoded)
      (void)decode_plain_grey_png(bytes);
  }
  attempt_to_read([&] { (void)check_png_data(folder().path() / "image.png", bytes); });
  (void)is_compressed_bmp(bytes);
  (void)is_shifted_bmp(bytes);
  (void)is_turned_tiff(bytes);
  (void)is_damaged_jpeg(bytes);
}

/// run.yaml, by the report.
void run_yaml(Bytes bytes) {
  const fs::path file = folder().write("run/run.yaml", bytes);
  attempt_to_read([&] { (void)report::read_run_folder(file.parent_path()); });
}

}  // namespace

std::vector<Target> parser_targets() {
  return {{"calib", calib},
          {"times", times},
          {"kitti_poses", trajectory<TrajectoryFormat::kKitti>},
          {"tum", trajectory<TrajectoryFormat::kTum>},
          {"euroc_poses", trajectory<TrajectoryFormat::kEuroc>},
          {"euroc_csv", euroc_csv},
          {"image_names", image_names},
          {"kitti_raw", kitti_raw},
          {"sensor_yaml", sensor_yaml},
          {"camchain", camchain},
          {"rig_file", rig_file},
          {"calibration", calibration},
          {"settings", settings},
          {"map_body", map_body},
          {"map_file", map_file},
          {"learned_cameras", learned_cameras},
          {"loops", loops},
          {"covariances", covariances},
          {"run_yaml", run_yaml},
          {"image_headers", image_headers}};
}

}  // namespace antipode::fuzz
