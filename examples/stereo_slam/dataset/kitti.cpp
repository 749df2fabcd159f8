// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/kitti.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

#include <fmt/format.h>

#include "stereo_slam/dataset/kitti_projection.hpp"
#include "stereo_slam/dataset/kitti_raw.hpp"
#include "stereo_slam/images/image_file.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/stamps/times_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// The two cameras of a sequence: the grey ones, or the colour ones where only they are complete.
struct KittiCameras {
  int left = 0;
  int right = 1;

  [[nodiscard]] static std::string folder(int camera) { return fmt::format("image_{}", camera); }
  [[nodiscard]] std::string left_folder() const { return folder(left); }
  [[nodiscard]] std::string right_folder() const { return folder(right); }
};

KittiCameras cameras_in(const fs::path& sequence) {
  const auto has = [&](int camera) { return fs::is_directory(sequence / KittiCameras::folder(camera)); };
  const bool colour_only = has(2) && has(3) && !(has(0) && has(1));
  return colour_only ? KittiCameras{.left = 2, .right = 3} : KittiCameras{};
}

std::string frame_name(std::size_t index) { return fmt::format("{:06}.png", index); }

/// "P0: twelve numbers", row-major.
KittiProjection read_projection(const fs::path& file, const std::vector<TextLine>& lines, int camera) {
  const std::string key = fmt::format("P{}:", camera);
  const TextLine* first = nullptr;
  KittiProjection projection{.name = fmt::format("P{}", camera), .P = {}};
  for (const auto& line : lines) {
    if (!line.text.starts_with(key)) continue;
    if (first != nullptr) fail_at(file, line.number, "{} is given twice", key);
    first = &line;
    const auto fields = split_fields(std::string_view(line.text).substr(key.size()));
    const auto no_number = std::find_if_not(fields.begin(), fields.end(), parse_numbers);
    if (no_number != fields.end()) fail_at(file, line.number, "'{}' is not a number", *no_number);
    if (fields.size() != 12) {
      fail_at(file, line.number, "{} needs 12 numbers after it, a 3x4 matrix, and has {}", key,
              fields.size());
    }
    const auto numbers = parse_numbers(std::string_view(line.text).substr(key.size()));
    projection.P = Eigen::Map<const decltype(projection.P)>(numbers->data());
  }
  if (first != nullptr) return projection;
  fail(file, "has no line '{} ...' with a 3x4 matrix; take the calib.txt of the sequence", key);
}

/// The rectified cameras, and where the left one is in the frame of camera 0.
struct KittiCalibration {
  StereoCamera camera;
  Eigen::Isometry3d T_camera_0_left = Eigen::Isometry3d::Identity();
};

KittiCalibration read_calib_txt(const fs::path& file, const KittiCameras& cameras) {
  if (!fs::exists(file)) fail(file, "missing; it holds the calibration as lines 'P0: ...' and 'P1: ...'");
  const auto lines = read_text_lines(file);
  const auto left = read_projection(file, lines, cameras.left);
  const auto right = read_projection(file, lines, cameras.right);
  KittiCalibration calibration{.camera = camera_of(left, right, file)};
  calibration.T_camera_0_left.translation() = -left.position_of_camera_0_m();
  return calibration;
}

FileTimes read_stamps(const fs::path& file) {
  if (!fs::exists(file)) fail(file, "missing; it holds one time in seconds a frame");
  return read_times(file);
}

/// Number of frames by the image names of one folder: the highest frame index plus one.
std::size_t count_images(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    const bool half_colour = fs::is_directory(folder.parent_path() / "image_2");
    fail(folder,
         half_colour
             ? "no such folder; image_2 and image_3 are the colour cameras, which are used if both are there"
             : "no such folder; it holds the images 000000.png, 000001.png ...");
  }
  constexpr std::size_t kMostFrames = 10'000'000;
  std::size_t count = 0, files = 0;
  std::string other_name;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    std::size_t index = 0;
    std::from_chars(name.data(), name.data() + name.size(), index);
    if (index < kMostFrames && name == frame_name(index)) {
      count = std::max(count, index + 1);
      ++files;
    } else {
      other_name = name;
    }
  }
  if (count == 0) {
    fail(folder, other_name.empty() ? "is empty; it must contain the images 000000.png, 000001.png ..."
                                    : fmt::format("contains no 000000.png but files such as {}; rename or "
                                                  "convert them to 000000.png, 000001.png ...",
                                                  other_name));
  }
  // A few missing images end the run when it reaches them; many mean another numbering.
  if (count > 2 * files + 1000) {
    fail(folder, "holds {}, but one is called {}; they must be numbered from 000000.png without gaps",
         counted(files, "image"), frame_name(count - 1));
  }
  return count;
}

void read_first_image(StereoSequence& sequence) {
  const auto& file = sequence.frames.front().left;
  const ImageHeader header = check_image(file);
  auto& camera = sequence.camera;
  camera.width_px = header.width_px;
  camera.height_px = header.height_px;
  if (camera.fx > 0.0 &&
      !(camera.cx > 0.0 && camera.cx < camera.width_px && camera.cy > 0.0 && camera.cy < camera.height_px)) {
    fail(sequence.folder / "calib.txt",
         "the principal point ({:.6g}, {:.6g}) lies outside the {}x{} images; the calibration is of another "
         "camera or image size",
         camera.cx, camera.cy, camera.width_px, camera.height_px);
  }
}

void read_ground_truth(StereoSequence& sequence, const Eigen::Isometry3d& T_camera_0_left) {
  const fs::path file = sequence.folder / "poses.txt";
  if (!fs::exists(file)) return;
  auto poses = read_trajectory(file, TrajectoryFormat::kKitti).poses;
  if (poses.size() != sequence.frames.size()) {
    fail(file, "has {} for {}; the ground truth is left out", counted(poses.size(), "pose"),
         counted(sequence.frames.size(), "frame"));
  }
  const bool is_camera_0 = T_camera_0_left.translation().isZero(0.0);
  for (auto& T_world_camera_0 : poses)
    sequence.ground_truth.push_back(is_camera_0 ? T_world_camera_0 : T_world_camera_0 * T_camera_0_left);
  for (const auto& frame : sequence.frames) sequence.ground_truth_ns.push_back(frame.stamp_ns);
}

}  // namespace

bool looks_like_kitti(const fs::path& folder) {
  if (looks_like_kitti_raw(folder)) return true;
  for (const auto* part : {"image_0", "image_1", "image_2"}) {
    if (fs::exists(folder / part)) return true;
  }
  // Other recordings have files of these names, too.
  const bool own_camera = fs::exists(folder / "left") || fs::exists(folder / "right");
  return !own_camera && fs::exists(folder / "calib.txt");
}

SequenceScan scan_kitti(const fs::path& folder, const PairingOptions& pairing) {
  if (looks_like_kitti_raw(folder)) return scan_kitti_raw(folder, pairing);
  SequenceScan scan;
  StereoSequence& sequence = scan.sequence;
  auto& problems = scan.problems;
  sequence.folder = folder;
  sequence.format = "kitti";
  const KittiCameras cameras = cameras_in(folder);
  sequence.left_name = cameras.left_folder();
  sequence.right_name = cameras.right_folder();
  constexpr auto kError = Problem::Severity::kError;
  constexpr auto kWarning = Problem::Severity::kWarning;

  std::optional<std::vector<std::int64_t>> stamps_ns;
  std::size_t images = 0;
  KittiCalibration calibration;
  attempt(problems, kError, [&] { calibration = read_calib_txt(folder / "calib.txt", cameras); });
  sequence.camera = calibration.camera;
  attempt(problems, kError, [&] {
    FileTimes times = read_stamps(folder / "times.txt");
    stamps_ns = std::move(times.stamps_ns);
    if (!times.warning.empty()) problems.push_back({kWarning, std::move(times.warning)});
  });
  for (const auto& name : {sequence.left_name, sequence.right_name}) {
    attempt(problems, kError, [&] { images = std::max(images, count_images(folder / name)); });
  }
  if (images == 0) return scan;

  attempt(problems, kError, [&] {
    if (images < 2) fail(folder, "contains a single frame; a sequence needs at least two");
    if (stamps_ns && stamps_ns->size() != images) {
      fail(folder / "times.txt", "has {} for {} images (the last is {}); there must be one for each",
           counted(stamps_ns->size(), "time"), images, frame_name(images - 1));
    }
  });
  for (std::size_t i = 0; i < images; ++i) {
    const std::int64_t stamp_ns = stamps_ns && i < stamps_ns->size() ? (*stamps_ns)[i] : 0;
    sequence.frames.push_back({stamp_ns, folder / sequence.left_name / frame_name(i),
                               folder / sequence.right_name / frame_name(i)});
  }
  attempt(problems, kError, [&] { read_first_image(sequence); });
  attempt(problems, kWarning, [&] { read_ground_truth(sequence, calibration.T_camera_0_left); });
  return scan;
}

}  // namespace stereo_slam
