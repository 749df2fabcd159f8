// SPDX-License-Identifier: MIT
#include "stereo_slam/results/camera_warnings.hpp"

#include <cmath>

#include <fmt/format.h>

#include "stereo_slam/io/counted.hpp"

namespace stereo_slam {
namespace {

constexpr double kSigmas = 5.0;

/// Radial distortion that no calibration leaves; empty for others.
[[nodiscard]] std::string lens_text(const LensEstimate& lens) {
  constexpr double kMost = 0.06;  // twice that of KITTI and EuRoC; a wrong model leaves .15 to .25
  const double k1 = lens.k[0];
  if (!(std::abs(k1) > kMost && std::abs(k1) > kSigmas * lens.sigma[0])) return "";
  return fmt::format(
      "the images still have a radial distortion of about k1 = {:.2f}, as was learned while driving, where "
      "good calibrations leave 0.03 at most, and lengths may be wrong by some percent; check the distortion "
      "model that the calibration names and the signs of its coefficients, or whether images that should be "
      "rectified are",
      k1);
}

[[nodiscard]] std::string delay_text(const DelayEstimate& delay) {
  if (!(std::abs(delay.seconds) > kSigmas * delay.sigma_s)) return "";
  return fmt::format(
      "the right images were exposed {:.1f} ms {} than the left ones, as was learned while driving and taken "
      "into account; poses are better if both cameras are triggered at once",
      1e3 * std::abs(delay.seconds), delay.seconds > 0.0 ? "later" : "earlier");
}

/// A right camera that turned, or whose images are displaced; empty for others.
[[nodiscard]] std::string displacement_text(const RunSummary& summary) {
  constexpr double kNoticeable_px = 0.1;
  if (const auto& turns = summary.right_camera_turns; !turns.empty()) {
    const std::string others = turns.size() > 1 ? ", and " + counted(turns.size() - 1, "more time") : "";
    return fmt::format(
        "the right camera turned shortly before frame {}{}; poses may be wrong until that frame, and rest on "
        "what was learned while driving from then on",
        turns.front(), others);
  }
  const double px = summary.rig.right_image_displacement_px;
  if (!(std::abs(px) >= kNoticeable_px)) return "";
  return fmt::format(
      "the right image is {:.1f} px farther {} than the calibration says, as was learned while driving; "
      "check cx of both cameras, and where the images were cut",
      std::abs(px), px > 0.0 ? "right" : "left");
}

}  // namespace

std::vector<std::string> camera_warnings(const RunSummary& summary) {
  std::vector<std::string> texts;
  const auto& rig = summary.rig;
  if (rig.refused_learned) {
    texts.emplace_back(
        "the images contradict what --learned says of the cameras, and it was dropped: give the cameras.yaml "
        "of a run with the same cameras and the same calibration, or leave --learned out");
  }
  if (const auto& misfits = summary.right_image_misfits; !misfits.empty() && summary.error.empty()) {
    texts.push_back(
        fmt::format("in {} of {} frames, from {} to {}, the right image does not fit the left one: it is of "
                    "another moment, or the camera was covered or moved; these frames are WEAK or LOST",
                    misfits.size(), summary.frames, misfits.front(), misfits.back()));
  }
  if (rig.right_delay) texts.push_back(delay_text(*rig.right_delay));
  texts.push_back(displacement_text(summary));
  if (rig.lens_error) texts.push_back(lens_text(*rig.lens_error));
  std::erase(texts, "");
  return texts;
}

}  // namespace stereo_slam
