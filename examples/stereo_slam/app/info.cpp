// SPDX-License-Identifier: MIT
#include "stereo_slam/app/info.hpp"

#include <algorithm>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/app/messages.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/images/image_file.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kPrintedProblems = 20;
constexpr std::size_t kSampled = 5;  // frames that are compared

/// What reading the images of a recording showed.
struct ImageCheck {
  std::vector<std::size_t> whole;   ///< frames without a fault
  std::vector<std::string> faults;  ///< of the images that cannot be read
  bool first_is_whole = true;       ///< the first frame has no fault
  std::size_t images = 0;

  void add_fault(std::size_t frame, std::string text) {
    faults.push_back(std::move(text));
    first_is_whole = first_is_whole && frame > 0;
  }

  /// Whether so few images cannot be read that `run` loses hardly anything.
  [[nodiscard]] bool faults_are_few() const {
    constexpr double kFewShare = 0.01;
    return first_is_whole && static_cast<double>(faults.size()) < kFewShare * static_cast<double>(images);
  }
};

/// Checks both files of every frame. Those of a video, a bag or a camera are taken as whole: finding faults
/// would mean decoding all images, which takes as long as a run.
ImageCheck check_images(SequenceScan& scan) {
  const auto& sequence = scan.sequence;
  constexpr std::size_t kLiveFrames = 5;
  const std::size_t frames = sequence.live ? kLiveFrames : sequence.frames.size();
  ImageCheck check;
  check.images = (sequence.side_by_side ? 1 : 2) * frames;
  bool colour = false;
  const auto is_good = [&](std::size_t frame, bool is_left) {
    const auto& file = is_left ? sequence.frames[frame].left : sequence.frames[frame].right;
    try {
      const ImageHeader header = check_image(file);
      colour = colour || header.colour;
      const cv::Size size(header.width_px, header.height_px);
      const cv::Size all = recorded_size(sequence, is_left);
      if (size == cv::Size((sequence.side_by_side ? 2 : 1) * all.width, all.height)) return true;
      check.add_fault(frame, wrong_size(file.string(), size, all).text);
    } catch (const std::runtime_error& error) {
      check.add_fault(frame, file_error_text(error));
    }
    return false;
  };
  for (std::size_t i = 0; i < frames; ++i) {
    bool good = sequence.source || is_good(i, true);
    if (!sequence.source && !sequence.side_by_side) good = is_good(i, false) && good;
    if (good) check.whole.push_back(i);
  }
  if (colour) {
    scan.warn(sequence.folder, "images are in colour; they are converted to grey");
  }
  return check;
}

/// Loads up to five whole frames, spread over the sequence, or the first ones of a video, bag or camera.
std::vector<StereoFrame> load_samples(const StereoSequence& sequence, ImageCheck& check) {
  std::vector<StereoFrame> frames;
  const std::size_t range = sequence.source ? std::min(kSampled, check.whole.size()) : check.whole.size();
  for (const std::size_t k : spread(range, kSampled)) {
    const std::size_t index = check.whole[k];
    try {
      frames.push_back(load_frame(sequence, index));
    } catch (const std::runtime_error& error) {
      check.add_fault(index, file_error_text(error));
    }
  }
  return frames;
}

/// Adds what cannot be read to the problems: as warnings, if it is so little that `run` loses hardly
/// anything.
void add_faults(const ImageCheck& check, SequenceScan& scan) {
  const auto severity = check.faults_are_few() ? Problem::Severity::kWarning : Problem::Severity::kError;
  for (const auto& fault : check.faults) scan.problems.push_back({severity, fault});
  if (check.faults.empty() || severity == Problem::Severity::kError) return;
  scan.warn(
      scan.sequence.folder,
      "{} of {} images cannot be read; `run` treats them as missing, and with --strict ends at the first",
      check.faults.size(), check.images);
}

/// Compares the images of the two cameras in a few frames, and adds the problems found to the scan. Nothing
/// is said about images of which some could not be read.
StereoAgreement check_agreement(SequenceScan& scan, const ImageCheck& check,
                                const std::vector<StereoFrame>& frames) {
  if (frames.empty()) return {};
  const StereoAgreement agreement = check_stereo_agreement(frames);
  if (!agreement.conclusive() && !check.faults.empty()) return agreement;
  for (auto& problem : problems_of(agreement, scan.sequence, frames))
    scan.problems.push_back(std::move(problem));
  return agreement;
}

void print_findings(std::ostream& stream, const StereoSequence& sequence) {
  const auto& camera = sequence.camera;
  const auto& frames = sequence.frames;
  fmt::print(stream, "folder        {}\nformat        {}\nframes        {}\n",
             as_message(sequence.folder.string()), sequence.format.empty() ? "unknown" : sequence.format,
             sequence.live ? "without end" : std::to_string(frames.size()));
  if (camera.width_px > 0)
    fmt::print(stream, "image size    {} x {} px{}\n", camera.width_px, camera.height_px,
               sequence.unscaled.empty()
                   ? ""
                   : fmt::format(", scaled from {} x {}", sequence.unscaled.width, sequence.unscaled.height));
  if (camera.fx > 0.0) {
    fmt::print(stream,
               "calibration   fx {:.6g}  fy {:.6g}  cx {:.6g}  cy {:.6g} px\nbaseline      {:.4f} m\n",
               camera.fx, camera.fy, camera.cx, camera.cy, camera.baseline_m);
  }
  if (sequence.rectifier) {
    fmt::print(
        stream, "rectified     from {} lenses turned by {:.2f} deg; {:.1f} % of the image is covered\n",
        sequence.lenses == "none" ? "undistorted" : sequence.lenses,
        180.0 / std::numbers::pi * Eigen::AngleAxisd(sequence.rectifier->T_left_camera().linear()).angle(),
        100.0 * sequence.rectifier->coverage());
  }
  if (frames.size() > 1 && frames.back().stamp_ns > frames.front().stamp_ns) {
    const double duration_s = 1e-9 * static_cast<double>(frames.back().stamp_ns - frames.front().stamp_ns);
    fmt::print(stream, "duration      {:.2f} s, {:.2f} frames per second\n", duration_s,
               static_cast<double>(frames.size() - 1) / duration_s);
  }
  if (const auto [median_ns, largest_ns] = sequence.pair_distances; largest_ns > 0) {
    fmt::print(stream, "pairs         up to {:.4g} ms apart, median {:.4g} ms\n",
               1e-6 * static_cast<double>(largest_ns), 1e-6 * static_cast<double>(median_ns));
  }
  if (sequence.ground_truth.empty()) {
    fmt::print(stream, "ground truth  none\n");
  } else {
    fmt::print(stream, "ground truth  {}, {:.1f} m\n", counted(sequence.ground_truth.size(), "pose"),
               distances_along(sequence.ground_truth).back());
  }
}

void print_problems(std::ostream& stream, const std::vector<Problem>& problems) {
  for (std::size_t i = 0; i < std::min(problems.size(), kPrintedProblems); ++i) {
    fmt::print(stream, "{:<12}  {}\n", is_error(problems[i]) ? "ERROR" : "warning",
               as_message(problems[i].text));
  }
  if (problems.size() > kPrintedProblems) {
    fmt::print(stream, "...           and {}\n", counted(problems.size() - kPrintedProblems, "more problem"));
  }
}

}  // namespace

Inspection inspect(SequenceScan scan) {
  Inspection inspection{.scan = std::move(scan), .agreement = {}, .images_read = 0};
  if (inspection.scan.sequence.camera.width_px == 0 || inspection.scan.too_large) return inspection;
  ImageCheck check = check_images(inspection.scan);
  const auto frames = load_samples(inspection.scan.sequence, check);
  add_faults(check, inspection.scan);
  inspection.agreement = check_agreement(inspection.scan, check, frames);
  if (inspection.scan.sequence.source) inspection.images_read = std::min(kSampled, check.whole.size());
  return inspection;
}

void write_ground_truth(std::ostream& stream, const StereoSequence& sequence, PoseFrame frame) {
  if (sequence.ground_truth.empty())
    fail(sequence.folder, "the recording has no ground truth; leave out --write-groundtruth");
  const Eigen::Isometry3d T_camera_frame =
      frame == PoseFrame::kBody ? require_body(sequence).inverse() : Eigen::Isometry3d::Identity();
  std::vector<Pose> poses;
  for (const auto& T_world_camera : sequence.ground_truth) {
    poses.push_back(to_pose(T_world_camera * T_camera_frame));
  }
  stream << kGroundTruthHeader << '\n';
  write_tum_trajectory(stream, sequence.ground_truth_ns, poses);
}

void print_inspection(std::ostream& stream, const Inspection& inspection) {
  const auto& [scan, agreement, images_read] = inspection;
  print_findings(stream, scan.sequence);
  if (agreement.conclusive()) {
    fmt::print(stream, "stereo check  {} matches, row offset {:.2f} px, disparity {:.1f} px (medians)\n",
               agreement.matches, agreement.row_offset_px, agreement.median_disparity_px);
  }
  constexpr int kRange_px = StereoMatchingSettings{}.max_disparity_px;  // of every preset
  if (agreement.conclusive() && agreement.near_disparity_px > kRange_px) {
    fmt::print(stream,
               "near points   10 % have disparities above {:.0f} px; `run` raises stereo.max_disparity_px "
               "from {} to {}, unless it is set\n",
               agreement.near_disparity_px, kRange_px,
               agreement.needed_range_px(scan.sequence.camera.width_px));
  }
  if (images_read > 0 && !scan.sequence.live) {
    fmt::print(
        stream,
        "images read   those of the first {} of {} frames; `run` reads all, and says what is damaged\n",
        images_read, scan.sequence.frames.size());
  }
  print_problems(stream, scan.problems);
  const auto errors = static_cast<std::size_t>(std::ranges::count_if(scan.problems, is_error));
  const std::size_t warnings = scan.problems.size() - errors;
  std::string verdict = "usable";
  if (errors > 0)
    verdict = fmt::format("not usable as a whole ({})", counted(errors, "error"));
  else if (!agreement.conclusive())
    verdict = fmt::format("unknown, as the two cameras could not be compared; see the {} above",
                          counted(warnings, "warning"));
  else if (warnings > 0)
    verdict = fmt::format("usable, but see the {} above", counted(warnings, "warning"));
  fmt::print(stream, "verdict       {}\n", verdict);
}

}  // namespace stereo_slam
