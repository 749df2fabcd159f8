// SPDX-License-Identifier: MIT
#include "stereo_slam/app/info.hpp"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/app/messages.hpp"
#include "stereo_slam/dataset/image_file.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kPrintedProblems = 20;
constexpr std::size_t kSampled = 5;  // frames that are compared

/// Checks both files of every frame; returns the frames without a fault.
std::vector<std::size_t> check_images(SequenceScan& scan) {
  constexpr std::size_t kLiveFrames = 5;
  std::vector<std::size_t> whole;
  if (scan.sequence.source) {  // finding faults would mean decoding all images, which takes as long as a run
    whole.resize(scan.sequence.live ? kLiveFrames : scan.sequence.frames.size());
    std::iota(whole.begin(), whole.end(), std::size_t{0});
    return whole;
  }
  bool colour = false;
  for (std::size_t i = 0; i < scan.sequence.frames.size(); ++i) {
    const auto& files = scan.sequence.frames[i];
    bool good = true;
    for (const bool is_left : {true, false}) {
      const auto& file = is_left ? files.left : files.right;
      try {
        const ImageHeader header = check_image(file);
        colour = colour || header.colour;
        const cv::Size size(header.width_px, header.height_px);
        const cv::Size all = image_size(scan.sequence, is_left);
        if (size == cv::Size((scan.sequence.side_by_side ? 2 : 1) * all.width, all.height)) continue;
        scan.problems.push_back(wrong_size(file.string(), size, all));
      } catch (const std::runtime_error& error) {
        scan.problems.push_back({Problem::Severity::kError, error.what()});
      }
      good = false;
    }
    if (good) whole.push_back(i);
  }
  if (colour) {
    scan.problems.push_back(
        {Problem::Severity::kWarning,
         fmt::format("{}: images are in colour; they are converted to grey", scan.sequence.folder.string())});
  }
  return whole;
}

/// Checks up to five frames, spread over the sequence, or the first ones of a video, bag or camera. Adds the
/// problems found to the scan.
StereoAgreement check_agreement(SequenceScan& scan, const std::vector<std::size_t>& whole_frames) {
  std::vector<StereoFrame> frames;
  const std::size_t range =
      scan.sequence.source ? std::min(kSampled, whole_frames.size()) : whole_frames.size();
  const auto sampled = spread(range, kSampled);
  for (const std::size_t k : sampled) {
    attempt(scan.problems, Problem::Severity::kError,
            [&] { frames.push_back(load_frame(scan.sequence, whole_frames[k])); });
  }
  if (frames.empty()) return {};
  const StereoAgreement agreement = check_stereo_agreement(frames);
  // Nothing is said about images of which some could not be read.
  if (!agreement.conclusive() && frames.size() < sampled.size()) return agreement;
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
    fmt::print(stream, "image size    {} x {} px\n", camera.width_px, camera.height_px);
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
    fmt::print(stream, "ground truth  {} poses, {:.1f} m\n", sequence.ground_truth.size(),
               distances_along(sequence.ground_truth).back());
  }
}

void print_problems(std::ostream& stream, const std::vector<Problem>& problems) {
  for (std::size_t i = 0; i < std::min(problems.size(), kPrintedProblems); ++i) {
    fmt::print(stream, "{:<12}  {}\n", is_error(problems[i]) ? "ERROR" : "warning",
               as_message(problems[i].text));
  }
  if (problems.size() > kPrintedProblems) {
    fmt::print(stream, "...           and {} more problems\n", problems.size() - kPrintedProblems);
  }
}

}  // namespace

Inspection inspect(SequenceScan scan) {
  Inspection inspection{.scan = std::move(scan), .agreement = {}, .images_read = 0};
  if (inspection.scan.sequence.camera.width_px == 0) return inspection;
  const auto whole_frames = check_images(inspection.scan);
  inspection.agreement = check_agreement(inspection.scan, whole_frames);
  if (inspection.scan.sequence.source) inspection.images_read = std::min(kSampled, whole_frames.size());
  return inspection;
}

void write_ground_truth(std::ostream& stream, const StereoSequence& sequence, PoseFrame frame) {
  if (sequence.ground_truth.empty())
    throw std::runtime_error(fmt::format(
        "{}: the recording has no ground truth; leave out --write-groundtruth", sequence.folder.string()));
  const Eigen::Isometry3d T_camera_frame =
      frame == PoseFrame::kBody ? require_body(sequence).inverse() : Eigen::Isometry3d::Identity();
  std::vector<Pose> poses;
  for (const auto& T_world_camera : sequence.ground_truth) {
    const Eigen::Isometry3d T = T_world_camera * T_camera_frame;
    poses.push_back(
        Pose::from_matrix(Eigen::Quaterniond(T.linear()).normalized().toRotationMatrix(), T.translation()));
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
  if (images_read > 0 && !scan.sequence.live) {
    fmt::print(
        stream,
        "images read   those of the first {} of {} frames; `run` reads all, and says what is damaged\n",
        images_read, scan.sequence.frames.size());
  }
  print_problems(stream, scan.problems);
  const auto errors =
      static_cast<std::size_t>(std::count_if(scan.problems.begin(), scan.problems.end(), is_error));
  const std::size_t warnings = scan.problems.size() - errors;
  const auto count = [](std::size_t n, const char* what) {
    return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
  };
  std::string verdict = "usable";
  if (errors > 0)
    verdict = fmt::format("not usable as a whole ({})", count(errors, "error"));
  else if (!agreement.conclusive())
    verdict = fmt::format("unknown, as the two cameras could not be compared; see the {} above",
                          count(warnings, "warning"));
  else if (warnings > 0)
    verdict = fmt::format("usable, but see the {} above", count(warnings, "warning"));
  fmt::print(stream, "verdict       {}\n", verdict);
}

}  // namespace stereo_slam
