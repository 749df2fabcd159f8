// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/kitti.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include "stereo_slam/dataset/image_file.hpp"
#include "stereo_slam/dataset/times_file.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

using Projection = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

std::string frame_name(std::size_t index) { return fmt::format("{:06}.png", index); }

/// "P0: twelve numbers", row-major.
Projection read_projection(const fs::path& file, const std::vector<TextLine>& lines, std::string_view key) {
  const TextLine* first = nullptr;
  Projection projection;
  for (const auto& line : lines) {
    if (!line.text.starts_with(key)) continue;
    if (first != nullptr)
      throw std::runtime_error(at_line(file, line.number, fmt::format("{} is given twice", key)));
    first = &line;
    const auto fields = split_fields(std::string_view(line.text).substr(key.size()));
    const auto no_number = std::find_if_not(fields.begin(), fields.end(), parse_numbers);
    if (no_number != fields.end())
      throw std::runtime_error(at_line(file, line.number, fmt::format("'{}' is not a number", *no_number)));
    if (fields.size() != 12) {
      throw std::runtime_error(
          at_line(file, line.number,
                  fmt::format("{} needs 12 numbers after it, a 3x4 matrix, and has {}", key, fields.size())));
    }
    const auto numbers = parse_numbers(std::string_view(line.text).substr(key.size()));
    projection = Eigen::Map<const Projection>(numbers->data());
  }
  if (first != nullptr) return projection;
  fail(file, fmt::format("has no line '{} ...' with a 3x4 matrix; take the calib.txt of the sequence", key));
}

StereoCamera read_calib_txt(const fs::path& file) {
  if (!fs::exists(file)) fail(file, "missing; it holds the calibration as lines 'P0: ...' and 'P1: ...'");
  const auto lines = read_text_lines(file);
  const Projection P0 = read_projection(file, lines, "P0:");
  const Projection P1 = read_projection(file, lines, "P1:");
  const double fx = P0(0, 0);
  const double fy = P0(1, 1);
  if (!(fx > 0.0 && fy > 0.0))
    fail(file, fmt::format("P0 has focal lengths {} and {}; both must be positive", fx, fy));

  const double tolerance_px = 1e-6 * fx;
  Projection pinhole = Projection::Zero();
  pinhole << fx, 0.0, P0(0, 2), P0(0, 3), 0.0, fy, P0(1, 2), 0.0, 0.0, 0.0, 1.0, 0.0;
  if (!P0.isApprox(pinhole, 1e-6))
    fail(file, "P0 is not [fx 0 cx 0; 0 fy cy 0; 0 0 1 0]; rectified images are needed");
  if ((P1.leftCols<3>() - P0.leftCols<3>()).cwiseAbs().maxCoeff() > tolerance_px) {
    fail(file,
         "P0 and P1 have different intrinsics; rectified images with one common camera matrix are needed");
  }
  const Eigen::Vector3d shift = P1.col(3) - P0.col(3);  // px m, px m, m
  const double baseline_m = -shift.x() / fx;
  if (std::abs(baseline_m) < 1e-6) {
    fail(file, "P1 gives a baseline of zero; its fourth number must be -fx times the baseline in metres");
  }
  if (baseline_m < 0.0) {
    fail(file,
         fmt::format(
             "P1 gives a baseline of {:.6g} m, the right camera left of the left one; P0 and P1 or the two "
             "cameras are swapped, or the fourth number of P1 lost its minus sign",
             baseline_m));
  }
  constexpr double kMostAcross = 0.01;  // of the baseline
  if (std::max(std::abs(shift.y()) / fy, std::abs(shift.z())) > kMostAcross * baseline_m) {
    fail(file,
         fmt::format("P1 has the fourth column ({:.6g}, {:.6g}, {:.6g}), but its second and third numbers "
                     "must be 0: rectified cameras lie side by side; take the calib.txt of the sequence",
                     P1(0, 3), P1(1, 3), P1(2, 3)));
  }
  return {.fx = fx, .fy = fy, .cx = P0(0, 2), .cy = P0(1, 2), .baseline_m = baseline_m};
}

std::vector<std::int64_t> read_stamps(const fs::path& file) {
  if (!fs::exists(file)) fail(file, "missing; it holds one time in seconds a frame");
  return read_times(file);
}

/// Number of frames by the image names of one folder: the highest frame index plus one.
std::size_t count_images(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    const bool colour_only = fs::is_directory(folder.parent_path() / "image_2");
    fail(folder, colour_only
                     ? "no such folder; image_2 and image_3 are the colour cameras, the grey ones are needed"
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
    fail(folder, other_name.empty()
                     ? "is empty; it must contain the images 000000.png, 000001.png ..."
                     : fmt::format("contains no 000000.png but files such as {}; rename or convert them to "
                                   "000000.png, 000001.png ...",
                                   other_name));
  }
  // A few missing images end the run when it reaches them; many mean another numbering.
  if (count > 2 * files + 1000) {
    fail(folder,
         fmt::format(
             "holds {} images, but one is called {}; they must be numbered from 000000.png without gaps",
             files, frame_name(count - 1)));
  }
  return count;
}

void read_first_image(StereoSequence& sequence) {
  const auto& file = sequence.frames.front().left;
  const ImageHeader header = check_png(file);
  auto& camera = sequence.camera;
  camera.width_px = header.width_px;
  camera.height_px = header.height_px;
  if (camera.fx > 0.0 &&
      !(camera.cx > 0.0 && camera.cx < camera.width_px && camera.cy > 0.0 && camera.cy < camera.height_px)) {
    fail(sequence.folder / "calib.txt", fmt::format("the principal point ({:.6g}, {:.6g}) lies outside the "
                                                    "{}x{} images; the calibration is of another "
                                                    "camera or image size",
                                                    camera.cx, camera.cy, camera.width_px, camera.height_px));
  }
}

void read_ground_truth(StereoSequence& sequence) {
  const fs::path file = sequence.folder / "poses.txt";
  if (!fs::exists(file)) return;
  auto poses = read_trajectory(file, TrajectoryFormat::kKitti).poses;
  if (poses.size() != sequence.frames.size()) {
    fail(file, fmt::format("has {} poses for {} frames; the ground truth is left out", poses.size(),
                           sequence.frames.size()));
  }
  sequence.ground_truth = std::move(poses);
  for (const auto& frame : sequence.frames) sequence.ground_truth_ns.push_back(frame.stamp_ns);
}

}  // namespace

bool looks_like_kitti(const fs::path& folder) {
  for (const auto* part : {"calib.txt", "times.txt", "image_0", "image_1", "image_2"}) {
    if (fs::exists(folder / part)) return true;
  }
  return false;
}

SequenceScan scan_kitti(const fs::path& folder) {
  SequenceScan scan;
  StereoSequence& sequence = scan.sequence;
  auto& problems = scan.problems;
  sequence.folder = folder;
  sequence.format = "kitti";
  sequence.left_name = "image_0";
  sequence.right_name = "image_1";
  constexpr auto kError = Problem::Severity::kError;
  constexpr auto kWarning = Problem::Severity::kWarning;

  std::optional<std::vector<std::int64_t>> stamps_ns;
  std::size_t images = 0;
  attempt(problems, kError, [&] { sequence.camera = read_calib_txt(folder / "calib.txt"); });
  attempt(problems, kError, [&] { stamps_ns = read_stamps(folder / "times.txt"); });
  for (const auto* name : {"image_0", "image_1"}) {
    attempt(problems, kError, [&] { images = std::max(images, count_images(folder / name)); });
  }
  if (images == 0) return scan;

  attempt(problems, kError, [&] {
    if (images < 2) fail(folder, "contains a single frame; a sequence needs at least two");
    if (stamps_ns && stamps_ns->size() != images) {
      fail(folder / "times.txt",
           fmt::format("has {} times for {} images (the last is {}); there must be one for each",
                       stamps_ns->size(), images, frame_name(images - 1)));
    }
  });
  for (std::size_t i = 0; i < images; ++i) {
    const std::int64_t stamp_ns = stamps_ns && i < stamps_ns->size() ? (*stamps_ns)[i] : 0;
    sequence.frames.push_back(
        {stamp_ns, folder / "image_0" / frame_name(i), folder / "image_1" / frame_name(i)});
  }
  attempt(problems, kError, [&] { read_first_image(sequence); });
  attempt(problems, kWarning, [&] { read_ground_truth(sequence); });
  return scan;
}

}  // namespace stereo_slam
