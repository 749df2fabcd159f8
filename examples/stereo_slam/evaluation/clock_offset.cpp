// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/clock_offset.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"

namespace stereo_slam {
namespace {

constexpr std::ptrdiff_t kMostSteps = 2000;  // of the estimate, and of an offset

/// Poses at any time between the first and the last one of a trajectory, which must outlive it.
class Timeline {
 public:
  /// Times count from `origin_ns`, in s; without stamps they are numbers of frames.
  Timeline(const Trajectory& trajectory, std::int64_t origin_ns) : poses_(trajectory.poses) {
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      times_.push_back(!trajectory.stamps_ns.empty()
                           ? 1e-9 * static_cast<double>(trajectory.stamps_ns[i] - origin_ns)
                       : trajectory.frames.empty() ? static_cast<double>(i)
                                                   : static_cast<double>(trajectory.frames[i]));
    }
  }

  [[nodiscard]] const std::vector<double>& times() const noexcept { return times_; }
  [[nodiscard]] double begin() const { return times_.front(); }
  [[nodiscard]] double end() const { return times_.back(); }
  [[nodiscard]] bool contains(double time) const { return time >= begin() && time <= end(); }

  /// The pose at a time, on the straight line and the shortest turn between its neighbours.
  [[nodiscard]] Eigen::Isometry3d at(double time) const {
    const auto after = std::ranges::upper_bound(times_, time);
    if (after == times_.begin()) return poses_.front();
    if (after == times_.end()) return poses_.back();
    const auto i = static_cast<std::size_t>(after - times_.begin());
    const double share = (time - times_[i - 1]) / (times_[i] - times_[i - 1]);
    const Eigen::Quaterniond from = rotation(i - 1);
    return Eigen::Translation3d((1.0 - share) * poses_[i - 1].translation() +
                                share * poses_[i].translation()) *
           from.slerp(share, rotation(i));
  }

  /// The median time between two poses.
  [[nodiscard]] double interval() const {
    std::vector<double> intervals;
    for (std::size_t i = 1; i < times_.size(); ++i) {
      if (times_[i] > times_[i - 1]) intervals.push_back(times_[i] - times_[i - 1]);
    }
    return median(std::move(intervals));
  }

 private:
  [[nodiscard]] Eigen::Quaterniond rotation(std::size_t i) const {
    return Eigen::Quaterniond(poses_[i].linear()).normalized();
  }

  std::vector<double> times_;
  std::span<const Eigen::Isometry3d> poses_;
};

/// How far a trajectory turns and moves in each of equal steps of time.
struct Speeds {
  std::vector<double> turns_rad;
  std::vector<double> lengths_m;
};

/// The speeds in the steps `first` to before `last`; step k begins at `origin` + k * `step`.
[[nodiscard]] Speeds speeds_of(const Timeline& timeline, double origin, double step, std::ptrdiff_t first,
                               std::ptrdiff_t last) {
  Speeds speeds;
  Eigen::Isometry3d from = timeline.at(origin + static_cast<double>(first) * step);
  for (std::ptrdiff_t k = first; k < last; ++k) {
    const Eigen::Isometry3d to = timeline.at(origin + static_cast<double>(k + 1) * step);
    speeds.turns_rad.push_back(
        Eigen::Quaterniond(from.linear()).angularDistance(Eigen::Quaterniond(to.linear())));
    speeds.lengths_m.push_back((to.translation() - from.translation()).norm());
    from = to;
  }
  return speeds;
}

/// The root mean square without the largest tenth, which a few wrong poses may have caused.
[[nodiscard]] double trimmed_size(std::vector<double> values) {
  for (double& value : values) value *= value;
  const std::size_t kept = values.size() - values.size() / 10;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(kept - 1), values.end());
  values.resize(kept);
  return std::sqrt(std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(kept));
}

using SpeedSpan = std::span<const double>;

[[nodiscard]] double speed_size(SpeedSpan speeds) {
  constexpr double kLeast = 1e-12;
  return std::max(kLeast, trimmed_size({speeds.begin(), speeds.end()}));
}

/// The difference of two speeds, each divided by its unit.
[[nodiscard]] double speed_difference(SpeedSpan a, double unit_a, SpeedSpan b, double unit_b) {
  std::vector<double> differences(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) differences[i] = a[i] / unit_a - b[i] / unit_b;
  return trimmed_size(std::move(differences));
}

/// How much the speeds of two trajectories differ, as shares of their sizes. The scales may differ.
struct SpeedErrors {
  double turns = 0.0;
  double lengths = 0.0;

  [[nodiscard]] double squared() const { return turns * turns + lengths * lengths; }
  [[nodiscard]] double larger() const { return std::max(turns, lengths); }
};

/// Of `count` steps, from the given ones on.
[[nodiscard]] SpeedErrors errors_of(const Speeds& truth, std::ptrdiff_t truth_first, const Speeds& estimate,
                                    std::ptrdiff_t estimate_first, std::ptrdiff_t count) {
  const auto part = [&](const std::vector<double>& speeds, std::ptrdiff_t first) {
    return SpeedSpan(speeds).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(count));
  };
  const SpeedSpan true_turns = part(truth.turns_rad, truth_first);
  const SpeedSpan true_lengths = part(truth.lengths_m, truth_first);
  const SpeedSpan turns = part(estimate.turns_rad, estimate_first);
  const SpeedSpan lengths = part(estimate.lengths_m, estimate_first);
  const double turn_size = std::max(speed_size(true_turns), speed_size(turns));
  return {speed_difference(true_turns, turn_size, turns, turn_size),
          speed_difference(true_lengths, speed_size(true_lengths), lengths, speed_size(lengths))};
}

[[nodiscard]] bool speeds_agree_better(const SpeedErrors& fit, const SpeedErrors& as_given) {
  constexpr double kClear = 3.0;
  constexpr double kLeastError = 0.02;
  constexpr double kNoWorse = 1.1;
  constexpr double kSameMotion = 0.2;  // another part of a path with even bends differs by .3
  const auto better = [&](double now, double before) {
    return before > kLeastError && kClear * now < before;
  };
  const auto no_worse = [&](double now, double before) { return now <= std::max(1e-3, kNoWorse * before); };
  return fit.larger() < kSameMotion &&
         (better(fit.turns, as_given.turns) || better(fit.lengths, as_given.lengths)) &&
         no_worse(fit.turns, as_given.turns) && no_worse(fit.lengths, as_given.lengths);
}

/// Both trajectories in equal steps that begin with the estimate.
class Comparison {
 public:
  Comparison(const Timeline& truth, const Timeline& estimate) : truth_(truth), estimate_(estimate) {
    const double duration = estimate.end() - estimate.begin();
    interval_ = std::max(truth.interval(), estimate.interval());
    step_ = std::max(interval_, duration / static_cast<double>(kMostSteps));
    steps_ = static_cast<std::ptrdiff_t>(std::floor(duration / step_ + 1e-6));
    fewest_ = static_cast<std::ptrdiff_t>(0.5 * std::min(duration, truth.end() - truth.begin()) / step_);
    estimate_speeds_ = speeds_of(estimate, estimate.begin(), step_, 0, steps_);
  }

  [[nodiscard]] double step() const noexcept { return step_; }
  [[nodiscard]] bool is_long_enough() const noexcept {
    constexpr std::ptrdiff_t kFewest = 20;
    return steps_ >= kFewest && fewest_ >= kFewest / 2;
  }

  /// The errors if the truth is looked up `shift` later than the stamps of the estimate say; nothing if too
  /// little overlaps.
  [[nodiscard]] std::optional<SpeedErrors> errors(double shift) const {
    const double origin = estimate_.begin() + shift;
    const std::ptrdiff_t first = first_step(origin), last = last_step(origin);
    if (last - first < fewest_) return std::nullopt;
    const Speeds speeds = speeds_of(truth_, origin, step_, first, last);
    return errors_of(speeds, 0, estimate_speeds_, first, last - first);
  }

  /// The best one of the shifts by whole steps.
  [[nodiscard]] double best_of_whole_steps() const {
    const double origin = estimate_.begin();
    const auto begin = static_cast<std::ptrdiff_t>(std::ceil((truth_.begin() - origin) / step_ - 1e-6));
    const auto end = static_cast<std::ptrdiff_t>(std::floor((truth_.end() - origin) / step_ + 1e-6));
    const std::ptrdiff_t from = std::max(begin, -kMostSteps), to = std::min(end, steps_ + kMostSteps);
    if (to - from < fewest_) return 0.0;
    const Speeds speeds = speeds_of(truth_, origin, step_, from, to);
    double best = 0.0, least = std::numeric_limits<double>::infinity();
    for (std::ptrdiff_t shift = -kMostSteps; shift <= kMostSteps; ++shift) {
      const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, from - shift);
      const std::ptrdiff_t last = std::min(steps_, to - shift);
      if (last - first < fewest_) continue;
      const double squared =
          errors_of(speeds, first + shift - from, estimate_speeds_, first, last - first).squared();
      if (!(squared < least)) continue;
      least = squared;
      best = static_cast<double>(shift) * step_;
    }
    return best;
  }

  /// The best one within a step, to a hundredth of the time between two poses.
  [[nodiscard]] double refined(double shift) const {
    for (double finer = 0.1 * step_; finer > 0.005 * interval_; finer *= 0.1) {
      double best = shift, least = std::numeric_limits<double>::infinity();
      for (int k = -10; k <= 10; ++k) {
        const auto tried = errors(shift + k * finer);
        if (!tried || !(tried->squared() < least)) continue;
        least = tried->squared();
        best = shift + k * finer;
      }
      shift = best;
    }
    return shift;
  }

 private:
  /// The steps from `origin` that are inside the ground truth.
  [[nodiscard]] std::ptrdiff_t first_step(double origin) const {
    return std::max<std::ptrdiff_t>(
        0, static_cast<std::ptrdiff_t>(std::ceil((truth_.begin() - origin) / step_ - 1e-6)));
  }
  [[nodiscard]] std::ptrdiff_t last_step(double origin) const {
    return std::min(steps_, static_cast<std::ptrdiff_t>(std::floor((truth_.end() - origin) / step_ + 1e-6)));
  }

  const Timeline& truth_;
  const Timeline& estimate_;
  double interval_ = 0.0;
  double step_ = 0.0;
  std::ptrdiff_t steps_ = 0;
  std::ptrdiff_t fewest_ = 0;
  Speeds estimate_speeds_{};
};

[[nodiscard]] std::int64_t origin_of(const Trajectory& truth) {
  return truth.stamps_ns.empty() ? 0 : truth.stamps_ns.front();
}

}  // namespace

std::optional<ClockOffset> find_clock_offset(const Trajectory& truth, const Trajectory& estimate) {
  if (truth.poses.size() < 3 || estimate.poses.size() < 3) return std::nullopt;
  const Timeline true_line(truth, origin_of(truth)), line(estimate, origin_of(truth));
  if (!(true_line.interval() > 0.0) || !(line.interval() > 0.0)) return std::nullopt;
  const Comparison comparison(true_line, line);
  if (!comparison.is_long_enough()) return std::nullopt;
  const auto as_given = comparison.errors(0.0);
  double shift = comparison.refined(comparison.best_of_whole_steps());
  if (truth.stamps_ns.empty()) shift = std::round(shift);
  const auto better = comparison.errors(shift);
  if (!as_given || !better || !speeds_agree_better(*better, *as_given)) return std::nullopt;
  return ClockOffset{-shift, as_given->larger(), better->larger()};
}

PosePairs poses_after(const ClockOffset& offset, const Trajectory& truth, const Trajectory& estimate) {
  const Timeline true_line(truth, origin_of(truth)), line(estimate, origin_of(truth));
  PosePairs poses;
  for (std::size_t i = 0; i < estimate.poses.size(); ++i) {
    const double time = line.times()[i] - offset.later;
    if (!true_line.contains(time)) continue;
    poses.truth.push_back(true_line.at(time));
    poses.estimate.push_back(estimate.poses[i]);
  }
  return poses;
}

std::string describe(const ClockOffset& offset, const Trajectory& truth, const Trajectory& estimate,
                     const PosePairs& poses) {
  const auto aligned_m = [](const PosePairs& pairs) {
    return absolute_trajectory_error(pairs.truth, pairs.estimate, align(pairs.truth, pairs.estimate)).rmse;
  };
  const bool has_stamps = !truth.stamps_ns.empty();
  const char* unit = has_stamps ? "s" : std::abs(offset.later) == 1.0 ? "frame" : "frames";
  return fmt::format(
      "the estimate shows the motion of the ground truth {:.4g} {} {}: speeds differ by {:.1f} %, but by "
      "{:.1f} % after that, and the ATE is then {:.4f} m in place of {:.4f} m; all scores are of the "
      "files as they are; {}",
      std::abs(offset.later), unit, offset.later > 0.0 ? "later" : "earlier",
      100.0 * offset.speed_error_as_given, 100.0 * offset.speed_error,
      aligned_m(poses_after(offset, truth, estimate)), aligned_m(poses),
      has_stamps ? "check both clocks, and correct the stamps of one file"
                 : "check which frame the first line of each file is of");
}

}  // namespace stereo_slam
