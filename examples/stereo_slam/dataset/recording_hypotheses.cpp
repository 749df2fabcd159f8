// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/recording_hypotheses.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/dataset/recording_checks.hpp"
#include "stereo_slam/dataset/rig_variants.hpp"
#include "stereo_slam/dataset/shifted_pairs.hpp"
#include "stereo_slam/dataset/stereo_agreement.hpp"

namespace stereo_slam {
namespace {

constexpr int kMostLate = 10;  // frames
constexpr double kGoodRows_px = 1.0;

/// How the images of one camera are flipped.
enum class Flip { kNone, kUpsideDown, kHalfTurn, kMirrored, kClockwise, kAnticlockwise };

/// A mistake that a user may have made. What it describes undoes the mistake.
struct Hypothesis {
  int late = 0;  ///< the right images are those of the frame `late` later
  bool swapped = false;
  Flip left = Flip::kNone;
  Flip right = Flip::kNone;
  std::shared_ptr<const Rectifier> rectifier{};  ///< null for images that are taken as they are
  std::string cause{};                           ///< what is wrong, and what to do
  Problem::Severity severity = Problem::Severity::kWarning;
};

/// A hypothesis and what it makes of the images.
struct Judged {
  Hypothesis hypothesis;
  StereoAgreement agreement;
};

cv::Mat flipped(const cv::Mat& image, Flip flip) {
  if (flip == Flip::kNone) return image;
  cv::Mat result;
  if (flip == Flip::kClockwise || flip == Flip::kAnticlockwise) {
    cv::rotate(image, result,
               flip == Flip::kClockwise ? cv::ROTATE_90_CLOCKWISE : cv::ROTATE_90_COUNTERCLOCKWISE);
  } else {
    cv::flip(image, result, flip == Flip::kUpsideDown ? 0 : flip == Flip::kMirrored ? 1 : -1);
  }
  return result;
}

/// How well the images agree if the mistake of a hypothesis is undone.
StereoAgreement agreement_under(const Hypothesis& hypothesis, const StereoSequence& sequence,
                                const std::vector<std::size_t>& indices) {
  std::vector<StereoFrame> frames;
  std::vector<Problem> ignored;  // unreadable images are reported elsewhere
  for (const std::size_t index : indices) {
    const auto right = static_cast<std::ptrdiff_t>(index) + hypothesis.late;
    if (right < 0 || (!sequence.live && right >= std::ssize(sequence.frames))) continue;
    attempt(ignored, Problem::Severity::kWarning, [&] {
      auto pair = load_raw_pair(sequence, index, static_cast<std::size_t>(right));
      if (hypothesis.swapped) std::swap(pair.left, pair.right);
      pair.left = flipped(pair.left, hypothesis.left);
      pair.right = flipped(pair.right, hypothesis.right);
      if (hypothesis.rectifier) {
        pair.left = hypothesis.rectifier->left(pair.left);
        pair.right = hypothesis.rectifier->right(pair.right);
      }
      if (pair.left.size() != pair.right.size()) return;  // not rectified, of cameras of different sizes
      frames.push_back({.index = index, .left = pair.left, .right = pair.right});
    });
  }
  return check_stereo_agreement(frames);
}

/// The hypothesis with another rig; nothing if that cannot be rectified.
void add_rig(std::vector<Hypothesis>& hypotheses, const StereoRig& rig, Hypothesis hypothesis) {
  std::vector<Problem> ignored;
  attempt(ignored, Problem::Severity::kWarning, [&] {
    hypothesis.rectifier = std::make_shared<const Rectifier>(rig);
    hypotheses.push_back(std::move(hypothesis));
  });
}

StereoRig with_pose(StereoRig rig, const Eigen::Isometry3d& T_right_left) {
  rig.T_right_left = T_right_left;
  return rig;
}

std::string swap_text(const StereoSequence& sequence) {
  const auto& [left, right] = std::pair(sequence.left_name, sequence.right_name);
  if (is_one_image(sequence)) {
    return fmt::format("the halves of {} look swapped; {}", left,
                       sequence.right_half_first ? "leave out --right-half-first" : "use --right-half-first");
  }
  return fmt::format(
      "{} and {} look swapped, each with the images of the other camera; {} must hold those of the left one",
      left, right, left);
}

Hypothesis late_by(int frames, const StereoSequence& sequence) {
  return {.late = frames, .rectifier = sequence.rectifier, .cause = text_of_delay(sequence, frames)};
}

/// One camera upside down, turned by 180 degrees or mirrored.
void add_flips(std::vector<Hypothesis>& hypotheses, const StereoSequence& sequence) {
  const auto add = [&](Flip left, Flip right, const std::string& name, std::string_view how) {
    hypotheses.push_back({.left = left,
                          .right = right,
                          .rectifier = sequence.rectifier,
                          .cause = fmt::format("the images of {} look {}", name, how),
                          .severity = Problem::Severity::kError});
  };
  for (const auto& [flip, how] :
       {std::pair(Flip::kHalfTurn, "turned by 180 degrees"),
        std::pair(Flip::kUpsideDown, "flipped upside down"), std::pair(Flip::kMirrored, "mirrored")}) {
    add(flip, Flip::kNone, is_one_image(sequence) ? "the left camera" : sequence.left_name, how);
    add(Flip::kNone, flip, is_one_image(sequence) ? "the right camera" : sequence.right_name, how);
  }
  add(Flip::kHalfTurn, Flip::kHalfTurn, "both cameras", "turned by 180 degrees");
  add(Flip::kMirrored, Flip::kMirrored, "both cameras", "mirrored");
  if (sequence.rectifier) return;  // which refuses cameras one above the other
  for (const auto& [flip, how] :
       {std::pair(Flip::kClockwise, "clockwise"), std::pair(Flip::kAnticlockwise, "anticlockwise")}) {
    add(flip, flip, "both cameras",
        fmt::format(
            "displaced in column, as of cameras one above the other; turn both {} by 90 degrees, with "
            "their calibration",
            how));
  }
}

/// Mistakes in the calibration of raw cameras that change the rows.
void add_rigs(std::vector<Hypothesis>& hypotheses, const StereoSequence& sequence) {
  const StereoRig& rig = *sequence.rig;
  Eigen::Isometry3d transposed = rig.T_right_left;
  transposed.linear().transposeInPlace();
  add_rig(
      hypotheses, with_pose(rig, transposed),
      {.cause = "the rotation between the cameras looks transposed; it must turn left to right coordinates"});
  StereoRig exchanged = rig;
  std::swap(exchanged.left, exchanged.right);
  add_rig(hypotheses, exchanged,
          {.cause = "the lenses of the two cameras look exchanged in the calibration; exchange their "
                    "intrinsics and distortion"});
  if (const auto order = likely_order(sequence))
    add_rig(hypotheses, with_order(rig, *order), {.cause = order_text(*order) + " in the calibration"});
  if (has_distortion(rig)) {
    add_rig(hypotheses, with_opposite_distortion(rig),
            {.cause = "the coefficients of the distortion look to have the wrong sign"});
    add_rig(hypotheses, with_other_lens_model(rig),
            {.cause = fmt::format("the coefficients of the distortion look like those of the model {}",
                                  rig.left.distortion == Distortion::kRadTan ? "equidistant" : "radtan")});
  }
  hypotheses.push_back({.cause = "the images look rectified already, but the calibration is of raw images; "
                                 "use that of the rectified images (rectified: in calibration.yaml)"});
}

/// The corners that match between the raw images of some frames.
std::vector<CornerPair> raw_pairs(const StereoSequence& sequence, const std::vector<std::size_t>& indices) {
  std::vector<CornerPair> pairs;
  std::vector<Problem> ignored;  // unreadable images are reported elsewhere
  for (const std::size_t index : indices) {
    attempt(ignored, Problem::Severity::kWarning, [&] {
      const auto pair = load_raw_pair(sequence, index, index);
      const auto found = match_corners(pair.left, pair.right);
      pairs.insert(pairs.end(), found.begin(), found.end());
    });
  }
  return pairs;
}

/// A calibration of raw cameras for images of another size, or with other focal lengths.
void add_scales(std::vector<Hypothesis>& hypotheses, const StereoSequence& sequence,
                const std::vector<std::size_t>& indices) {
  constexpr double kLeast = 0.03;
  constexpr double kLeastRows_px = 1.0;
  constexpr double kMostRest_px = 0.5;  // besides a displacement, lenses bend the rows a little
  const StereoRig& rig = *sequence.rig;
  const auto pairs = raw_pairs(sequence, indices);
  const double rows_px = row_displacement_px(rig, pairs);
  if (std::abs(rows_px) > kLeastRows_px && epipolar_distance_px(rig, pairs) < kMostRest_px) {
    add_rig(hypotheses, with_row_displacement(rig, rows_px),
            {.cause = fmt::format("the right images lie {:.1f} px {} than the calibration says, as if a "
                                  "camera was turned since, or its images cropped",
                                  std::abs(rows_px), rows_px > 0.0 ? "lower" : "higher")});
  }
  const auto is_other = [](double factor) { return std::abs(std::log(factor)) > kLeast; };
  const double size = size_factor(centre_of(sequence)).value_or(best_factor(rig, pairs, with_size_factor));
  if (is_other(size))
    add_rig(hypotheses, with_size_factor(rig, size), {.cause = other_size_text(centre_of(sequence), size)});
  if (!has_distortion(rig)) {
    add_rig(hypotheses, with_radial_distortion(rig, best_factor(rig, pairs, with_radial_distortion)),
            {.cause = "the images look distorted, but the calibration has no distortion"});
  }
  const double focal = best_factor(rig, pairs, with_focal_factor);
  if (!is_other(focal)) return;
  add_rig(hypotheses, with_focal_factor(rig, focal),
          {.cause =
               fmt::format("the focal lengths of the calibration look about {:.0f} % too {} for these images",
                           100.0 * std::abs(1.0 / focal - 1.0), focal < 1.0 ? "long" : "short")});
}

/// Mistakes in the calibration of raw cameras that place the right camera anywhere but on the right.
std::vector<Hypothesis> rejected_rigs(const StereoSequence& sequence) {
  constexpr double kLeastTurn_rad = 0.002;  // below it, the rotation does not matter
  constexpr auto kError = Problem::Severity::kError;
  const StereoRig& rig = *sequence.rig;
  const Eigen::Isometry3d T_left_right = rig.T_right_left.inverse();
  std::vector<Hypothesis> hypotheses;
  const StereoRig inverse = with_pose(rig, T_left_right);
  add_rig(
      hypotheses, inverse,
      {.cause = "the transformation between the cameras looks inverted; T_right_left must map coordinates of "
                "the left camera to those of the right one, and T_BS those of a camera to those of the body",
       .severity = kError});
  StereoRig exchanged = inverse;
  std::swap(exchanged.left, exchanged.right);
  add_rig(hypotheses, exchanged,
          {.swapped = true,
           .cause = fmt::format("{} and {} look swapped, with the calibration of each; exchange both",
                                sequence.left_name, sequence.right_name),
           .severity = kError});
  add_rig(hypotheses, exchanged,
          {.cause = "the calibrations of the two cameras look exchanged, each with that of the other one",
           .severity = kError});
  const auto turn_rad = [](const Eigen::Isometry3d& T) { return Eigen::AngleAxisd(T.linear()).angle(); };
  if (turn_rad(T_left_right) > kLeastTurn_rad) {
    Eigen::Isometry3d of_position = rig.T_right_left;
    of_position.translation() = -(of_position.linear() * of_position.translation());
    add_rig(hypotheses, with_pose(rig, of_position),
            {.cause = "the translation between the cameras looks like the position of the right camera; it "
                      "must be minus the rotation times this position",
             .severity = kError});
  }
  if (rig.T_body_left && turn_rad(*rig.T_body_left) > kLeastTurn_rad) {
    const Eigen::Isometry3d T_body_right = *rig.T_body_left * T_left_right;
    add_rig(hypotheses, with_pose(rig, T_body_right * rig.T_body_left->inverse()),
            {.cause = "T_BS of both cameras looks inverted; it must map coordinates of the camera to those "
                      "of the body",
             .severity = kError});
  }
  return hypotheses;
}

/// What may be wrong with a recording, apart from delays.
std::vector<Hypothesis> hypotheses_of(const StereoSequence& sequence, const std::vector<std::size_t>& indices,
                                      Suspicion suspicion) {
  std::vector<Hypothesis> hypotheses;
  if (sequence.rectifier || suspicion == Suspicion::kStrong) {
    hypotheses.push_back({.swapped = true,
                          .rectifier = sequence.rectifier,
                          .cause = swap_text(sequence),
                          .severity = Problem::Severity::kError});
  }
  if (sequence.rectifier && sequence.rig) {
    add_rigs(hypotheses, sequence);
    add_scales(hypotheses, sequence, indices);
  }
  if (suspicion == Suspicion::kStrong) add_flips(hypotheses, sequence);
  return hypotheses;
}

/// Whether a hypothesis makes a rectified stereo camera of the recording: positive disparities in rows that
/// agree, or agree much better than as recorded.
bool explains(const StereoAgreement& agreement, const StereoAgreement& recorded) {
  constexpr double kFewNegative = 0.2;
  if (!agreement.conclusive() || agreement.matches < recorded.matches / 2) return false;
  if (agreement.negative_share > kFewNegative || agreement.median_disparity_px <= 0.0) return false;
  const double good_px = kGoodRows_px * agreement.unit_px;
  if (!recorded.conclusive()) return agreement.row_offset_px < good_px;
  const bool turns_signs = recorded.negative_share > 1.0 - kFewNegative;
  return agreement.row_offset_px < 0.5 * recorded.row_offset_px ||
         (turns_signs && agreement.row_offset_px < good_px);
}

/// The delay of the right images with which they agree best, if they agree better than as recorded, and in
/// rows as good as those of rectified images: of twenty delays, chance makes one of them better. A slight one
/// is looked for step by step, as long as the rows become better.
std::optional<Judged> best_delay(const StereoSequence& sequence, const std::vector<std::size_t>& indices,
                                 const StereoAgreement& recorded, Suspicion suspicion) {
  std::optional<Judged> best;
  if (sequence.live) return best;  // has no earlier images
  for (const int direction : {1, -1}) {
    double last_px = recorded.row_offset_px;
    for (int count = 1; count <= kMostLate; ++count) {
      Judged judged{late_by(direction * count, sequence), {}};
      judged.agreement = agreement_under(judged.hypothesis, sequence, indices);
      const double rows_px = judged.agreement.row_offset_px;
      if (suspicion == Suspicion::kSlight && !(judged.agreement.conclusive() && rows_px < last_px)) break;
      last_px = rows_px;
      if (!explains(judged.agreement, recorded) || rows_px > kGoodRows_px * judged.agreement.unit_px)
        continue;
      if (!best || rows_px < best->agreement.row_offset_px) best = std::move(judged);
    }
  }
  return best;
}

/// The hypotheses that explain the images.
std::vector<Judged> explanations(std::vector<Hypothesis> hypotheses, const StereoSequence& sequence,
                                 const std::vector<std::size_t>& indices, const StereoAgreement& recorded) {
  std::vector<Judged> found;
  for (auto& hypothesis : hypotheses) {
    const auto agreement = agreement_under(hypothesis, sequence, indices);
    if (explains(agreement, recorded)) found.push_back({std::move(hypothesis), agreement});
  }
  return found;
}

/// The best explanation, and others that are about as good, as a problem.
std::optional<Problem> best_problem(const std::vector<Judged>& found, const std::string& folder,
                                    const std::string& recorded) {
  constexpr double kClearlyWorse = 1.5;
  constexpr double kNoise_px = 0.1;  // of the rows of a good recording
  if (found.empty()) return std::nullopt;
  const auto best = std::ranges::min_element(found, [](const Judged& a, const Judged& b) {
    return a.agreement.row_offset_px < b.agreement.row_offset_px;
  });
  const double best_px = best->agreement.row_offset_px;
  Problem problem{Problem::Severity::kError, folder + ":"};
  const char* separator = " ";
  for (const auto& [hypothesis, agreement] : found) {
    if (agreement.row_offset_px > kClearlyWorse * std::max(best_px, kNoise_px)) continue;
    problem.text += std::exchange(separator, "; or ") + hypothesis.cause;
    if (hypothesis.severity == Problem::Severity::kWarning) problem.severity = hypothesis.severity;
  }
  problem.text += fmt::format(" (the rows would then agree within {:.2f} px; {})", best_px, recorded);
  return problem;
}

/// Up to three frames that have others before and after them, for delays. The first ones of what is read in
/// order.
std::vector<std::size_t> compared_frames(const StereoSequence& sequence) {
  constexpr std::size_t kCompared = 3;
  if (sequence.live) return std::vector<std::size_t>(kCompared, 0);
  const std::size_t frames = sequence.frames.size();
  const std::size_t margin = std::min<std::size_t>(kMostLate, (frames - 1) / 3);
  const std::size_t there = frames - 2 * margin;
  std::vector<std::size_t> indices = spread(sequence.source ? std::min(kCompared, there) : there, kCompared);
  for (auto& index : indices) index += margin;
  return indices;
}

/// How well the images agree as they are.
std::string seen(const StereoAgreement& recorded) {
  if (!recorded.conclusive()) return fmt::format("now only {} features match", recorded.matches);
  return fmt::format("now within {:.2f} px, and {:.0f} % of the disparities are negative",
                     recorded.row_offset_px, 100.0 * recorded.negative_share);
}

}  // namespace

std::optional<Cause> cause_of_disagreement(const StereoSequence& sequence, Suspicion suspicion) {
  const auto indices = compared_frames(sequence);
  const auto recorded = agreement_under({.rectifier = sequence.rectifier}, sequence, indices);
  auto found = explanations(hypotheses_of(sequence, indices, suspicion), sequence, indices, recorded);
  bool may_be_part_of_a_frame = false;
  if (auto delay = best_delay(sequence, indices, recorded, suspicion)) {
    if (auto repeated = repeated_images(sequence)) return Cause{*std::move(repeated)};
    Hypothesis& hypothesis = delay->hypothesis;
    if (!sequence.pairs_as_told && are_shifted_pairs(sequence, indices, hypothesis.late)) {
      hypothesis.severity = Problem::Severity::kError;  // the lengths of such a run would be wrong
      hypothesis.cause += text_of_partners(sequence, indices.back(), hypothesis.late);
    } else {
      may_be_part_of_a_frame = found.empty();
    }
    found.insert(found.begin(), std::move(*delay));
  }
  auto problem = best_problem(found, sequence.folder.string(), seen(recorded));
  if (!problem) return std::nullopt;
  return Cause{*std::move(problem), may_be_part_of_a_frame};
}

std::optional<Problem> cause_of_rejected_rig(const StereoSequence& sequence) {
  if (!sequence.rig || sequence.rectifier || (sequence.frames.empty() && !sequence.live)) return std::nullopt;
  StereoSequence sized = sequence;  // loading checks the size
  sized.camera.width_px = sequence.rig->left.width_px;
  sized.camera.height_px = sequence.rig->left.height_px;
  auto found = explanations(rejected_rigs(sized), sized, compared_frames(sized), {});
  return best_problem(found, sequence.folder.string(), "the calibration as it is cannot be used");
}

}  // namespace stereo_slam
