// SPDX-License-Identifier: MIT
// The time of StereoSlam::process, called from C++: process_time RECORDING FX FY CX CY BASELINE_M. The
// recording is one in KITTI layout with grey images, which are read before. Prints the mean wall and CPU time
// of a frame in ms, and the last position.
#include <chrono>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <stereo_slam/stereo_slam.hpp>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/imgcodecs.hpp>

int main(int argc, char** argv) try {
  if (argc != 7) return std::fprintf(stderr, "usage: process_time RECORDING FX FY CX CY BASELINE_M\n"), 2;
  const std::filesystem::path folder = argv[1];
  std::vector<std::pair<cv::Mat, cv::Mat>> pairs;
  while (true) {
    char name[16];
    std::snprintf(name, sizeof name, "%06zu.png", pairs.size());
    if (!exists(folder / "image_0" / name)) break;
    pairs.emplace_back(cv::imread((folder / "image_0" / name).string(), cv::IMREAD_GRAYSCALE),
                       cv::imread((folder / "image_1" / name).string(), cv::IMREAD_GRAYSCALE));
  }
  stereo_slam::StereoSlam slam(stereo_slam::StereoCamera{.fx = std::stod(argv[2]),
                                                         .fy = std::stod(argv[3]),
                                                         .cx = std::stod(argv[4]),
                                                         .cy = std::stod(argv[5]),
                                                         .baseline_m = std::stod(argv[6])});
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto begin = std::chrono::steady_clock::now();
    const std::clock_t cpu_begin = std::clock();
    const auto frame =
        slam.process(pairs[i].first, pairs[i].second, static_cast<std::int64_t>(i) * 100'000'000);
    const Eigen::Matrix4d T = frame.T_world_camera.pose.isometry().matrix();
    const Eigen::Matrix<double, 6, 6> P = frame.T_world_camera.covariance;
    const double cpu_ms = 1e3 * static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC;
    const double wall_ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    std::printf("%.9f %.9e %.4f %.4f\n", T(2, 3), P(5, 5), wall_ms, cpu_ms);
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "process_time: %s\n", error.what());
  return 1;
}
