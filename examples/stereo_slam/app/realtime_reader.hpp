// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "stereo_slam/app/frame_reader.hpp"

namespace stereo_slam {

/// A frame as a live camera would have offered it.
struct OfferedFrame {
  ReadFrame read;
  std::chrono::steady_clock::time_point offered_at;
  std::vector<std::int64_t> dropped_ns{};  ///< stamps of the frames dropped since the last one taken
  double reading_delay_s = 0.0;            ///< how late it was offered because of slow reading
};

/// When frames are offered.
enum class Pace {
  kStamps,  ///< at the pace of the stamps, for a recording
  kAsRead,  ///< as soon as they are read, for a live camera
};

/// Offers the frames of a recording at the pace of their stamps, as a camera does; or those of a live camera.
///
/// With Pace::kStamps the first frame is offered as soon as it is read, and the clock starts when it is
/// taken. Every further frame is offered when the time since the frame before equals the difference of their
/// stamps. A frame that was not taken when the next one is offered is dropped. If an image is read too late,
/// that frame and all after it are offered later by the delay: slow reading drops no frame.
class RealtimeReader {
 public:
  /// Reads as FrameReader does.
  RealtimeReader(FrameReader::Load load, std::size_t count, Pace pace = Pace::kStamps);

  /// Waits for a frame that was not taken yet; nothing after the last one, or as soon as `stop` returns true.
  /// Rethrows the exception of a load in place of its frame.
  std::optional<OfferedFrame> next(const std::function<bool()>& stop);

 private:
  using Clock = std::chrono::steady_clock;

  void offer_all(const std::stop_token& stop);
  [[nodiscard]] Clock::time_point not_before_now(Clock::time_point due);
  void offer(ReadFrame read, Clock::time_point at, const std::stop_token& stop);

  Pace pace_;
  FrameReader reader_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<OfferedFrame> offered_;
  Clock::duration reading_delay_{};  // of the offering thread
  std::exception_ptr failure_;
  bool finished_ = false;
  std::jthread thread_;  // last: ends before what it uses
};

}  // namespace stereo_slam
