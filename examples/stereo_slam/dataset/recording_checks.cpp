// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/recording_checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/calibration/given_distortion.hpp"
#include "stereo_slam/calibration/rig_file.hpp"
#include "stereo_slam/core/median.hpp"
#include "stereo_slam/dataset/recording_hypotheses.hpp"

namespace stereo_slam {
namespace {

constexpr double kFar = 0.15;  // rectified images of good cameras have up to 0.08

/// Where a centre lies, relative to the middle of the image: 1 is the middle.
[[nodiscard]] double relative(double centre_px, int size_px) { return 2.0 * centre_px / size_px; }

[[nodiscard]] bool is_far(double centre_px, int size_px) {
  return std::abs(relative(centre_px, size_px) - 1.0) > kFar;
}

/// What images are whose width was halved and whose height was not, or the other way round, as video is
/// stored that shows two views in one: the principal point is off the middle in this direction, by a factor
/// of two. Empty for others.
[[nodiscard]] std::string squeezed_text(const ImageCentre& centre) {
  constexpr double kAlike = 0.06;
  const auto is_double = [](double factor) { return std::abs(0.5 * factor - 1.0) < kAlike; };
  const double x = relative(centre.cx, centre.width_px), y = relative(centre.cy, centre.height_px);
  if (is_double(x) == is_double(y) ||
      is_far(is_double(x) ? centre.cy : centre.cx, is_double(x) ? centre.height_px : centre.width_px))
    return "";
  return fmt::format(
      "the images look squeezed to half their {0}, as video that shows two views in one is stored; stretch "
      "them to {1}x{2} px, or halve {3}",
      is_double(x) ? "width" : "height", is_double(x) ? 2 * centre.width_px : centre.width_px,
      is_double(x) ? centre.height_px : 2 * centre.height_px, is_double(x) ? "fx and cx" : "fy and cy");
}

/// What an off-centre principal point means; empty if it is not far off.
[[nodiscard]] std::string centre_advice(const StereoSequence& sequence, const ImageCentre& centre) {
  const double x = relative(centre.cx, centre.width_px);
  const double y = relative(centre.cy, centre.height_px);
  if (const auto order = likely_order(sequence)) return order_text(*order);
  if (const auto factor = size_factor(centre)) return other_size_text(centre, *factor);
  if (std::string squeezed = squeezed_text(centre); !squeezed.empty()) return squeezed;
  const bool far_x = std::abs(x - 1.0) > kFar;
  const bool far_y = std::abs(y - 1.0) > kFar;
  if (!far_x && !far_y) return "";
  if (far_x && far_y)
    return "check that it is of this camera, of images of this size, and in the order cx, cy";
  const auto [name, first, last, lines] =
      far_x ? std::tuple("cx", "left", "right", "columns") : std::tuple("cy", "top", "bottom", "rows");
  return fmt::format(
      "if the images were cropped after the calibration, subtract from {} the {} that were cut off at the "
      "{}; if they were cropped at the {} only, nothing is wrong",
      name, lines, first, last);
}

void check_centre(SequenceScan& scan) {
  const ImageCentre centre = centre_of(scan.sequence);
  const std::string advice = centre_advice(scan.sequence, centre);
  if (advice.empty()) return;
  scan.warn(scan.sequence.folder,
            "the calibration gives the principal point ({:.4g}, {:.4g}) for images of {}x{} px, far from "
            "their middle; {}",
            centre.cx, centre.cy, centre.width_px, centre.height_px, advice);
}

/// Warns about a field of view that no lens has after rectification, and about a principal point far from the
/// middle of the image.
void check_view(SequenceScan& scan) {
  constexpr double kNarrowest_deg = 5.0;
  constexpr double kWidest_deg = 150.0;
  const auto& camera = scan.sequence.camera;
  if (!(camera.fx > 0.0) || camera.width_px <= 0 || camera.height_px <= 0) return;
  const double view_deg = 360.0 / std::numbers::pi * std::atan(0.5 * camera.width_px / camera.fx);
  if (view_deg < kNarrowest_deg || view_deg > kWidest_deg) {
    scan.warn(scan.sequence.folder,
              "the calibration gives a focal length of {:.4g} px for images {} px wide, a field of view of "
              "{:.3g} degrees; check that it is of this camera and in pixels",
              camera.fx, camera.width_px, view_deg);
  }
  check_centre(scan);
}

/// Warns about coefficients of a distortion with which no lens exists by the model that the calibration
/// names, if lenses exist by the other model.
void check_lenses(SequenceScan& scan) {
  if (!scan.sequence.rig) return;
  const Lens &left = scan.sequence.rig->left, &right = scan.sequence.rig->right;
  const Distortion named = left.distortion;
  if (named == Distortion::kNone || right.distortion != named) return;
  for (const Lens* lens : {&left, &right}) {
    if (lens->coefficients.size() != 4) return;  // by their number, those of radtan
  }
  const auto both_can_be = [&](Distortion model) {
    return can_be(model, left, left.coefficients) && can_be(model, right, right.coefficients);
  };
  const Distortion other = named == Distortion::kRadTan ? Distortion::kEquidistant : Distortion::kRadTan;
  if (both_can_be(named) || !both_can_be(other)) return;
  scan.warn(
      scan.sequence.folder,
      "no lens has the coefficients of its distortion (k1 is {:.3g} and {:.3g}) by the model {} that the "
      "calibration names, and lenses have them by {}; check the name of the model",
      left.coefficients.front(), right.coefficients.front(), to_string(named), to_string(other));
}

/// The times between two frames, s.
[[nodiscard]] std::vector<double> frame_intervals_s(const std::vector<StereoFiles>& frames) {
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < frames.size(); ++i)
    intervals_s.push_back(
        1e-9 * (static_cast<double>(frames[i].stamp_ns) - static_cast<double>(frames[i - 1].stamp_ns)));
  return intervals_s;
}

/// The median, the lower of the two middle values. A pause of the recording does not change it.
[[nodiscard]] double usual_interval_s(std::vector<double> intervals_s) {
  const auto middle = intervals_s.begin() + static_cast<std::ptrdiff_t>((intervals_s.size() - 1) / 2);
  std::nth_element(intervals_s.begin(), middle, intervals_s.end());
  return *middle;
}

/// Warns about times between frames that differ as those of images that were stamped on arrival.
[[nodiscard]] bool warn_of_uneven_stamps(SequenceScan& scan, const std::vector<double>& intervals_s) {
  constexpr std::size_t kFewest = 12;
  constexpr double kUneven = 4.0;  // rendered drives at 10 Hz are tracked with 40 and 160 ms in turn, and not
                                   // with 25 and 175 ms
  if (intervals_s.size() < kFewest) return false;
  const double short_s = quantile(intervals_s, 0.25), long_s = quantile(intervals_s, 0.8);
  if (!(long_s > kUneven * short_s)) return false;
  scan.warn(scan.sequence.folder,
            "a quarter of its frames come {:.3g} s or less after the one before, and a fifth {:.3g} s or "
            "more, as if they were stamped on arrival, or many were lost; motion is predicted over these "
            "times, so give the "
            "images those of their exposure",
            short_s, long_s);
  return true;
}

/// What to do about a baseline that is too long to be in metres: the units in which it would be an ordinary
/// one. With a focal length, that of rectified images, it may also be a product with it.
[[nodiscard]] std::string unit_advice(double baseline, std::optional<double> focal_px) {
  constexpr double kUsualShortest_m = 0.02;
  constexpr double kUsualLongest_m = 1.5;
  struct LengthUnit {
    std::string_view name;
    double per_metre;
  };
  std::string advice;
  const auto is_usual = [&](double baseline_m) {
    return baseline_m >= kUsualShortest_m && baseline_m <= kUsualLongest_m;
  };
  if (focal_px && is_usual(baseline / *focal_px)) {
    advice = fmt::format(
        "if it is the product of focal length and baseline (bf, P[3]), divide it by the focal "
        "length (to {:.4g} m)",
        baseline / *focal_px);
  }
  for (const auto& [name, per_metre] :
       {LengthUnit{"centimetres", 100.0}, LengthUnit{"millimetres", 1000.0}}) {
    const double baseline_m = baseline / per_metre;
    if (!is_usual(baseline_m)) continue;
    advice += fmt::format("{}if these are {}, divide the translation by {} (to {:.4g} m)",
                          advice.empty() ? "" : "; ", name, per_metre, baseline_m);
  }
  if (advice.empty()) return "few cameras are so far apart, so check the translation";
  return advice + "; if they are squares of the calibration board, multiply it by the width of one";
}

}  // namespace

ImageCentre centre_of(const StereoSequence& sequence) {
  if (!sequence.rig) {
    const auto& camera = sequence.camera;
    return {camera.cx, camera.cy, camera.width_px, camera.height_px};
  }
  const auto& [left, right] = std::pair(sequence.rig->left, sequence.rig->right);
  const double across = static_cast<double>(left.width_px) / right.width_px;  // the sizes may differ
  const double down = static_cast<double>(left.height_px) / right.height_px;
  return {0.5 * (left.cx + across * right.cx), 0.5 * (left.cy + down * right.cy), left.width_px,
          left.height_px};
}

std::optional<std::array<std::size_t, 4>> likely_order(const Intrinsics& camera) {
  constexpr double kSquare = 0.05;  // by how much fx and fy differ at most
  constexpr double kWidest = 0.2;   // fx over the width of an image with a field of view of 136 degrees
  const auto is_likely = [&](const std::array<std::size_t, 4>& order) {
    const auto value = [&](std::size_t k) { return camera.values_px[order[k]]; };
    return value(0) > kWidest * camera.width_px && std::abs(value(0) / value(1) - 1.0) < kSquare &&
           !is_far(value(2), camera.width_px) && !is_far(value(3), camera.height_px);
  };
  std::array<std::size_t, 4> order = {0, 1, 2, 3};
  if (!is_far(camera.values_px[2], camera.width_px) && !is_far(camera.values_px[3], camera.height_px))
    return std::nullopt;
  std::optional<std::array<std::size_t, 4>> likely;
  do {
    if (!is_likely(order)) continue;
    if (order[0] > order[1]) continue;  // fx and fy are hardly told apart
    if (likely) return std::nullopt;
    likely = order;
  } while (std::ranges::next_permutation(order).found);
  if (!likely) return likely;
  order = *likely;
  std::swap(order[0], order[1]);
  const auto in_place = [](const auto& positions) {
    return (positions[0] == 0 ? 1 : 0) + (positions[1] == 1 ? 1 : 0);
  };
  return in_place(order) > in_place(*likely) ? order : likely;
}

std::optional<std::array<std::size_t, 4>> likely_order(const StereoSequence& sequence) {
  if (!sequence.rig) {
    const auto& camera = sequence.camera;
    return likely_order(
        Intrinsics{{camera.fx, camera.fy, camera.cx, camera.cy}, camera.width_px, camera.height_px});
  }
  const auto of_lens = [](const Lens& lens) {
    return likely_order(Intrinsics{{lens.fx, lens.fy, lens.cx, lens.cy}, lens.width_px, lens.height_px});
  };
  const auto order = of_lens(sequence.rig->left);
  return order == of_lens(sequence.rig->right) ? order : std::nullopt;
}

std::string order_text(const std::array<std::size_t, 4>& order) {
  constexpr std::array kNames = {"fx", "fy", "cx", "cy"};
  std::array<const char*, 4> given{};
  std::vector<const char*> moved;
  for (std::size_t k = 0; k < order.size(); ++k) {
    given[order[k]] = kNames[k];
    if (order[k] != k) moved.push_back(kNames[k]);
  }
  if (moved.size() == 2) return fmt::format("{} and {} look exchanged", moved[0], moved[1]);
  return fmt::format("the numbers look to be {}, {}, {}, {} where fx, fy, cx, cy are expected", given[0],
                     given[1], given[2], given[3]);
}

std::optional<double> size_factor(const ImageCentre& centre) {
  constexpr double kClear = 0.08;
  constexpr double kAlike = 0.06;
  const double x = relative(centre.cx, centre.width_px);
  const double y = relative(centre.cy, centre.height_px);
  const bool smaller = x < 1.0 - kClear && y < 1.0 - kClear;
  const bool larger = x > 1.0 + kClear && y > 1.0 + kClear;
  if (!(x > 0.0 && y > 0.0) || !(smaller || larger) || std::abs(x / y - 1.0) > kAlike) return std::nullopt;
  return 2.0 / (x + y);
}

std::string other_size_text(const ImageCentre& centre, double factor) {
  return fmt::format(
      "the calibration looks made for images of about {:.0f}x{:.0f} px; use images of that size, or multiply "
      "its values in pixels by the ratio of the widths, about {:.2f}",
      centre.width_px / factor, centre.height_px / factor, factor);
}

void check_rig(SequenceScan& scan) {
  if (auto cause = cause_of_rejected_rig(scan.sequence))
    scan.problems.insert(scan.problems.begin(), std::move(*cause));
}

void check_frame_rate(SequenceScan& scan) {
  constexpr double kFastest_hz = 1000.0;
  constexpr double kSlowest_hz = 0.1;
  const auto& frames = scan.sequence.frames;
  if (scan.sequence.live || frames.size() < 2) return;
  const std::vector<double> all_s = frame_intervals_s(frames);
  if (warn_of_uneven_stamps(scan, all_s)) return;
  const double interval_s = usual_interval_s(all_s);
  if (!(interval_s > 0.0) || (interval_s >= 1.0 / kFastest_hz && interval_s < 1.0 / kSlowest_hz)) return;
  scan.warn(scan.sequence.folder,
            "its stamps are {:.3g} s apart, {:.4g} frames per second; check their unit (those in times.txt "
            "are in seconds)",
            interval_s, 1.0 / interval_s);
}

void check_camera(SequenceScan& scan) {
  constexpr double kShortest_m = 0.005;
  constexpr double kLongest_m = 3.0;
  constexpr double kLeast = 1e-6;  // bounds of the focal lengths, px, and of the baseline, m
  constexpr double kMost = 1e6;
  const auto& camera = scan.sequence.camera;
  const double baseline_m = camera.baseline_m;
  const auto is_sane = [&](double value) { return value >= kLeast && value <= kMost; };
  if (camera.fx > 0.0 && !(is_sane(camera.fx) && is_sane(camera.fy) && is_sane(baseline_m))) {
    scan.problems.push_back(Problem::error(scan.sequence.folder,
                                           "the calibration gives focal lengths of {:.4g} and {:.4g} px and "
                                           "a baseline of {:.4g} m; each must be from {} to {}",
                                           camera.fx, camera.fy, baseline_m, kLeast, kMost));
    return;
  }
  constexpr double kMostOblong = 2.0;
  if (camera.fx > 0.0 && std::max(camera.fx / camera.fy, camera.fy / camera.fx) > kMostOblong) {
    scan.warn(scan.sequence.folder,
              "the calibration gives focal lengths of {:.4g} and {:.4g} px; pixels are nearly square, so one "
              "of the two is wrong",
              camera.fx, camera.fy);
  }
  check_view(scan);
  check_lenses(scan);
  if (baseline_m <= 0.0 || (baseline_m >= kShortest_m && baseline_m <= kLongest_m)) return;
  const std::string advice =
      baseline_m > kLongest_m
          ? unit_advice(baseline_m, scan.sequence.rig ? std::nullopt : std::optional(camera.fx))
          : "multiply the translation by the length of its unit, or by the width of a square of the "
            "calibration board; a product of focal length and baseline (bf, P[3]) may lack the focal length";
  scan.warn(scan.sequence.folder,
            "the calibration gives a baseline of {:.4g} m; lengths must be in metres; {}", baseline_m,
            advice);
}

}  // namespace stereo_slam
