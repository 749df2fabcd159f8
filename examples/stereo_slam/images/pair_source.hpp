// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "stereo_slam/images/grey_image.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {

/// The images of both cameras as they were taken, grey. One that cannot be read is empty.
struct RawPair {
  cv::Mat left;
  cv::Mat right;
  std::optional<std::int64_t> stamp_ns{};  ///< of a live camera; else see StereoSequence::frames
  std::string left_fault{};                ///< why the left image is empty, with its name
  std::string right_fault{};

  [[nodiscard]] bool complete() const { return left_fault.empty() && right_fault.empty(); }
};

/// The image that `load` returns; an empty one, with the reason in `fault`, if it throws std::runtime_error.
[[nodiscard]] inline cv::Mat load_or_fault(const std::function<cv::Mat()>& load, std::string& fault) {
  try {
    return load();
  } catch (const std::runtime_error& error) {
    fault = file_error_text(error);
    return {};
  }
}

/// Throws std::runtime_error with the reason if an image of the pair is empty.
inline void require_complete(const RawPair& pair) {
  if (!pair.complete())
    throw std::runtime_error(pair.left_fault.empty() ? pair.right_fault : pair.left_fault);
}

/// Image pairs that are not separate files: those of videos, bags and live cameras. Reading in order is fast.
class PairSource {
 public:
  PairSource() = default;
  PairSource(const PairSource&) = delete;
  PairSource& operator=(const PairSource&) = delete;
  virtual ~PairSource() = default;

  /// The images of a frame; nothing where the source ends. A live camera gives its next images, whatever the
  /// index. Throws std::runtime_error that names the source when it is damaged as a whole.
  [[nodiscard]] virtual std::optional<RawPair> read(std::size_t index) = 0;

  /// Adds the values of a frame's images. False if one has 8 bits a pixel. Throws std::runtime_error when one
  /// cannot be read.
  [[nodiscard]] virtual bool add_values(std::size_t /*index*/, ValueCounts& /*values*/) { return false; }

  /// Reads images of 16 bits a pixel by this scale from now on.
  virtual void use_scale(const GreyScale& /*scale*/) {}

  /// A warning for the user about the frames read so far, such as an end before the number of frames in a
  /// header. Empty if there is none.
  [[nodiscard]] virtual std::string warning() { return {}; }
};

/// Splits an image that shows both cameras, the left one on the left. Throws std::invalid_argument for an odd
/// width.
[[nodiscard]] inline RawPair split(const cv::Mat& side_by_side) {
  const int width = side_by_side.cols / 2;
  if (side_by_side.cols % 2 != 0) {
    throw std::invalid_argument(
        fmt::format("has {} columns, which are not two images side by side", side_by_side.cols));
  }
  return {side_by_side.colRange(0, width).clone(), side_by_side.colRange(width, 2 * width).clone()};
}

}  // namespace stereo_slam
