// SPDX-License-Identifier: MIT
// What reading a recording costs: reading_time RECORDING [ROUNDS [MAX_FRAMES]]. See docs/results/bags.md.
//
// Prints the wall and CPU time in ms until the frames are known, and until the first of them is read; the
// mean over the frames (at most 200) of the shortest wall time of ROUNDS (5) in which its images are read;
// and the peak of the memory in MB.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <ctime>
#include <exception>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <utility>
#include <vector>

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/dataset/sequence.hpp"

namespace {

using namespace stereo_slam;

/// Wall and CPU time since it was made, in ms.
class Watch {
 public:
  [[nodiscard]] double wall_ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_).count();
  }
  [[nodiscard]] double cpu_ms() const {
    return 1e3 * static_cast<double>(std::clock() - cpu_begin_) / CLOCKS_PER_SEC;
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::clock_t cpu_begin_ = std::clock();
};

StereoSequence open(const std::string& recording) {
  if (!is_bag_recording(recording)) return open_sequence(recording, "auto");
  auto scan = scan_bag(recording, {});
  for (const auto& problem : scan.problems) {
    if (is_error(problem)) throw std::runtime_error(problem.text);
  }
  return std::move(scan.sequence);
}

void measure(const std::string& recording, int rounds, std::size_t most_frames) {
  const Watch watch;
  const StereoSequence sequence = open(recording);
  std::printf("frames known: %.0f ms, CPU %.0f ms\n", watch.wall_ms(), watch.cpu_ms());
  (void)load_frame(sequence, 0);
  std::printf("first frame read: %.0f ms, CPU %.0f ms\n", watch.wall_ms(), watch.cpu_ms());
  std::vector<double> shortest_ms(std::min(sequence.frames.size(), most_frames),
                                  std::numeric_limits<double>::max());
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < shortest_ms.size(); ++i) {
      const Watch of_frame;
      (void)load_frame(sequence, i);
      shortest_ms[i] = std::min(shortest_ms[i], of_frame.wall_ms());
    }
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf(
      "a frame: %.3f ms (%zu of %zu frames); peak %.0f MB\n",
      std::accumulate(shortest_ms.begin(), shortest_ms.end(), 0.0) / static_cast<double>(shortest_ms.size()),
      shortest_ms.size(), sequence.frames.size(), static_cast<double>(usage.ru_maxrss) / 1024.0);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::fputs("usage: reading_time RECORDING [ROUNDS [MAX_FRAMES]]\n", stderr);
    return 2;
  }
  try {
    measure(argv[1], argc > 2 ? std::stoi(argv[2]) : 5, argc > 3 ? std::stoul(argv[3]) : 200);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "reading_time: %s\n", error.what());
    return 1;
  }
  return 0;
}
