// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/kitti_raw.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/calibration/lens_values.hpp"
#include "stereo_slam/dataset/kitti_oxts.hpp"
#include "stereo_slam/dataset/kitti_projection.hpp"
#include "stereo_slam/dataset/stamp_pairs.hpp"
#include "stereo_slam/images/image_file.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// The lines "KEY: numbers" of a calibration file.
class KittiValues {
 public:
  explicit KittiValues(const fs::path& file) : file_(file) {
    for (const auto& line : read_text_lines(file)) {
      const auto colon = line.text.find(':');
      const auto numbers = colon == std::string::npos
                               ? std::nullopt
                               : parse_numbers(std::string_view(line.text).substr(colon + 1));
      if (numbers) values_[line.text.substr(0, colon)] = *numbers;
    }
  }

  [[nodiscard]] const fs::path& file() const { return file_; }

  /// So many finite numbers.
  [[nodiscard]] const std::vector<double>& get(const std::string& key, std::size_t count) const {
    const auto found = values_.find(key);
    if (found == values_.end()) fail(file_, "has no line '{}: ...' of numbers; copy it again", key);
    if (found->second.size() != count)
      fail(file_, "{} has {} and needs {}", key, counted(found->second.size(), "number"), count);
    return found->second;
  }

  /// The rotation and the translation of two keys.
  [[nodiscard]] Eigen::Isometry3d transform(const std::string& rotation,
                                            const std::string& translation) const {
    const RowMajor3 R = Eigen::Map<const RowMajor3>(get(rotation, 9).data());
    return pose_of(R, Eigen::Map<const Eigen::Vector3d>(get(translation, 3).data()), rotation);
  }

  /// The pose whose first three rows stand behind a key.
  [[nodiscard]] Eigen::Isometry3d pose(const std::string& key) const {
    const Eigen::Matrix<double, 3, 4> rows =
        Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(get(key, 12).data());
    return pose_of(rows.leftCols<3>(), rows.col(3), key);
  }

  [[nodiscard]] KittiProjection projection(const std::string& camera) const {
    KittiProjection projection{.name = "P_rect_" + camera, .P = {}};
    projection.P = Eigen::Map<const decltype(projection.P)>(get(projection.name, 12).data());
    return projection;
  }

 private:
  [[nodiscard]] Eigen::Isometry3d pose_of(const Eigen::Matrix3d& R, const Eigen::Vector3d& t,
                                          const std::string& key) const {
    constexpr double kMostSkew = 1e-3;  // the files have seven digits
    if (!R.isUnitary(kMostSkew) || R.determinant() < 0.0) fail(file_, "{} is no rotation", key);
    return Eigen::Translation3d(t) * Eigen::Quaterniond(R).normalized();
  }

  fs::path file_;
  std::map<std::string, std::vector<double>> values_;
};

/// The folder of the images in that of a camera of KITTI-360.
constexpr const char* kRectified = "data_rect";

/// A drive: its folder, and the numbers of its two cameras.
struct KittiDrive {
  fs::path folder;
  std::string left = "00";
  std::string right = "01";
  std::string images = "data";  ///< the folder in that of a camera

  [[nodiscard]] bool is_kitti_360() const { return images == kRectified; }
  [[nodiscard]] fs::path camera(const std::string& number) const { return folder / ("image_" + number); }
  [[nodiscard]] fs::path images_of(const std::string& number) const { return camera(number) / images; }
};

bool has_cameras(const fs::path& folder) {
  std::error_code unreadable;  // other readers say so
  return fs::is_directory(folder / "image_00/data", unreadable) ||
         fs::is_directory(folder / "image_02/data", unreadable) ||
         fs::is_directory(folder / "image_00" / kRectified, unreadable);
}

/// The drive in a folder: itself, or the only one in the folder of a day.
KittiDrive drive_in(const fs::path& folder) {
  KittiDrive drive{.folder = folder};
  if (!has_cameras(folder)) {
    std::vector<fs::path> drives;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.is_directory() && has_cameras(entry.path())) drives.push_back(entry.path());
    }
    std::ranges::sort(drives);
    if (drives.empty()) fail(folder, "contains no drive with image_00/data and image_01/data");
    if (drives.size() > 1) {
      fail(folder, "contains {} drives; name one of them, such as {}", drives.size(),
           drives.front().filename().string());
    }
    drive.folder = drives.front();
  }
  const auto has = [&](const char* camera) { return fs::is_directory(drive.camera(camera) / "data"); };
  if (!has("00") && fs::is_directory(drive.camera("00") / kRectified)) {
    drive.images = kRectified;
  } else if (has("02") && has("03") && !(has("00") && has("01"))) {
    drive.left = "02";
    drive.right = "03";
  }
  return drive;
}

/// A calibration file in the drive or beside it, of KITTI-360 also in `calibration` of the data set; nothing
/// if there is none.
std::optional<fs::path> calibration_of_drive(const KittiDrive& drive, const std::string& name) {
  const fs::path parent = fs::canonical(drive.folder).parent_path();
  for (const auto& folder : {drive.folder, parent, parent.parent_path() / "calibration"}) {
    if (fs::exists(folder / name)) return folder / name;
  }
  return std::nullopt;
}

/// The images of a camera that have a stamp.
struct KittiImages {
  std::vector<std::size_t> index;  ///< in the names
  std::vector<fs::path> files;
  std::vector<std::int64_t> stamps_ns;  ///< increase
};

/// The images in a folder by the numbers of their names.
std::map<std::size_t, fs::path> numbered_images(const fs::path& folder) {
  std::map<std::size_t, fs::path> images;
  if (!fs::is_directory(folder)) fail(folder, "no such folder; it holds 0000000000.png ...");
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().stem().string();
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), index);
    const bool numbered = error == std::errc{} && end == name.data() + name.size();
    if (numbered && entry.path().extension() == ".png") images[index] = entry.path();
  }
  if (images.empty()) fail(folder, "contains no images 0000000000.png, 0000000001.png ...");
  return images;
}

KittiImages read_images(const KittiDrive& drive, const std::string& number, SequenceScan& scan) {
  const fs::path camera = drive.camera(number);
  const auto stamps_ns = read_kitti_stamps(camera / "timestamps.txt");
  KittiImages images;
  std::size_t without_stamp = 0;
  for (const auto& [index, file] : numbered_images(drive.images_of(number))) {
    const auto stamp = stamps_ns.find(index);
    if (stamp == stamps_ns.end()) {
      ++without_stamp;
      continue;
    }
    if (!images.stamps_ns.empty() && stamp->second <= images.stamps_ns.back()) {
      fail_at(camera / "timestamps.txt", static_cast<int>(index) + 1,
              "the time is not later than that of the image before; copy the file again");
    }
    images.index.push_back(index);
    images.files.push_back(file);
    images.stamps_ns.push_back(stamp->second);
  }
  if (without_stamp > 0) {
    scan.warn(camera, "{} no line in timestamps.txt and {} left out",
              counted(without_stamp, "image has", "images have"), without_stamp == 1 ? "is" : "are");
  }
  return images;
}

/// Images of a sync drive with one number are a pair.
StampPairs paired_by_index(const KittiImages& left, const KittiImages& right, const fs::path& folder) {
  StampPairs result;
  for (std::size_t i = 0; i < left.index.size(); ++i) {
    const auto partner = std::ranges::lower_bound(right.index, left.index[i]);
    if (partner == right.index.end() || *partner != left.index[i]) continue;
    result.pairs.emplace_back(i, static_cast<std::size_t>(partner - right.index.begin()));
  }
  if (result.pairs.size() < 2)
    fail(folder, "contains {} of images with one number and times", counted(result.pairs.size(), "pair"));
  return result;
}

void warn_of_unpaired(const KittiImages& left, const KittiImages& right, SequenceScan& scan) {
  const std::size_t alone = left.index.size() + right.index.size() - 2 * scan.sequence.frames.size();
  if (alone == 0) return;
  scan.warn(scan.sequence.folder, "{} no partner in the other camera and {} left out",
            counted(alone, "image has", "images have"), alone == 1 ? "is" : "are");
}

void pair_images_of_drive(const KittiDrive& drive, const PairingOptions& pairing, SequenceScan& scan) {
  auto& sequence = scan.sequence;
  const KittiImages left = read_images(drive, drive.left, scan);
  const KittiImages right = read_images(drive, drive.right, scan);
  const StampPairs pairs = sequence.rectifier
                               ? paired_by_stamps({sequence.left_name, left.stamps_ns},
                                                  {sequence.right_name, right.stamps_ns}, pairing, scan)
                               : paired_by_index(left, right, sequence.folder);
  for (const auto& [i, j] : pairs.pairs)
    sequence.frames.push_back({left.stamps_ns[i], left.files[i], right.files[j]});
  warn_of_unpaired(left, right, scan);
}

/// The raw camera S, K, D, with a trailing number.
Lens lens_of(const KittiValues& values, const std::string& camera) {
  Lens lens;
  const auto refuse = [&](const std::string& what) { fail(values.file(), "camera {}: {}", camera, what); };
  set_size(lens, values.get("S_" + camera, 2), refuse);
  set_camera_matrix(lens, values.get("K_" + camera, 9), refuse);
  set_model(lens, "radtan", refuse);
  set_coefficients(lens, values.get("D_" + camera, 5), refuse);
  return lens;
}

/// The poses of the IMU by the numbers of the frames that have one; nothing if there is no such file.
std::optional<fs::path> poses_of_kitti_360(const KittiDrive& drive) {
  const fs::path folder = fs::canonical(drive.folder);
  const fs::path data_set = folder.parent_path().parent_path();
  for (const auto& parent : {folder, data_set / "data_poses" / folder.filename()}) {
    if (fs::exists(parent / "poses.txt")) return parent / "poses.txt";
  }
  return std::nullopt;
}

bool has_truth(const KittiDrive& drive) {
  return drive.is_kitti_360() ? poses_of_kitti_360(drive).has_value()
                              : fs::is_directory(drive.folder / "oxts");
}

/// T_camera0_imu, or why it is not known.
Eigen::Isometry3d read_T_camera_0_imu(const KittiDrive& drive) {
  if (drive.is_kitti_360()) {
    const auto file = calibration_of_drive(drive, "calib_cam_to_pose.txt");
    if (!file) {
      fail(
          *poses_of_kitti_360(drive),
          "there is no calib_cam_to_pose.txt in the folder 'calibration', so the poses of the camera are not "
          "known; the ground truth is left out");
    }
    return KittiValues(*file).pose("image_00").inverse();
  }
  Eigen::Isometry3d T_camera_0_imu = Eigen::Isometry3d::Identity();
  for (const auto* name : {"calib_velo_to_cam.txt", "calib_imu_to_velo.txt"}) {
    const auto file = calibration_of_drive(drive, name);
    if (!file) {
      fail(drive.folder / "oxts",
           "there is no {} in the drive or beside it, so the poses of the camera are not known; the ground "
           "truth is left out",
           name);
    }
    T_camera_0_imu = T_camera_0_imu * KittiValues(*file).transform("R", "T");
  }
  return T_camera_0_imu;
}

/// Which of the sizes in the calibration the images have.
bool are_rectified(const KittiValues& values, const KittiDrive& drive, const ImageHeader& header) {
  const auto has_size = [&](const std::string& key) {
    const auto& size = values.get(key + drive.left, 2);
    return size[0] == header.width_px && size[1] == header.height_px;
  };
  const bool rectified = has_size("S_rect_");
  if (rectified && drive.is_kitti_360()) return true;
  const bool raw = has_size("S_");
  if (rectified && raw) return drive.folder.filename().string().find("extract") == std::string::npos;
  if (rectified || raw) return rectified;
  fail(values.file(),
       "says neither S_{0} nor S_rect_{0}, of raw and of rectified images, is {1}x{2} pixels, as the images "
       "are; take the calibration of this day",
       drive.left, header.width_px, header.height_px);
}

/// Sets the camera, and the body if it is known.
void set_calibration(const KittiDrive& drive, const std::optional<Eigen::Isometry3d>& T_camera_0_imu,
                     StereoSequence& sequence) {
  const bool kitti_360 = drive.is_kitti_360();
  const auto file = calibration_of_drive(drive, kitti_360 ? "perspective.txt" : "calib_cam_to_cam.txt");
  if (!file) {
    fail(drive.folder,
         kitti_360
             ? "there is no perspective.txt in the drive, beside it or in 'calibration' of the data set, "
               "beside data_2d_raw; it is in the download of the calibrations"
             : "there is no calib_cam_to_cam.txt in the drive or beside it; it is in the download 'calib' "
               "of the day");
  }
  const KittiValues values(*file);
  const ImageHeader header = check_image(numbered_images(drive.images_of(drive.left)).begin()->second);
  if (are_rectified(values, drive, header)) {
    const KittiProjection left = values.projection(drive.left);
    sequence.camera = camera_of(left, values.projection(drive.right), *file);
    sequence.camera.width_px = header.width_px;
    sequence.camera.height_px = header.height_px;
    if (!T_camera_0_imu) return;
    const RowMajor3 R = Eigen::Map<const RowMajor3>(values.get("R_rect_00", 9).data());
    const Eigen::Isometry3d T_camera_rectified_0 = Eigen::Translation3d(left.position_of_camera_0_m()) *
                                                   Eigen::Quaterniond(Eigen::Matrix3d(R)).normalized();
    sequence.T_body_camera = (T_camera_rectified_0 * *T_camera_0_imu).inverse();
    return;
  }
  const Eigen::Isometry3d T_left_0 = values.transform("R_" + drive.left, "T_" + drive.left);
  const Eigen::Isometry3d T_right_0 = values.transform("R_" + drive.right, "T_" + drive.right);
  StereoRig rig{.left = lens_of(values, drive.left),
                .right = lens_of(values, drive.right),
                .T_right_left = T_right_0 * T_left_0.inverse(),
                .T_body_left = std::nullopt};
  if (T_camera_0_imu) rig.T_body_left = (T_left_0 * *T_camera_0_imu).inverse();
  set_rig(sequence, rig, *file);
}

/// The poses of the frames that have some, at the stamps of the left camera.
void read_truth_of_kitti_360(const KittiDrive& drive, StereoSequence& sequence) {
  const fs::path file = *poses_of_kitti_360(drive);
  const Trajectory truth = read_trajectory(file, TrajectoryFormat::kKitti);
  const auto stamps_of_frames_ns = read_kitti_stamps(drive.camera(drive.left) / "timestamps.txt");
  std::vector<std::int64_t> stamps_ns;
  std::vector<Eigen::Isometry3d> T_world_imu;
  for (std::size_t i = 0; i < truth.frames.size(); ++i) {
    const auto stamp = stamps_of_frames_ns.find(static_cast<std::size_t>(truth.frames[i]));
    if (stamp == stamps_of_frames_ns.end()) continue;
    stamps_ns.push_back(stamp->second);
    T_world_imu.push_back(truth.poses[i]);
  }
  set_ground_truth(sequence, stamps_ns, T_world_imu, file);
}

void read_truth_of_drive(const KittiDrive& drive, SequenceScan& scan) {
  auto& sequence = scan.sequence;
  if (drive.is_kitti_360()) return read_truth_of_kitti_360(drive, sequence);
  const OxtsPoses poses = read_oxts(drive.folder / "oxts");
  set_ground_truth(sequence, poses.stamps_ns, poses.T_world_imu, drive.folder / "oxts");
  if (poses.out_of_order == 0) return;
  scan.warn(drive.folder / "oxts/timestamps.txt",
            "{} packets are not later than those before them; they are left out of the ground truth",
            poses.out_of_order);
}

}  // namespace

bool looks_like_kitti_raw(const fs::path& folder) {
  if (has_cameras(folder) || fs::exists(folder / "calib_cam_to_cam.txt")) return true;
  // A day whose calibration is missing.
  std::error_code unreadable;
  const fs::directory_iterator entries(folder, unreadable);
  return std::any_of(begin(entries), end(entries),
                     [](const auto& entry) { return has_cameras(entry.path()); });
}

SequenceScan scan_kitti_raw(const fs::path& folder, const PairingOptions& pairing) {
  constexpr auto kError = Problem::Severity::kError;
  constexpr auto kWarning = Problem::Severity::kWarning;
  SequenceScan scan;
  auto& sequence = scan.sequence;
  sequence.folder = folder;
  sequence.format = "kitti";
  KittiDrive drive;
  attempt(scan.problems, kError, [&] { drive = drive_in(folder); });
  if (!scan.problems.empty()) return scan;
  sequence.left_name = "image_" + drive.left;
  sequence.right_name = "image_" + drive.right;
  std::optional<Eigen::Isometry3d> T_camera_0_imu;
  const bool truth = has_truth(drive);
  if (truth) attempt(scan.problems, kWarning, [&] { T_camera_0_imu = read_T_camera_0_imu(drive); });
  attempt(scan.problems, kError, [&] {
    set_calibration(drive, T_camera_0_imu, sequence);
    pair_images_of_drive(drive, pairing, scan);
    (void)check_image(sequence.frames.front().left);
  });
  if (truth && sequence.T_body_camera && !sequence.frames.empty())
    attempt(scan.problems, kWarning, [&] { read_truth_of_drive(drive, scan); });
  return scan;
}

}  // namespace stereo_slam
