// SPDX-License-Identifier: MIT
#include "flags.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace object_pose {
namespace {

const cv::Scalar kBefore(60, 140, 40), kFeature(200, 90, 20), kAfter(40, 30, 210), kTruth(0, 0, 0);
constexpr int kFraction = 4;  // binary digits of a coordinate between pixels

/// A square part of the left image that flags are drawn on.
class FlagPanel {
 public:
  FlagPanel(const cv::Mat1b& left, const StereoCamera& camera, const cv::Rect2d& part, int side_px)
      : camera_(camera), part_(part), scale_(side_px / part.width) {
    // Pale and smooth, so that the flags stand out and the file is small.
    const cv::Matx23d cut(scale_, 0, -scale_ * part.x, 0, scale_, -scale_ * part.y);
    cv::Mat1b grey;
    cv::warpAffine(left, grey, cut, {side_px, side_px}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    cv::medianBlur(grey, grey, 3);
    grey = grey * 0.4 + 140;
    grey = grey / 12 * 12;
    cv::cvtColor(grey, image_, cv::COLOR_GRAY2BGR);
  }

  [[nodiscard]] const cv::Mat3b& image() const { return image_; }

  /// Draws a flag, if all of it is in front of the camera.
  void flag(const Pose& pose, const FlagSettings& s, const cv::Scalar& color, double opacity) {
    const auto corners = corners_of_flag(pose, s);
    if (!corners) return;
    const auto& [foot, top, low, tip] = *corners;
    cv::Rect area = cv::boundingRect(std::vector<cv::Point>{foot, top, low, tip});
    area = cv::Rect(area.x / (1 << kFraction) - 3, area.y / (1 << kFraction) - 3,
                    area.width / (1 << kFraction) + 7, area.height / (1 << kFraction) + 7) &
           cv::Rect({0, 0}, image_.size());
    if (area.empty()) return;
    const cv::Mat3b below = image_(area).clone();
    cv::fillConvexPoly(image_, std::vector<cv::Point>{top, low, tip}, color, cv::LINE_AA, kFraction);
    cv::line(image_, foot, top, color, 1, cv::LINE_AA, kFraction);
    cv::addWeighted(image_(area), opacity, below, 1.0 - opacity, 0.0, image_(area));
  }

  /// Draws the outline of a flag.
  void outline(const Pose& pose, const FlagSettings& s, const cv::Scalar& color) {
    const auto corners = corners_of_flag(pose, s);
    if (!corners) return;
    const auto& [foot, top, low, tip] = *corners;
    for (const auto& [from, to] : {std::pair(foot, top), std::pair(top, tip), std::pair(tip, low)}) {
      cv::line(image_, from, to, color, 2, cv::LINE_AA, kFraction);
    }
  }

  void dot(const Eigen::Vector3d& z, const cv::Scalar& color) {
    const cv::Point at = fixed((z.x() - part_.x) * scale_, (z.y() - part_.y) * scale_);
    cv::circle(image_, at, 5 << kFraction, cv::Scalar::all(255), cv::FILLED, cv::LINE_AA, kFraction);
    cv::circle(image_, at, 4 << kFraction, color, cv::FILLED, cv::LINE_AA, kFraction);
  }

  void title(const std::string& text) {
    cv::rectangle(image_, {0, 0, image_.cols, 24}, cv::Scalar::all(250), cv::FILLED);
    cv::putText(image_, text, {8, 17}, cv::FONT_HERSHEY_SIMPLEX, 0.48, cv::Scalar::all(30), 1, cv::LINE_AA);
  }

 private:
  [[nodiscard]] static cv::Point fixed(double x, double y) {
    return {cvRound(std::ldexp(x, kFraction)), cvRound(std::ldexp(y, kFraction))};
  }
  [[nodiscard]] cv::Point pixel(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d z = camera_.project_unchecked(p);
    return fixed((z.x() - part_.x) * scale_, (z.y() - part_.y) * scale_);
  }

  /// Foot and top of the pole, lower corner and tip of the pennant.
  [[nodiscard]] std::optional<std::array<cv::Point, 4>> corners_of_flag(const Pose& pose,
                                                                        const FlagSettings& s) const {
    const Eigen::Vector3d foot = pose.translation(), x = pose.rotation_matrix().col(0),
                          z = pose.rotation_matrix().col(2);
    const Eigen::Vector3d top = foot + s.pole_m * z, low = foot + 0.6 * s.pole_m * z;
    const std::array<Eigen::Vector3d, 4> corners = {foot, top, low, 0.5 * (top + low) + s.pennant_m * x};
    std::array<cv::Point, 4> pixels;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if (!(corners[k].z() > StereoCamera::kMinDepth_m)) return std::nullopt;
      pixels[k] = pixel(corners[k]);
    }
    return pixels;
  }

  StereoCamera camera_;
  cv::Rect2d part_;
  double scale_;
  cv::Mat3b image_;
};

/// The square part of the image around the box at a pose [px].
cv::Rect2d around(const Pose& pose, const BoxSize& size_m, const StereoCamera& camera, double margin) {
  Eigen::Vector2d lower = Eigen::Vector2d::Constant(1e9), upper = -lower;
  const auto corners = corners_of(size_m);
  for (Eigen::Index k = 0; k < corners.cols(); ++k) {
    const Eigen::Vector3d p = pose * Eigen::Vector3d(corners.col(k));
    const Eigen::Vector2d z = camera.project_unchecked(p).head<2>();
    lower = lower.cwiseMin(z);
    upper = upper.cwiseMax(z);
  }
  const double side = (1.0 + 2.0 * margin) * (upper - lower).maxCoeff();
  const Eigen::Vector2d corner = 0.5 * (lower + upper) - Eigen::Vector2d::Constant(0.5 * side);
  return {corner.x(), corner.y(), side, side};
}

/// Draws flags from a mixture. The least dense are drawn first; the denser, the more opaque.
void plant(const Belief& belief, const cv::Scalar& color, const FlagSettings& settings, FlagPanel& panel) {
  std::mt19937_64 rng(1);
  std::vector<std::pair<double, Pose>> flags;
  for (int k = 0; k < settings.draws; ++k) {
    const Pose pose = belief.sample(rng);
    flags.emplace_back(belief.log_density(pose), pose);
  }
  std::sort(flags.begin(), flags.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  const double count = static_cast<double>(flags.size());
  for (std::size_t k = 0; k < flags.size(); ++k) {
    const double rank = static_cast<double>(k) / count;
    panel.flag(flags[k].second, settings, color, 0.1 + 0.3 * rank);
  }
}

std::string components(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " component" : " components");
}

}  // namespace

cv::Mat3b draw_stage(const Stage& stage, const Match& match, const StageBackground& background,
                     const FlagSettings& settings) {
  const auto& [left, camera, size_m, truth, view] = background;
  const cv::Rect2d part = around(view, size_m, camera, settings.margin);
  FlagPanel apart(left, camera, part, settings.panel_px), together(left, camera, part, settings.panel_px);
  if (stage.before) plant(*stage.before, kBefore, settings, apart);
  plant(stage.feature, kFeature, settings, apart);
  plant(stage.after, kAfter, settings, together);
  for (FlagPanel* panel : {&apart, &together}) {
    if (truth) panel->outline(*truth, settings, kTruth);
  }
  apart.dot(match.seen.z, kFeature);
  apart.title(stage.before ? "before (green), this feature alone (blue)" : "this feature alone (blue)");
  together.title("after: " + components(stage.after.size()));
  cv::Mat3b both;
  cv::hconcat(apart.image(), together.image(), both);
  return both;
}

}  // namespace object_pose
