// SPDX-License-Identifier: MIT
#include "stereo_slam/app/frame_reader.hpp"

#include <atomic>
#include <chrono>
#include <stdexcept>

#include "stereo_slam/app/process_usage.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;

namespace {

StereoFrame numbered(std::size_t index) {
  StereoFrame frame;
  frame.index = index;
  return frame;
}

const auto never = [] { return false; };

}  // namespace

TEST_CASE("Frames come out in order, then nothing", "[reader]") {
  FrameReader reader(numbered, 100);
  for (std::size_t i = 0; i < 100; ++i) {
    const auto frame = reader.next(never);
    REQUIRE(frame);
    CHECK(frame->frame.index == i);
  }
  CHECK_FALSE(reader.next(never));
  CHECK_FALSE(reader.next(never));
}

TEST_CASE("The CPU time of reading a frame is that of its load, and not of waiting", "[reader]") {
  const auto busy_ms = [](double ms) {
    const double start = thread_cpu_ms();
    while (thread_cpu_ms() < start + ms) {
    }
  };
  FrameReader reader(
      [&](std::size_t i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        busy_ms(i == 1 ? 15.0 : 0.0);
        return numbered(i);
      },
      3);
  const double before_ms = process_cpu_ms();
  CHECK(reader.next(never)->cpu_ms < 15.0);  // the wait alone is longer
  CHECK(reader.next(never)->cpu_ms >= 15.0);
  CHECK(reader.next(never)->cpu_ms < 15.0);
  CHECK(process_cpu_ms() - before_ms >= 15.0);
}

TEST_CASE("A failed load is rethrown in place of its frame", "[reader]") {
  FrameReader reader(
      [](std::size_t i) -> StereoFrame {
        if (i == 2) throw std::runtime_error("frame two");
        return numbered(i);
      },
      5);
  CHECK(reader.next(never)->frame.index == 0);
  CHECK(reader.next(never)->frame.index == 1);
  CHECK_THROWS_WITH(reader.next(never), "frame two");
}

TEST_CASE("At most one frame more than the capacity is read ahead", "[reader]") {
  std::atomic<std::size_t> loaded = 0;
  std::atomic<std::size_t> taken = 0;
  std::atomic<std::size_t> most_ahead = 0;
  FrameReader reader(
      [&](std::size_t i) {
        ++loaded;
        most_ahead = std::max(most_ahead.load(), loaded - taken);
        return numbered(i);
      },
      200);
  while (reader.next(never)) ++taken;
  CHECK(taken == 200);
  CHECK(most_ahead <=
        FrameReader::kCapacity + 2);  // full queue, one loading, one just taken and not yet counted
}

TEST_CASE("A reader can be destroyed before its end", "[reader]") {
  FrameReader reader(numbered, 1000);
  CHECK(reader.next(never));
}

TEST_CASE("A request to stop ends the wait for a slow disk", "[reader]") {
  std::atomic<bool> stop = false;
  FrameReader reader(
      [&](std::size_t i) {
        while (!stop) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return numbered(i);
      },
      3);
  int polls = 0;
  CHECK_FALSE(reader.next([&] {
    stop = ++polls > 2;
    return stop.load();
  }));
}

TEST_CASE("A recording without frames ends at once", "[reader]") {
  FrameReader reader(numbered, 0);
  CHECK_FALSE(reader.next(never));
}
