// SPDX-License-Identifier: MIT
#include "table.hpp"

#include <cmath>
#include <numbers>
#include <string>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "belief.hpp"

namespace object_pose {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

/// "49 > 21 > 14 > 10": all pairs, accepted pairs, components left after dropping light ones, and components
/// left after merging.
std::string components(const Stage& stage) {
  switch (stage.verdict) {
    case Verdict::kFirst:
      return fmt::format("{}", stage.after.size());
    case Verdict::kFused:
      return fmt::format("{} > {} > {} > {}", stage.pairs, stage.compatible, stage.compatible - stage.dropped,
                         stage.after.size());
    default:
      return fmt::format("{} > {}", stage.pairs, stage.compatible);
  }
}

const char* remark(Verdict verdict) {
  switch (verdict) {
    case Verdict::kFirst:
      return "first";
    case Verdict::kFused:
      return "fused";
    case Verdict::kRefused:
      return "refused";
    default:
      return "refused, start again";
  }
}

}  // namespace

void print_table(std::ostream& stream, const EstimateRecord& record) {
  fmt::print(stream, "{:>3} {:<7}{:>22} {:>9} {:>8} {:>8} {:>8}  {}\n", "", "face", "components", "evidence",
             "entropy", "deg", "cm", "");
  int line = 0;
  for (const auto& stage : record.stages) {
    const auto& feature = record.model.features[record.matches[stage.match].model_feature];
    const std::string evidence =
        stage.verdict == Verdict::kFirst ? "" : fmt::format("{:.1f}", stage.log_evidence);
    std::string deg, cm;
    if (record.ground_truth) {
      const PoseError error = error_of(summarize(stage.after).pose, *record.ground_truth);
      deg = fmt::format("{:.2f}", error.rotation_deg);
      cm = fmt::format("{:.2f}", error.translation_cm);
    }
    fmt::print(stream, "{:>3} {:<7}{:>22} {:>9} {:>8.1f} {:>8} {:>8}  {}\n", ++line,
               record.box.faces[feature.face].name, components(stage), evidence, entropy(stage.after), deg,
               cm, remark(stage.verdict));
  }
}

void print_pose(std::ostream& stream, const Belief& belief, const std::optional<Pose>& truth) {
  const PoseSummary summary = summarize(belief);
  const auto q = summary.pose.rotation();
  const auto t = summary.pose.translation();
  fmt::print(stream,
             "T_camera_object: q = ({:.4f}, {:.4f}, {:.4f}, {:.4f}), t = ({:.4f}, {:.4f}, {:.4f}) m, known "
             "to {:.1f} deg and {:.1f} cm\n",
             q[0], q[1], q[2], q[3], t[0], t[1], t[2], summary.rotation_sigma_rad * kDegrees,
             100.0 * summary.translation_sigma_m);
  if (truth) {
    fmt::print(stream, "the truth lies on the border of the {:.1f} % region\n",
               100.0 * mass_above(belief, *truth));
  }
}

}  // namespace object_pose
