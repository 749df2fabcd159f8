// SPDX-License-Identifier: MIT
// make_videos KITTI_DIR OUTPUT_DIR: the images as left.avi, right.avi and both.avi (side by side), with their
// calibration in rectified.yaml.
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "stereo_slam/dataset/sequence.hpp"

namespace fs = std::filesystem;

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto sequence = stereo_slam::open_sequence(argv[1], "kitti");
  const auto& camera = sequence.camera;
  const fs::path output = argv[2];
  const auto open = [&](const char* name, int width_px) {
    return cv::VideoWriter((output / name).string(), cv::CAP_OPENCV_MJPEG,
                           cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10.0,
                           cv::Size(width_px, camera.height_px));
  };
  cv::VideoWriter left = open("left.avi", camera.width_px);
  cv::VideoWriter right = open("right.avi", camera.width_px);
  cv::VideoWriter both = open("both.avi", 2 * camera.width_px);
  if (!left.isOpened() || !right.isOpened() || !both.isOpened()) return 1;
  for (const auto& files : sequence.frames) {
    const cv::Mat images[] = {cv::imread(files.left.string()), cv::imread(files.right.string())};
    left.write(images[0]);
    right.write(images[1]);
    cv::Mat joined;
    cv::hconcat(images, 2, joined);
    both.write(joined);
  }
  std::ofstream calibration(output / "rectified.yaml");
  fmt::print(calibration, "rectified: {{fx: {}, fy: {}, cx: {}, cy: {}, baseline_m: {}}}\n", camera.fx,
             camera.fy, camera.cx, camera.cy, camera.baseline_m);
  return calibration ? 0 : 1;
}
