// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

namespace stereo_slam {

/// The images of both cameras as they were taken, grey.
struct RawPair {
  cv::Mat left;
  cv::Mat right;
  std::optional<std::int64_t> stamp_ns{};  ///< of a live camera; else see StereoSequence::frames
};

/// Image pairs that are not separate files: those of videos, bags and live cameras. Reading in order is fast.
class PairSource {
 public:
  PairSource() = default;
  PairSource(const PairSource&) = delete;
  PairSource& operator=(const PairSource&) = delete;
  virtual ~PairSource() = default;

  /// The images of a frame; nothing where the source ends. A live camera gives its next images, whatever the
  /// index. Throws std::runtime_error that names the source when they cannot be read.
  [[nodiscard]] virtual std::optional<RawPair> read(std::size_t index) = 0;

  /// used_bits() of a frame's images if they have 16 bits a pixel and may use fewer; nothing otherwise.
  /// Throws like read().
  [[nodiscard]] virtual std::optional<int> bits_of_16(std::size_t /*index*/) { return std::nullopt; }

  /// Reads images of 16 bits a pixel as images of `bits` from now on.
  virtual void use_bits(int /*bits*/) {}

  /// A warning for the user about the frames read so far, such as an end before the number of frames in a
  /// header. Empty if there is none.
  [[nodiscard]] virtual std::string warning() { return {}; }
};

/// Splits an image that shows both cameras, the left one on the left. Throws std::invalid_argument for an odd
/// width.
[[nodiscard]] RawPair split(const cv::Mat& side_by_side);

}  // namespace stereo_slam
