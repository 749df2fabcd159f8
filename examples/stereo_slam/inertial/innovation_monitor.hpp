// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <deque>
#include <numeric>

namespace stereo_slam {

/// Whether a filter and the motions that it does not predict well contradict each other: by the normalised
/// innovations squared (NIS), of six degrees of freedom each.
class InnovationMonitor {
 public:
  /// Adds the NIS of a motion. `confirmed`: something else agrees with the prediction, so that the motion,
  /// not the prediction, is wrong if they differ.
  void add(double nis, bool confirmed) {
    in_a_row_ = nis > kImpossible && !confirmed ? in_a_row_ + 1 : 0;
    if (nis > kImpossible && confirmed) return;
    values_.push_back(nis < kImpossible ? nis : kImpossible);
    if (values_.size() > kWindow) values_.pop_front();
  }

  /// Whether the motions contradict the predictions persistently.
  [[nodiscard]] bool contradicts() const {
    return in_a_row_ >= kMostInRow || (values_.size() >= kFewest && mean() > kLargestMean);
  }

  /// The mean over the window; 0 without values.
  [[nodiscard]] double mean() const {
    if (values_.empty()) return 0.0;
    return std::accumulate(values_.begin(), values_.end(), 0.0) / static_cast<double>(values_.size());
  }

  /// The NIS of a motion that is not that of the camera: beyond any chance, even if the noise is half as
  /// large again as assumed.
  static constexpr double kImpossible = 100.0;

 private:
  static constexpr std::size_t kWindow = 30, kFewest = 10;
  static constexpr double kLargestMean = 20.0;  // of a right covariance 6; 13.5 with noise as for kImpossible
  static constexpr int kMostInRow = 3;

  std::deque<double> values_;
  int in_a_row_ = 0;
};

}  // namespace stereo_slam
