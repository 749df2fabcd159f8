// SPDX-License-Identifier: MIT
#include "stereo_slam/app/realtime_reader.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "stereo_slam/app/process_usage.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace std::chrono_literals;

namespace {

using Clock = std::chrono::steady_clock;

/// Frame i has the stamp i * period.
FrameReader::Load frames_every(std::chrono::nanoseconds period) {
  return [period](std::size_t i) {
    StereoFrame frame;
    frame.index = i;
    frame.stamp_ns = period.count() * static_cast<std::int64_t>(i);
    return frame;
  };
}

const auto not_interrupted = [] { return false; };

struct Taken {
  std::vector<std::size_t> frames;
  std::vector<std::int64_t> dropped_ns;
  double reading_delay_s = 0.0;
};

/// Takes all frames; `work` is done after each.
Taken take_all(RealtimeReader& reader, const std::function<void(std::size_t)>& work) {
  Taken taken;
  while (const auto offered = reader.next(not_interrupted)) {
    taken.frames.push_back(offered->read.frame.index);
    taken.dropped_ns.insert(taken.dropped_ns.end(), offered->dropped_ns.begin(), offered->dropped_ns.end());
    taken.reading_delay_s = offered->reading_delay_s;
    work(offered->read.frame.index);
  }
  return taken;
}

}  // namespace

TEST_CASE("No frame is offered before its stamp, and none is dropped if each is taken in time",
          "[realtime]") {
  const auto period = 150ms;
  const auto start = Clock::now();
  RealtimeReader reader(frames_every(period), 4);
  const Taken taken = take_all(reader, [&](std::size_t i) { CHECK(Clock::now() - start >= i * period); });
  CHECK(taken.frames == std::vector<std::size_t>{0, 1, 2, 3});
  CHECK(taken.dropped_ns.empty());
}

TEST_CASE("Who is busy while frames are offered gets the newest, and the stamps of those dropped",
          "[realtime]") {
  RealtimeReader reader(frames_every(1ms), 20);
  const Taken taken = take_all(reader, [](std::size_t i) {
    if (i == 0) std::this_thread::sleep_for(1s);  // all others are offered meanwhile
  });
  REQUIRE(taken.frames.size() >= 2);
  CHECK(taken.frames.front() == 0);
  CHECK(taken.frames.back() == 19);
  CHECK(taken.frames.size() + taken.dropped_ns.size() == 20);
  CHECK(taken.dropped_ns.size() >= 15);
  CHECK(std::is_sorted(taken.dropped_ns.begin(), taken.dropped_ns.end()));
}

TEST_CASE("The time of an offer is that of the stamp, not that at which the frame is taken", "[realtime]") {
  RealtimeReader reader(frames_every(100ms), 2);
  const auto first = reader.next(not_interrupted);
  std::this_thread::sleep_for(400ms);
  const auto second = reader.next(not_interrupted);
  REQUIRE(second);
  CHECK(Clock::now() - second->offered_at >= 250ms);
  CHECK(second->offered_at - first->offered_at >= 100ms);
}

TEST_CASE("Images that are read too late delay all later frames and drop none", "[realtime]") {
  const auto slow = [load = frames_every(1ms)](std::size_t i) {
    std::this_thread::sleep_for(30ms);
    return load(i);
  };
  RealtimeReader reader(slow, 5);
  const Taken taken = take_all(reader, [](std::size_t) {});
  CHECK(taken.frames.size() == 5);
  CHECK(taken.reading_delay_s >= 0.1);  // the last is due 4 ms after the first, and read 120 ms after it
}

TEST_CASE("Reading a dropped frame counts for the frame taken in its place", "[realtime]") {
  const auto busy = [load = frames_every(1ms)](std::size_t i) {
    for (const double start_ms = thread_cpu_ms(); thread_cpu_ms() < start_ms + 2.0;) {
    }
    return load(i);
  };
  RealtimeReader reader(busy, 6);
  CHECK(reader.next(not_interrupted)->read.frame.index == 0);
  std::this_thread::sleep_for(1s);
  const auto last = reader.next(not_interrupted);
  REQUIRE(last);
  CHECK(last->read.frame.index == 5);
  CHECK(last->dropped_ns == std::vector<std::int64_t>{1'000'000, 2'000'000, 3'000'000, 4'000'000});
  CHECK(last->read.cpu_ms >= 5 * 2.0);
}

TEST_CASE("The clock starts when the first frame is taken: it is not_interrupted dropped", "[realtime]") {
  RealtimeReader reader(frames_every(200ms), 3);
  std::this_thread::sleep_for(600ms);
  const auto first = reader.next(not_interrupted);
  REQUIRE(first);
  CHECK(first->read.frame.index == 0);
  CHECK(first->dropped_ns.empty());
  CHECK(reader.next(not_interrupted)->read.frame.index == 1);
}

TEST_CASE("A failed load is rethrown after the frames before it", "[realtime]") {
  RealtimeReader reader(
      [load = frames_every(100ms)](std::size_t i) -> std::optional<StereoFrame> {
        if (i == 2) throw std::runtime_error("frame two");
        return load(i);
      },
      5);
  CHECK(reader.next(not_interrupted)->read.frame.index == 0);
  CHECK(reader.next(not_interrupted)->read.frame.index == 1);
  CHECK_THROWS_WITH(reader.next(not_interrupted), "frame two");
}

TEST_CASE("The wait for a stamp that is hours away ends with a request to stop, and with the reader",
          "[realtime]") {
  RealtimeReader reader(frames_every(2h), 3);
  CHECK(reader.next(not_interrupted)->read.frame.index == 0);
  int polls = 0;
  CHECK_FALSE(reader.next([&] { return ++polls > 2; }));
}

TEST_CASE("A realtime reader without frames ends at once", "[realtime]") {
  RealtimeReader reader(frames_every(1ms), 0);
  CHECK_FALSE(reader.next(not_interrupted));
}
