// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/loop_score.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <fmt/ranges.h>

#include "stereo_slam/evaluation/json_value.hpp"
#include "stereo_slam/evaluation/pose_tree.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

constexpr std::string_view kHeader = "frame,old_frame,inliers,chi2,verdict,old_map,tx,ty,tz,qx,qy,qz,qw";

template <class Integer>
[[nodiscard]] bool parse_whole(std::string_view field, Integer& value) {
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  return error == std::errc{} && end == field.data() + field.size();
}

/// Position, then quaternion with its scalar last.
[[nodiscard]] std::optional<Pose> parse_pose(std::span<const std::string_view, 7> fields) {
  antipode::Vector<double, 7> values;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const auto value = parse_numbers(fields[static_cast<std::size_t>(i)]);
    if (!value) return std::nullopt;
    values[i] = value->front();
  }
  const antipode::Vector4<double> rotation(values[6], values[3], values[4], values[5]);
  constexpr double kTolerance = 1e-6;
  if (!(std::abs(rotation.norm() - 1.0) <= kTolerance)) return std::nullopt;
  return Pose::from_rotation_translation(rotation.normalized(), values.head<3>());
}

[[nodiscard]] std::optional<LoopEvent> parse_loop(const std::string& text) {
  const auto fields = split_fields(text);
  if (fields.size() != 13 || (fields[4] != "accepted" && fields[4] != "refused") ||
      (fields[5] != "run" && fields[5] != "loaded")) {
    return std::nullopt;
  }
  LoopEvent loop;
  const auto chi2 = parse_numbers(fields[3]);
  const auto T_old_new = parse_pose(std::span(fields).subspan<6, 7>());
  if (!chi2 || !T_old_new || !parse_whole(fields[0], loop.frame) || !parse_whole(fields[1], loop.old_frame) ||
      !parse_whole(fields[2], loop.inliers)) {
    return std::nullopt;
  }
  loop.chi2 = chi2->front();
  loop.accepted = fields[4] == "accepted";
  loop.in_loaded_map = fields[5] == "loaded";
  loop.T_old_new = *T_old_new;
  return loop;
}

/// A frame with ground truth.
struct KnownFrame {
  std::size_t frame = 0;
  Eigen::Isometry3d pose;
  double path_m = 0.0;  ///< path length since the first known frame
};

[[nodiscard]] std::vector<KnownFrame> known_frames(const TruePoses& truth) {
  std::vector<KnownFrame> known;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    if (!truth[k]) continue;
    const double step_m =
        known.empty() ? 0.0 : (truth[k]->translation() - known.back().pose.translation()).norm();
    known.push_back({k, *truth[k], known.empty() ? 0.0 : known.back().path_m + step_m});
  }
  return known;
}

/// Finds which frames revisit the place of an earlier one.
class RevisitSearch {
 public:
  RevisitSearch(const std::vector<KnownFrame>& known, const RevisitRule& rule)
      : known_(known), rule_(rule), tree_(poses_of(known), {rule.max_distance_m, rule.max_angle_rad}) {}

  [[nodiscard]] bool revisits_place(std::size_t i) const {
    const KnownFrame& now = known_[i];
    const auto elsewhere = tree_.last_far(now.pose, i);
    if (!elsewhere) return false;
    // Frame and path length increase along the run, so the frames that are long enough ago come first.
    const auto first_recent =
        std::partition_point(known_.begin(), known_.begin() + static_cast<std::ptrdiff_t>(*elsewhere),
                             [&](const KnownFrame& then) {
                               return now.frame - then.frame >= rule_.min_gap_frames &&
                                      now.path_m - then.path_m > rule_.min_path_m;
                             });
    return tree_.any_near(now.pose, static_cast<std::size_t>(first_recent - known_.begin()));
  }

 private:
  [[nodiscard]] static std::vector<Eigen::Isometry3d> poses_of(const std::vector<KnownFrame>& known) {
    std::vector<Eigen::Isometry3d> poses;
    poses.reserve(known.size());
    for (const auto& frame : known) poses.push_back(frame.pose);
    return poses;
  }

  const std::vector<KnownFrame>& known_;
  const RevisitRule& rule_;
  PoseTree tree_;
};

[[nodiscard]] bool is_true(const LoopEvent& loop, const TruePoses& truth, const RevisitRule& rule) {
  const Eigen::Isometry3d T_old_new = truth[loop.old_frame]->inverse() * *truth[loop.frame];
  return is_near(T_old_new, loop.T_old_new.isometry(), {rule.max_true_error_m, rule.max_true_error_rad});
}

/// Records a true loop in the revisit that contains its frame.
void credit(std::vector<Revisit>& revisits, const LoopEvent& loop) {
  const auto revisit = std::ranges::lower_bound(revisits, loop.frame, {}, &Revisit::last);
  if (revisit == revisits.end() || loop.frame < revisit->first) return;
  revisit->first_loop = std::min(revisit->first_loop.value_or(loop.frame), loop.frame);
}

/// Sets found_path_m of every revisit: the path over the frames up to `reach_frames` after one of its loops.
void measure_found_path(std::vector<Revisit>& revisits, const std::vector<KnownFrame>& known,
                        std::vector<std::size_t> loop_frames, std::size_t reach_frames) {
  std::ranges::sort(loop_frames);
  for (auto& revisit : revisits) {
    const auto first = std::ranges::lower_bound(known, revisit.first, {}, &KnownFrame::frame);
    for (auto i = static_cast<std::size_t>(first - known.begin()) + 1;
         i < known.size() && known[i].frame <= revisit.last; ++i) {
      const std::size_t frame = known[i].frame;
      const auto after = std::ranges::upper_bound(loop_frames, frame);
      const bool found = after != loop_frames.begin() && *(after - 1) >= revisit.first &&
                         frame - *(after - 1) <= reach_frames;
      if (found) revisit.found_path_m += known[i].path_m - known[i - 1].path_m;
    }
  }
}

[[nodiscard]] double path_of(const LoopScore& score) {
  double path_m = 0.0;
  for (const auto& revisit : score.revisits) path_m += revisit.path_m;
  return path_m;
}

[[nodiscard]] std::string json(const Revisit& revisit) {
  return fmt::format(
      R"({{"first_frame": {}, "last_frame": {}, "path_m": {}, "found_path_m": {}, "first_loop": {}}})",
      revisit.first, revisit.last, revisit.path_m, revisit.found_path_m, json_value(revisit.first_loop));
}

void print_revisit(std::ostream& stream, const Revisit& revisit) {
  fmt::print(stream, "{:<32}{:.1f} m, ", fmt::format("  frames {} to {}", revisit.first, revisit.last),
             revisit.path_m);
  if (revisit.first_loop) {
    fmt::print(stream, "found after {}, {:.1f} m of it\n",
               counted(*revisit.first_loop - revisit.first, "frame"), revisit.found_path_m);
  } else {
    fmt::print(stream, "missed\n");
  }
}

}  // namespace

std::vector<LoopEvent> read_loops(const std::filesystem::path& file) {
  const auto lines = read_text_lines(file);
  if (lines.empty() || lines.front().text != kHeader) {
    fail(file, "not a loops.csv: the header {} is missing", kHeader);
  }
  require_line_end(file, lines);
  std::vector<LoopEvent> loops;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const auto loop = parse_loop(lines[i].text);
    if (!loop) {
      fail_at(
          file, lines[i].number,
          "expected two frames, the number of inliers, chi2, accepted or refused, run or loaded, and a pose");
    }
    if (!loop->in_loaded_map && loop->old_frame >= loop->frame) {
      fail_at(file, lines[i].number, "the old frame {} must be before frame {}", loop->old_frame,
              loop->frame);
    }
    loops.push_back(*loop);
  }
  return loops;
}

TruePoses poses_at_frames(const Trajectory& truth, const FramePairs& pairs, std::size_t frames) {
  TruePoses poses(frames);
  for (const auto& [i, j] : pairs) poses[j] = truth.poses[i];
  return poses;
}

std::vector<Revisit> find_revisits(const TruePoses& truth, const RevisitRule& rule) {
  const auto known = known_frames(truth);
  const RevisitSearch search(known, rule);
  std::vector<Revisit> revisits;
  std::size_t last = 0;  // index of the last revisit's end
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (!search.revisits_place(i)) continue;
    if (revisits.empty() || known[i].frame - revisits.back().last > rule.max_hole_frames + 1) {
      revisits.push_back({.first = known[i].frame, .last = known[i].frame, .first_loop = {}});
    } else {
      revisits.back().last = known[i].frame;
      revisits.back().path_m += known[i].path_m - known[last].path_m;
    }
    last = i;
  }
  return revisits;
}

LoopScore score_loops(const TruePoses& truth, const std::vector<LoopEvent>& loops, const RevisitRule& rule) {
  LoopScore score{.revisits = find_revisits(truth, rule)};
  std::vector<std::size_t> found_at;
  for (const auto& loop : loops) {
    const std::size_t last = loop.in_loaded_map ? loop.frame : std::max(loop.frame, loop.old_frame);
    if (last >= truth.size()) {
      throw std::runtime_error(
          fmt::format("a loop of frame {} in a run of {}; give loops and trajectory of the same run", last,
                      counted(truth.size(), "frame")));
    }
    ++(loop.accepted ? score.accepted : score.refused);
    if (loop.in_loaded_map || !truth[loop.frame] || !truth[loop.old_frame]) {
      ++score.without_truth;
    } else if (!is_true(loop, truth, rule)) {
      if (loop.accepted) ++score.accepted_false;
    } else if (loop.accepted) {
      credit(score.revisits, loop);
      found_at.push_back(loop.frame);
    } else {
      ++score.refused_true;
    }
  }
  measure_found_path(score.revisits, known_frames(truth), std::move(found_at), rule.reach_frames);
  return score;
}

std::size_t revisits_found(const LoopScore& score) {
  return static_cast<std::size_t>(std::ranges::count_if(
      score.revisits, [](const Revisit& revisit) { return revisit.first_loop.has_value(); }));
}

std::optional<double> path_recall(const LoopScore& score) {
  const double path_m = path_of(score);
  if (path_m <= 0.0) return std::nullopt;
  double found_m = 0.0;
  for (const auto& revisit : score.revisits) found_m += revisit.found_path_m;
  return found_m / path_m;
}

std::optional<double> median_delay_frames(const LoopScore& score) {
  std::vector<double> delays;
  for (const auto& revisit : score.revisits) {
    if (revisit.first_loop) delays.push_back(static_cast<double>(*revisit.first_loop - revisit.first));
  }
  if (delays.empty()) return std::nullopt;
  return error_statistics(std::move(delays)).median;
}

void print_loop_score(std::ostream& stream, const LoopScore& score) {
  fmt::print(stream, "{:<32}{} accepted, {} of them false; {} refused, {} of them true", "loops",
             score.accepted, score.accepted_false, score.refused, score.refused_true);
  if (score.without_truth > 0) fmt::print(stream, "; {} without ground truth", score.without_truth);
  stream << '\n';
  if (score.revisits.empty()) {
    fmt::print(stream, "{:<32}none\n", "revisits");
    return;
  }
  const auto count = score.revisits.size();
  const auto found = revisits_found(score);
  fmt::print(stream, "{:<32}{} of {} found ({:.0f} %)", "revisits", found, count,
             100.0 * static_cast<double>(found) / static_cast<double>(count));
  if (const auto recall = path_recall(score))
    fmt::print(stream, ", {:.0f} % of their {:.1f} m", 100.0 * *recall, path_of(score));
  if (const auto delay = median_delay_frames(score))
    fmt::print(stream, ", {:g} frames after they begin (median)", *delay);
  stream << '\n';
  for (const auto& revisit : score.revisits) print_revisit(stream, revisit);
}

std::string loop_score_json(const LoopScore& score) {
  std::vector<std::string> regions;
  for (const auto& revisit : score.revisits) regions.push_back(json(revisit));
  return fmt::format(
      R"({{"accepted": {}, "accepted_false": {}, "refused": {}, "refused_true": {}, "without_truth": {}, )"
      R"("revisits": {}, "revisits_found": {}, "path_m": {}, "path_recall": {}, "median_delay_frames": {}, )"
      R"("regions": [{}]}})",
      score.accepted, score.accepted_false, score.refused, score.refused_true, score.without_truth,
      score.revisits.size(), revisits_found(score), path_of(score), json_value(path_recall(score)),
      json_value(median_delay_frames(score)), fmt::join(regions, ", "));
}

}  // namespace stereo_slam
