// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>

#include "stereo_slam/images/pair_source.hpp"

namespace stereo_slam {

/// Whether a source is not a file but something that delivers images now: /dev/videoN, a URL, or a GStreamer
/// pipeline (with " ! "), if no file or folder has that name.
[[nodiscard]] bool is_live(const std::filesystem::path& source);

/// A stereo camera: two devices, or one that delivers both images side by side. The stamp of a pair is the
/// time at which both images were taken from the driver, in nanoseconds since 1970; stamps increase.
class LiveCamera : public PairSource {
 public:
  /// `right` is empty for images side by side. Throws std::runtime_error when a device cannot be opened.
  LiveCamera(const std::filesystem::path& left, const std::filesystem::path& right);
  ~LiveCamera() override;

  [[nodiscard]] std::optional<RawPair> read(std::size_t index) override;

 private:
  struct Device;

  std::unique_ptr<Device> left_;
  std::unique_ptr<Device> right_;  // null for images side by side
  std::int64_t last_stamp_ns_ = 0;
  bool began_ = false;
};

}  // namespace stereo_slam
