// SPDX-License-Identifier: MIT
// The floor: what the unavoidable image operations of a stereo odometry cost with OpenCV on this machine.
// Times of the SLAM are given as ratios to it. See docs/results/performance.md.
//
//   slam_floor RECORDING [MAX_FRAMES] [THREADS]
//
// For every frame of the recording (at most 100 unless given otherwise; decoded before): both pyramids of
// three levels with derivatives; FAST with a threshold of 20 on the left image; and optical flow of 300
// points, 9 x 9 pixels, three levels, from the frame before, back, and into the right image. Prints a JSON
// object: medians over the frames, in ms, of wall and CPU time.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <opencv2/core/utility.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/video/tracking.hpp>

#include "stereo_slam/app/process_usage.hpp"
#include "stereo_slam/core/median.hpp"
#include "stereo_slam/dataset/sequence.hpp"

namespace {

using namespace stereo_slam;

using Pyramid = std::vector<cv::Mat>;
using Points = std::vector<cv::Point2f>;

constexpr std::size_t kPoints = 300;
constexpr int kLevels = 3;
const cv::Size kWindow(9, 9);

/// Times of one step, a value for each frame.
struct Step {
  std::string name;
  std::vector<double> wall_ms{};
  std::vector<double> cpu_ms{};
};

template <class Work>
void measure(Step& step, const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  const double start_cpu_ms = process_cpu_ms();
  work();
  step.cpu_ms.push_back(process_cpu_ms() - start_cpu_ms);
  step.wall_ms.push_back(
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
}

/// Fills a pyramid. One of an earlier frame keeps its memory: fresh pages would cost several times the work.
void build_pyramid(const cv::Mat& image, Pyramid& pyramid) {
  cv::buildOpticalFlowPyramid(image, pyramid, kWindow, kLevels - 1, /*withDerivatives=*/true);
}

std::vector<cv::KeyPoint> fast_corners(const cv::Mat& image) {
  std::vector<cv::KeyPoint> corners;
  cv::FAST(image, corners, 20, /*nonmaxSuppression=*/true);
  return corners;
}

/// The best corner of every cell of a grid of kPoints cells, then the strongest of the others.
Points spread(std::vector<cv::KeyPoint> corners, cv::Size size) {
  constexpr int kColumns = 25;
  constexpr int kRows = static_cast<int>(kPoints) / kColumns;
  std::sort(corners.begin(), corners.end(),
            [](const auto& a, const auto& b) { return a.response > b.response; });
  std::array<bool, kPoints> taken{};
  Points best;
  Points others;
  for (const auto& corner : corners) {
    const int column = std::min(static_cast<int>(corner.pt.x) * kColumns / size.width, kColumns - 1);
    const int row = std::min(static_cast<int>(corner.pt.y) * kRows / size.height, kRows - 1);
    bool& cell = taken[static_cast<std::size_t>(row * kColumns + column)];
    (cell ? others : best).push_back(corner.pt);
    cell = true;
  }
  best.insert(best.end(), others.begin(), others.end());
  best.resize(std::min(best.size(), kPoints));
  return best;
}

Points flow(const Pyramid& from, const Pyramid& to, const Points& points) {
  Points moved;
  if (points.empty()) return moved;
  std::vector<unsigned char> found;
  std::vector<float> errors;
  cv::calcOpticalFlowPyrLK(from, to, points, moved, found, errors, kWindow, kLevels - 1);
  return moved;
}

struct Floor {
  std::vector<Step> steps{{"pyramids"}, {"fast"}, {"flow_forward"}, {"flow_back"}, {"flow_right"}};
  Step frame{"frame"};
  double corners = 0.0;  ///< of a frame, on average
};

Floor measure_floor(const std::vector<StereoFrame>& frames) {
  Floor floor;
  Pyramid previous;
  Pyramid left;
  Pyramid right;
  build_pyramid(frames.front().left, previous);
  Points points = spread(fast_corners(frames.front().left), frames.front().left.size());
  for (std::size_t i = 1; i < frames.size(); ++i) {
    std::vector<cv::KeyPoint> corners;
    Points moved;
    measure(floor.frame, [&] {
      measure(floor.steps[0], [&] {
        build_pyramid(frames[i].left, left);
        build_pyramid(frames[i].right, right);
      });
      measure(floor.steps[1], [&] { corners = fast_corners(frames[i].left); });
      measure(floor.steps[2], [&] { moved = flow(previous, left, points); });
      measure(floor.steps[3], [&] { (void)flow(left, previous, moved); });
      measure(floor.steps[4], [&] { (void)flow(left, right, moved); });
    });
    floor.corners += static_cast<double>(corners.size()) / static_cast<double>(frames.size() - 1);
    points = spread(std::move(corners), frames[i].left.size());
    std::swap(previous, left);
  }
  return floor;
}

void print(const Floor& floor, const StereoSequence& sequence, std::size_t frames) {
  const auto medians = [&](const std::vector<double> Step::*times) {
    std::vector<std::string> members;
    for (const auto& step : floor.steps)
      members.push_back(fmt::format(R"("{}": {:.3f})", step.name, median(step.*times)));
    members.push_back(fmt::format(R"("frame": {:.3f})", median(floor.frame.*times)));
    return fmt::format("{{{}}}", fmt::join(members, ", "));
  };
  fmt::print(
      "{{\n  \"frames\": {},\n  \"width_px\": {},\n  \"height_px\": {},\n  \"threads\": {},\n  \"corners\": "
      "{:.0f},\n"
      "  \"wall_ms\": {},\n  \"cpu_ms\": {}\n}}\n",
      frames, sequence.camera.width_px, sequence.camera.height_px, cv::getNumThreads(), floor.corners,
      medians(&Step::wall_ms), medians(&Step::cpu_ms));
}

int run(const std::vector<std::string>& arguments) {
  const StereoSequence sequence = open_sequence(arguments[0], "auto");
  const std::size_t wanted = arguments.size() > 1 ? std::stoul(arguments[1]) : 100;
  if (arguments.size() > 2) cv::setNumThreads(std::stoi(arguments[2]));
  std::vector<StereoFrame> frames;
  while (frames.size() < std::min(wanted, sequence.frames.size()))
    frames.push_back(load_frame(sequence, frames.size()));
  if (frames.size() < 2) throw std::runtime_error(fmt::format("{}: two frames are needed", arguments[0]));
  print(measure_floor(frames), sequence, frames.size());
  return 0;
}

}  // namespace

int main(int count, char** values) {
  const std::vector<std::string> arguments(values + 1, values + count);
  if (arguments.empty() || arguments.size() > 3) {
    fmt::print(stderr, "usage: slam_floor RECORDING [MAX_FRAMES] [THREADS]\n");
    return 2;
  }
  try {
    return run(arguments);
  } catch (const std::exception& error) {
    fmt::print(stderr, "slam_floor: {}\n", error.what());
    return 1;
  }
}
