// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/stereo_check.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "stereo_slam/core/corner_pairs.hpp"

namespace stereo_slam {
namespace {

struct Offset {
  double disparity_px;
  double rows_px;
};

template <class Value>
double median(const std::vector<Offset>& offsets, const Value& value) {
  std::vector<double> values(offsets.size());
  std::transform(offsets.begin(), offsets.end(), values.begin(), value);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// One way to pair the images of the two cameras.
struct Pairing {
  int step = 0;  ///< the right images are those of the frame `step` later
  bool swapped = false;
};

/// How well the images agree when they are paired in another way.
StereoAgreement agreement_of(const StereoSequence& sequence, const std::vector<StereoFrame>& frames,
                             const Pairing& pairing) {
  std::vector<StereoFrame> chosen;
  std::vector<Problem> ignored;  // unreadable images are reported elsewhere
  for (const auto& frame : frames) {
    if (pairing.step < 0 && frame.index == 0) continue;
    const std::size_t right =
        pairing.step < 0 ? frame.index - 1 : frame.index + static_cast<std::size_t>(pairing.step);
    if (right >= sequence.frames.size()) continue;
    attempt(ignored, Problem::Severity::kWarning, [&] {
      chosen.push_back(load_pair(sequence, {frame.index, right, pairing.swapped}));
    });
  }
  return check_stereo_agreement(chosen);
}

/// The best other pairing, if the images agree much better in it than in the pairing of the recording.
std::optional<Pairing> better_pairing(const StereoAgreement& agreement, const StereoSequence& sequence,
                                      const std::vector<StereoFrame>& frames) {
  std::vector<Pairing> pairings = {{.step = 1}, {.step = -1}};
  if (sequence.rectifier) pairings.push_back({.swapped = true});
  std::optional<Pairing> best;
  double least_px = 0.5 * agreement.row_offset_px;
  for (const auto& pairing : pairings) {
    const auto other = agreement_of(sequence, frames, pairing);
    if (other.matches < agreement.matches / 2 || !other.conclusive()) continue;
    if (other.row_offset_px >= least_px || other.median_disparity_px <= 0.0) continue;
    best = pairing;
    least_px = other.row_offset_px;
  }
  return best;
}

/// A problem if the images agree much better in another pairing than in that of the recording.
std::optional<Problem> wrong_pairing(const StereoAgreement& agreement, const StereoSequence& sequence,
                                     const std::vector<StereoFrame>& frames) {
  constexpr double kSuspicious_px = 0.15;  // good recordings have 0.05 to 0.1 px
  if (frames.empty() || agreement.row_offset_px < kSuspicious_px) return std::nullopt;
  const auto better = better_pairing(agreement, sequence, frames);
  if (!better) return std::nullopt;
  const std::string folder = sequence.folder.string();
  if (better->swapped) {
    return Problem{
        Problem::Severity::kError,
        fmt::format("{}: {} and {} look swapped, each with the images of the other camera; {} must hold "
                    "those of the left one",
                    folder, sequence.left_name, sequence.right_name, sequence.left_name)};
  }
  return Problem{
      Problem::Severity::kWarning,
      fmt::format("{}: the images of {} look one frame {}; those of a pair must have been taken together",
                  folder, sequence.right_name, better->step > 0 ? "late" : "early")};
}

}  // namespace

std::vector<std::size_t> spread(std::size_t frames, std::size_t count) {
  std::vector<std::size_t> indices;
  for (std::size_t k = 0; k < std::min(count, frames); ++k)
    indices.push_back(k * frames / std::min(count, frames));
  return indices;
}

StereoAgreement check_stereo_agreement(const std::vector<StereoFrame>& frames) {
  std::vector<Offset> offsets;
  for (const auto& frame : frames) {
    for (const auto& [left_px, right_px] : match_corners(frame.left, frame.right)) {
      const cv::Point2f difference = left_px - right_px;
      offsets.push_back({static_cast<double>(difference.x), static_cast<double>(difference.y)});
    }
  }
  if (offsets.empty()) return {};
  const auto beyond =
      std::count_if(offsets.begin(), offsets.end(), [](auto& o) { return std::abs(o.disparity_px) > 1.0; });
  const auto negative =
      std::count_if(offsets.begin(), offsets.end(), [](auto& o) { return o.disparity_px < -1.0; });
  return {.matches = offsets.size(),
          .row_offset_px = median(offsets, [](auto& o) { return std::abs(o.rows_px); }),
          .median_disparity_px = median(offsets, [](auto& o) { return o.disparity_px; }),
          .beyond_share = static_cast<double>(beyond) / static_cast<double>(offsets.size()),
          .negative_share = beyond == 0 ? 0.0 : static_cast<double>(negative) / static_cast<double>(beyond)};
}

std::vector<Problem> problems_of(const StereoAgreement& agreement, const StereoSequence& sequence,
                                 const std::vector<StereoFrame>& frames) {
  // A point in front of the cameras has a positive disparity: it lies further left in the right image.
  constexpr double kMaxNegativeShare = 0.8;
  constexpr double kMaxRowOffset_px = 1.0;
  constexpr double kLeastBeyondShare = 0.01;
  if (!agreement.conclusive()) {
    return {{Problem::Severity::kWarning, fmt::format("{}: only {} features match between {} and {} in the "
                                                      "sampled frames; the images are dark, blank or "
                                                      "blurred, or do not show the same scene",
                                                      sequence.folder.string(), agreement.matches,
                                                      sequence.left_name, sequence.right_name)}};
  }
  // Rectified by two maps, one image shows disparities. Single pairs may be equal, such as black ones. A live
  // camera has no earlier images.
  const bool twice = sequence.rectifier && !sequence.live && !frames.empty() &&
                     std::all_of(frames.begin(), frames.end(), [&](const StereoFrame& frame) {
                       return has_one_image_twice(sequence, frame.index);
                     });
  if (agreement.beyond_share < kLeastBeyondShare || twice) {
    return {{twice ? Problem::Severity::kError : Problem::Severity::kWarning,
             fmt::format("{}: {} and {} show the same image (no disparity), so the scale is unknown; check "
                         "that the images are of two cameras",
                         sequence.folder.string(), sequence.left_name, sequence.right_name)}};
  }
  // Before the test for swapped cameras: in fast motion, a right image of another frame gives negative
  // disparities, too.
  if (const auto problem = wrong_pairing(agreement, sequence, frames)) return {*problem};
  if (agreement.negative_share > kMaxNegativeShare) {
    return {
        {Problem::Severity::kError,
         fmt::format("{}: {:.0f} % of the disparities are negative, {} and {} look swapped; {} must hold the "
                     "left camera",
                     sequence.folder.string(), 100.0 * agreement.negative_share, sequence.left_name,
                     sequence.right_name, sequence.left_name)}};
  }
  if (agreement.row_offset_px > kMaxRowOffset_px) {
    const auto* advice =
        sequence.rectifier
            ? "the calibration is of another camera or has changed, or the images are wrongly paired"
            : "rectify the images, or check their stamps and their pairing";
    return {
        {Problem::Severity::kWarning,
         fmt::format("{}: matched features lie {:.2f} px apart in row (median; at most {:.1f} is good); {}",
                     sequence.folder.string(), agreement.row_offset_px, kMaxRowOffset_px, advice)}};
  }
  return {};
}

}  // namespace stereo_slam
