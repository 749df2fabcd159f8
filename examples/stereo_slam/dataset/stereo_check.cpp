// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/stereo_check.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/dataset/camera_from_motion.hpp"
#include "stereo_slam/dataset/recording_hypotheses.hpp"
#include "stereo_slam/dataset/right_delay.hpp"
#include "stereo_slam/dataset/shifted_pairs.hpp"
#include "stereo_slam/dataset/uniform_borders.hpp"
#include "stereo_slam/images/blended_images.hpp"
#include "stereo_slam/images/grey_image.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/stamps/stamp_units.hpp"

namespace stereo_slam {
namespace {

constexpr double kMaxNegativeShare = 0.8;
constexpr double kMaxRowOffset_px = 1.0;
constexpr std::size_t kGap = 3;  // frames: enough for a turn of some degrees, and most points stay in view

bool lacks_features(const StereoAgreement& agreement) {
  return std::min(agreement.left_features, agreement.right_features) < StereoAgreement::kFewFeatures;
}

/// The problem that hardly anything matches, and whether that is for want of features.
Problem too_few_matches(const StereoAgreement& agreement, const StereoSequence& sequence) {
  const auto& [left, right] = std::pair(sequence.left_name, sequence.right_name);
  const bool few_left = agreement.left_features < StereoAgreement::kFewFeatures;
  const bool few_right = agreement.right_features < StereoAgreement::kFewFeatures;
  const std::string cause =
      few_left || few_right
          ? fmt::format("the images of {} are dark, blank or blurred",
                        few_left && few_right ? fmt::format("{} and {}", left, right)
                        : few_left            ? left
                                              : right)
          : "the images of a pair do not seem to show the same scene; check their pairing and their folders";
  return Problem::warning(
      sequence.folder,
      "only {} features match between {} and {} in the sampled frames, of {} and {} found; {}",
      agreement.matches, left, right, agreement.left_features, agreement.right_features, cause);
}

/// Whether the images show anything for which a cause should be looked for. Good recordings have rows that
/// agree within 0.05 to 0.1 px.
std::optional<Suspicion> suspicion_of(const StereoAgreement& agreement) {
  constexpr double kSuspicious_px = 0.15;
  if (!agreement.conclusive())
    return lacks_features(agreement) ? std::nullopt : std::optional(Suspicion::kStrong);
  const double rows = agreement.row_offset_px / agreement.unit_px;
  if (rows > kMaxRowOffset_px || agreement.negative_share > kMaxNegativeShare) return Suspicion::kStrong;
  return rows > kSuspicious_px ? std::optional(Suspicion::kSlight) : std::nullopt;
}

/// Whether the points of the earlier frame of a pair are looked for in the later one, or the other way round.
enum class Direction { kForward, kBackward };

/// Points in up to six pairs of frames, `gap` apart, between which the camera may have turned. Those of a
/// source are its first ones, which are read in order.
std::vector<std::vector<MovedPoint>> sampled_motions(const StereoSequence& sequence, std::size_t gap,
                                                     Direction direction = Direction::kForward) {
  constexpr std::size_t kPairs = 6;
  if (sequence.live || sequence.frames.size() <= gap) return {};
  const std::size_t starts = sequence.frames.size() - gap;
  std::vector<std::vector<MovedPoint>> motions;
  std::vector<Problem> ignored;  // unreadable images are reported elsewhere
  StereoFrame second;
  for (const std::size_t i : spread(sequence.source ? std::min(starts, kPairs * gap) : starts, kPairs)) {
    attempt(ignored, Problem::Severity::kWarning, [&] {
      const StereoFrame first = second.index == i && !second.left.empty() ? second : load_frame(sequence, i);
      second = load_frame(sequence, i + gap);
      const bool forward = direction == Direction::kForward;
      motions.push_back(forward ? moved_points(first, second) : moved_points(second, first));
    });
  }
  return motions;
}

/// Right images that were taken later or earlier than the left ones, by less than a frame.
Problem late_right_images(const StereoSequence& sequence, const RightDelay& delay) {
  return Problem::warning(
      sequence.folder,
      "the images of {} look taken {:.2f} of the time between two frames {} than those of {}, so that "
      "lengths are uncertain by several percent; trigger both cameras at the same time, or correct their "
      "stamps",
      sequence.right_name, std::abs(delay.frames), delay.frames > 0.0 ? "later" : "earlier",
      sequence.left_name);
}

/// The delay that a run begins with, in frames. Points do not move evenly: over a part t of the time between
/// two frames a row changes by t (1 + t) / 2 times the motion to the next frame, and t (1 - t) / 2 times that
/// from the last one. How the two differ shows in the delays with either of them alone.
double delay_of_parabola(double by_next, double by_last) {
  const double ratio = by_next / by_last;  // of the motion from the last frame to that to the next one
  constexpr double kLeast = 0.2;           // is not the motion of a camera
  if (!(ratio > kLeast) || !(ratio < 1.0 / kLeast)) return by_next;
  const double linear = 0.5 * (1.0 + ratio), square = 0.5 * (1.0 - ratio);
  const double discriminant = linear * linear + 4.0 * square * by_next;
  return discriminant > 0.0 ? 2.0 * by_next / (linear + std::sqrt(discriminant)) : by_next;
}

/// The delay that a run begins with. A pause of the recording does not change it. Nothing if it is not
/// likely, or stamps do not tell the time between frames.
std::optional<DelayEstimate> delay_of_right_images(const StereoSequence& sequence, const RightDelay& delay) {
  constexpr double kSigma = 0.1;  // of a delay, relative: wrong points pull it to zero
  constexpr double kLeastSigma_frames = 0.01;
  if (!delay.is_possible()) return std::nullopt;
  const auto to_next = sampled_motions(sequence, 1, Direction::kForward);
  const auto next = right_delay(sequence.camera, to_next, 1);
  const auto last = right_delay(sequence.camera, sampled_motions(sequence, 1, Direction::kBackward), 1);
  const bool both = next && last && next->is_likely() && last->is_likely();
  const bool agree = both && (next->frames > 0.0) != (last->frames > 0.0);
  if (!delay.is_likely() && !agree) return std::nullopt;
  if (next && !all_pairs_share(*next, sequence.camera, to_next, 1)) return std::nullopt;
  double frames = delay.frames;
  if (next && last) frames = delay_of_parabola(next->frames, -last->frames);
  std::vector<std::int64_t> stamps_ns;
  for (const auto& frame : sequence.frames) stamps_ns.push_back(frame.stamp_ns);
  const double frame_s = 1e-9 * static_cast<double>(usual_interval_ns(std::move(stamps_ns)));
  if (!(frame_s > 0.0)) return std::nullopt;
  return DelayEstimate{.seconds = frames * frame_s,
                       .sigma_s = std::hypot(kLeastSigma_frames, kSigma * frames) * frame_s};
}

/// A focal length with which points do not move as they do. Motion without turns does not show it.
std::vector<Problem> wrong_focal_length(const StereoSequence& sequence,
                                        const std::vector<std::vector<MovedPoint>>& motions) {
  const auto& camera = sequence.camera;
  const auto moved = camera_from_motion(camera, motions);
  if (!moved || !moved->is_surprising()) return {};
  if (!moved->is_one_camera()) {
    return {Problem::warning(
        sequence.folder,
        "points move between frames as with no camera: their motions fit focal lengths that differ by "
        "{:.0f} % or more from frame to frame; a moving picture, the vehicle itself or traffic fills a part "
        "of the images, or images are repeated, and poses may be relative to it, with the status OK",
        100.0 * (std::exp(std::min(moved->spread, 1.0)) - 1.0))};
  }
  const double excess = 1.0 / moved->focal_factor - 1.0;
  return {Problem::warning(
      sequence.folder,
      "points move between frames as with a focal length of {:.0f} px, and the calibration gives {:.0f} "
      "px{}, so that lengths ahead are {:.0f} % too {}; check that the calibration was made for these "
      "images, with their size, and not for raw images if these are rectified",
      moved->focal_factor * camera.fx, camera.fx, sequence.rectifier ? " after rectification" : "",
      100.0 * std::abs(excess), excess > 0.0 ? "long" : "short")};
}

/// How many corners of a frame match in rows that agree, in images of at most so many pixels.
std::size_t agreeing_matches(const StereoFrame& frame, double most_pixels) {
  const ImageCorners left = find_corners(frame.left, most_pixels);
  const auto pairs = match_corners(left, find_corners(frame.right, most_pixels));
  const float most_px = 2.0F * left.unit_px;
  return static_cast<std::size_t>(std::ranges::count_if(
      pairs, [&](const CornerPair& pair) { return std::abs(pair.left_px.y - pair.right_px.y) < most_px; }));
}

/// Large images that match when they are reduced and not as they are, so that a run would not track them.
std::vector<Problem> unsharp_images(const StereoAgreement& agreement, const StereoSequence& sequence,
                                    const StereoFrame& frame) {
  constexpr std::size_t kFewer = 4;
  if (agreement.unit_px <= 1.0) return {};
  const std::size_t reduced = agreeing_matches(frame, kMostCornerPixels);
  const std::size_t whole = agreeing_matches(frame, static_cast<double>(frame.left.total()));
  if (kFewer * whole > reduced) return {};
  return {Problem::warning(sequence.folder,
                           "the images are not sharp at their size of {}x{} px: {} features match in a pair, "
                           "and {} if they are reduced; use --scale {:.2g}",
                           frame.left.cols, frame.left.rows, whole, reduced, 1.0 / agreement.unit_px)};
}

/// Rectified images that were padded to a size. Those that are rectified here have borders of their own.
std::vector<Problem> padded_images(const StereoSequence& sequence, const std::vector<StereoFrame>& frames) {
  if (sequence.rectifier) return {};
  const UniformBorders borders = uniform_borders(frames);
  const cv::Size size = frames.front().left.size();
  if (!borders.pad(size.width, size.height)) return {};
  return {Problem::warning(
      sequence.folder,
      "the images have borders of one grey value (left {}, right {}, top {}, bottom {} px), as if they were "
      "scaled to {}x{} px and padded; check that the calibration is of the padded images: if they were "
      "scaled, its focal lengths too, and the principal point moved by the borders",
      borders.left, borders.right, borders.top, borders.bottom, size.width - borders.left - borders.right,
      size.height - borders.top - borders.bottom)};
}

/// How much rectification magnifies raw images beyond what lenses do: they have barrel distortion, or hardly
/// any.
std::optional<double> excessive_magnification(const StereoSequence& sequence) {
  constexpr double kMost = 1.15;
  if (!sequence.rectifier || !sequence.rig) return std::nullopt;
  const double magnification = 2.0 * sequence.camera.fx / (sequence.rig->left.fx + sequence.rig->right.fx);
  return magnification > kMost ? std::optional(magnification) : std::nullopt;
}

Problem excessive_magnification_problem(const StereoSequence& sequence, double magnification) {
  return Problem::warning(
      sequence.folder,
      "rectification by this calibration magnifies the images by {:.0f} % (focal length {:.0f} px instead of "
      "{:.0f}), which lenses hardly need; check signs and order of the coefficients of the distortion",
      100.0 * (magnification - 1.0), sequence.camera.fx, sequence.camera.fx / magnification);
}

/// A scene without near points: landmarks are not used there, and a common error of all disparities, of which
/// no motion tells, is a large part of them.
std::vector<Problem> far_scene(const StereoAgreement& agreement, const StereoSequence& sequence) {
  constexpr double kCommonError_px = 0.03;  // as online rectification allows for with a good calibration
  const double most_baselines = MapSettings{}.max_baselines;
  const double least_px = sequence.camera.fx / most_baselines;
  if (!(agreement.near_disparity_px < least_px) || !(agreement.median_disparity_px > kCommonError_px))
    return {};
  return {Problem::warning(
      sequence.folder,
      "nine of ten points are farther than {:.0f} baselines ({:.3g} m), beyond which landmarks are not used "
      "(map.max_baselines): poses will come from frame to frame, as WEAK, and lengths are uncertain by about "
      "{:.0f} %; a larger distance between the cameras helps",
      most_baselines, most_baselines * sequence.camera.baseline_m,
      100.0 * kCommonError_px / agreement.median_disparity_px)};
}

/// Images of which every second row is another picture: interlaced video, or a mosaic of colours. Features
/// match in them, and lengths are wrong by some percent. Rectification and scaling hide it.
std::vector<Problem> alternating_rows(const StereoSequence& sequence,
                                      const std::vector<StereoFrame>& frames) {
  if (!sequence.unscaled.empty()) return {};
  std::size_t interlaced = 0, mosaics = 0;
  double rows = 0.0;
  std::vector<Problem> ignored;  // unreadable images are reported elsewhere
  for (const auto& frame : frames) {
    attempt(ignored, Problem::Severity::kWarning, [&] {
      const bool raw = sequence.rectifier && !sequence.live;
      const auto found =
          alternation_of(raw ? load_raw_pair(sequence, frame.index, frame.index).left : frame.left);
      interlaced += found.is_interlaced() ? 1 : 0;
      mosaics += found.is_mosaic() ? 1 : 0;
      rows = std::max(rows, found.rows);
    });
  }
  if (interlaced + mosaics == 0) return {};
  return {Problem::warning(
      sequence.folder,
      "in {} of {} compared images rows next to each other differ {:.1f} times as much as rows two apart, {}",
      interlaced + mosaics, frames.size(), rows,
      interlaced > mosaics
          ? "as in interlaced video, whose even and odd rows were taken one after the other, so that lengths "
            "may be wrong by some percent; record progressive images, or use one field of each: every second "
            "row, with fy and cy halved"
          : "and columns too, as in the raw mosaic of a colour camera; convert such images to grey "
            "(demosaicing)")};
}

/// Left images that are means of two moments, which frames and the ones after them show if points move.
std::vector<Problem> blended_images(const StereoSequence& sequence, const std::vector<StereoFrame>& frames) {
  if (sequence.live) return {};
  Echo echo;
  std::vector<Problem> ignored;  // unreadable images are reported elsewhere
  for (const auto& frame : frames) {
    const std::size_t next = frame.index + 1;
    if (next >= sequence.frames.size()) continue;
    attempt(ignored, Problem::Severity::kWarning, [&] {
      const auto loaded = std::ranges::find(frames, next, &StereoFrame::index);
      echo.add(frame.left, match_corners(frame.left, loaded == frames.end() ? load_frame(sequence, next).left
                                                                            : loaded->left));
    });
  }
  if (!echo.is_of_two_moments()) return {};
  return {Problem::warning(
      sequence.folder,
      "the images of {} show points twice, as far apart as they move between two frames, as if each image "
      "were a blend of two moments, so that lengths may be wrong by some percent; record without averaging "
      "frames (temporal noise reduction, conversion of the frame rate)",
      sequence.left_name)};
}

/// What the images show, without a cause.
std::vector<Problem> observed(const StereoAgreement& agreement, const StereoSequence& sequence) {
  const std::filesystem::path& folder = sequence.folder;
  std::vector<Problem> problems;
  // A point in front of the cameras has a positive disparity: it lies further left in the right image.
  if (agreement.negative_share > kMaxNegativeShare) {
    problems.push_back(Problem::warning(
        folder, "{:.0f} % of the disparities are negative, as if {} were not of the left camera",
        100.0 * agreement.negative_share, sequence.left_name));
  }
  const double most_px = kMaxRowOffset_px * agreement.unit_px;
  if (agreement.row_offset_px > most_px) {
    problems.push_back(Problem::warning(
        folder, "matched features lie {:.2f} px apart in row (median; at most {:.1f} is good); {}",
        agreement.row_offset_px, most_px,
        sequence.rectifier ? "the calibration does not fit these images"
                           : "the images are not rectified, or not of one moment"));
  }
  return problems;
}

RecordingFindings findings_if_late(const StereoSequence& sequence, const RightDelay& delay) {
  return {{late_right_images(sequence, delay)}, delay_of_right_images(sequence, delay)};
}

/// What is found if all sampled pairs clearly show one delay, by a part of the time between two frames.
std::optional<RecordingFindings> late_by_part_of_a_frame(const StereoSequence& sequence) {
  const auto motions = sampled_motions(sequence, kGap);
  const auto delay = right_delay(sequence.camera, motions, kGap);
  if (!delay || !delay->is_clear() || !delay->is_part_of_a_frame()) return std::nullopt;
  if (!all_pairs_share(*delay, sequence.camera, motions, kGap)) return std::nullopt;
  return findings_if_late(sequence, *delay);
}

/// What the agreement of both cameras shows, and the motion.
RecordingFindings findings_of_pairs(const StereoAgreement& agreement, const StereoSequence& sequence,
                                    const std::vector<StereoFrame>& frames) {
  constexpr double kLeastBeyondShare = 0.01;
  constexpr double kNoDisparity_px = 0.1;  // median; a drone's ground at 600 baselines has .75 px
  // Rectified by two maps, one image shows disparities. Single pairs may be equal, such as black ones. A live
  // camera has no earlier images.
  const bool twice = sequence.rectifier && !sequence.live && !frames.empty() &&
                     std::ranges::all_of(frames, [&](const StereoFrame& frame) {
                       return has_one_image_twice(sequence, frame.index);
                     });
  const bool flat =
      agreement.beyond_share < kLeastBeyondShare && std::abs(agreement.median_disparity_px) < kNoDisparity_px;
  if (agreement.conclusive() && (flat || twice)) {
    return {{{twice ? Problem::Severity::kError : Problem::Severity::kWarning,
              fmt::format("{}: {} and {} show the same image (no disparity), so the scale is unknown; check "
                          "that the images are of two cameras",
                          sequence.folder.string(), sequence.left_name, sequence.right_name)}}};
  }
  const auto magnification = excessive_magnification(sequence);
  auto suspicion = suspicion_of(agreement);
  if (magnification && !suspicion) suspicion = Suspicion::kSlight;
  if (suspicion && !frames.empty()) {
    if (const auto cause = cause_of_disagreement(sequence, *suspicion)) {
      if (cause->may_be_part_of_a_frame) {
        if (auto late = late_by_part_of_a_frame(sequence)) return *std::move(late);
      }
      return {{cause->problem}};
    }
  }
  if (magnification) return {{excessive_magnification_problem(sequence, *magnification)}};
  if (!agreement.conclusive()) return {{too_few_matches(agreement, sequence)}};
  auto problems = observed(agreement, sequence);
  if (frames.empty()) return {problems};
  const auto motions = sampled_motions(sequence, kGap);
  const auto delay = right_delay(sequence.camera, motions, kGap);
  if (delay && delay->is_likely()) {
    if (auto repeated = repeated_images(sequence)) return {{std::move(*repeated)}};
  }
  if (delay && delay->is_clear()) return findings_if_late(sequence, *delay);
  const bool nothing_observed = problems.empty();
  if (problems.empty()) problems = padded_images(sequence, frames);
  if (problems.empty()) problems = unsharp_images(agreement, sequence, frames.front());
  if (problems.empty()) problems = wrong_focal_length(sequence, motions);
  // Such a problem may move points as a delay does.
  const bool other_cause = nothing_observed && !problems.empty();
  if (problems.empty()) problems = far_scene(agreement, sequence);
  return {problems, delay && !other_cause ? delay_of_right_images(sequence, *delay) : std::nullopt};
}

}  // namespace

RecordingFindings findings_of(const StereoAgreement& agreement, const StereoSequence& sequence,
                              const std::vector<StereoFrame>& frames) {
  RecordingFindings findings = findings_of_pairs(agreement, sequence, frames);
  for (const auto& of_images : {blended_images(sequence, frames), alternating_rows(sequence, frames)})
    findings.problems.insert(findings.problems.begin(), of_images.begin(), of_images.end());
  return findings;
}

}  // namespace stereo_slam
